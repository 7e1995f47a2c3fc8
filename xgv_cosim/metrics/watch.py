"""What a run's results are computed from: series of the vehicles that matter, least gaps of all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple
from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.clock import time_of_tick_s
from xgv_cosim.columns import FloatColumn, IntColumn
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.metrics.gaps import GapLows, LeastGaps
from xgv_cosim.metrics.placements import PlacementRow, Placements
from xgv_cosim.metrics.standing import Standing
from xgv_cosim.metrics.surrogate import time_to_collision_s
from xgv_cosim.parameters import GRAVITY_MPS2
from xgv_cosim.snapshot import Snapshot


class VehicleSeries(NamedTuple):
    """One vehicle's series, one value per world step; every column has shape ``(steps,)``."""

    t_s: FloatColumn
    x_m: FloatColumn
    y_m: FloatColumn
    speed_mps: FloatColumn
    accel_mps2: FloatColumn
    distance_m: FloatColumn
    """Distance driven since the vehicle was bound."""
    safety_mode: IntColumn
    """The profile's code."""
    longitudinal: IntColumn
    """``actuation.Longitudinal``."""
    lateral: IntColumn
    """``actuation.Lateral``."""
    leader_gap_m: FloatColumn
    leader_ttc_s: FloatColumn
    """Time to collision with the leader."""
    follower_gap_m: FloatColumn
    follower_ttc_s: FloatColumn
    """The follower's time to collision with this vehicle."""
    demanded_decel_mps2: FloatColumn
    """Deceleration that the mode in force demands, NaN where it demands no stop."""


class Contact(NamedTuple):
    """One collision that the world reported, at the step in which it began."""

    t_s: float
    collider: str
    victim: str
    kind: str
    lane_id: str
    position_m: float


class Watch:
    """Collects the series, and the least gaps of every bound vehicle; an observer of the simulation.

    Args:
        vehicle_ids: Vehicles to watch from the start; an injection adds its vehicle. The series of the
            latter begins with the world step before the injection, as far as the vehicle was bound then.
    """

    def __init__(self, vehicle_ids: Iterable[str] = ()) -> None:
        self._wanted = set(vehicle_ids)
        self._rows: dict[str, list[tuple[float, ...]]] = {}
        self._contacts: dict[tuple[str, str], Contact] = {}
        self._touching: dict[frozenset[str], float] = {}
        """Pairs that have touched, with the gap that counts in this step: 0 in the first, then none."""
        self._gaps = LeastGaps()
        self._placements = Placements()
        self.standing = Standing()
        self._odometer_m: dict[str, float] = {}
        self._last_rows: dict[str, int] = {}
        self._last_table = np.zeros((0, len(VehicleSeries._fields)))
        self.events: list[Event] = []
        self.num_vehicles_max = 0
        self.num_bound_max = 0

    def record_event(self, event: Event) -> None:
        """Keep an event; watch the vehicle of an injection from the last step before it on."""
        self.events.append(event)
        if event.kind == "injection" and event.vehicle not in self._wanted:
            self._wanted.add(event.vehicle)
            self._keep(event.vehicle)

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Append a row for each watched vehicle that is bound; note the gaps of all that are."""
        self.num_vehicles_max = max(self.num_vehicles_max, len(snapshot.ids))
        self.num_bound_max = max(self.num_bound_max, len(fleet.bound_ids))
        self.standing.note(time_of_tick_s(tick), fleet)
        touched = {frozenset(pair) for pair in self._contacts}
        for contact in snapshot.collisions:
            began = Contact(time_of_tick_s(tick), *astuple(contact))
            self._contacts.setdefault((contact.collider, contact.victim), began)
        self._touching = {frozenset(pair): 0.0 for pair in self._contacts} | dict.fromkeys(touched, np.inf)
        present = [(slot, name) for slot, name in fleet if name in snapshot.index_of]
        names = [name for _, name in present]
        self._last_rows = {name: row for row, name in enumerate(names)}
        self._last_table = self._table(tick, fleet, snapshot, [slot for slot, _ in present], names)
        for name in self._wanted & self._last_rows.keys():
            self._keep(name)

    def _keep(self, name: str) -> None:
        """Add a vehicle's row of the last step to its series."""
        row = self._last_rows.get(name)
        if row is not None:
            self._rows.setdefault(name, []).append(tuple(self._last_table[row].tolist()))

    def _table(
        self, tick: int, fleet: Fleet, snapshot: Snapshot, at: Sequence[int], names: Sequence[str]
    ) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Return a row of ``VehicleSeries`` for each vehicle, shape ``(n, columns)``."""
        slots = np.array(at, np.int64)
        rows = np.array([snapshot.index_of[name] for name in names], np.int64)
        self._placements.note(snapshot, names, rows)
        own = fleet.motion.speed_mps[slots]
        leader, follower = snapshot.leader[rows], snapshot.follower[rows]
        leader_gap = np.where(leader >= 0, snapshot.leader_gap_m[rows], np.inf)
        follower_gap = np.where(follower >= 0, snapshot.follower_gap_m[rows], np.inf)
        self._end_gaps(snapshot, names, leader, leader_gap)
        self._end_gaps(snapshot, names, follower, follower_gap)
        self._gaps.note(time_of_tick_s(tick), names, leader_gap, follower_gap)
        columns = VehicleSeries(
            t_s=np.full(slots.size, time_of_tick_s(tick)),
            x_m=fleet.motion.x_m[slots],
            y_m=fleet.motion.y_m[slots],
            speed_mps=own,
            accel_mps2=fleet.motion.accel_mps2[slots],
            distance_m=self._driven_m(names, fleet.motion.travelled_m[slots]),
            safety_mode=fleet.safety_mode[slots].astype(np.int64),
            longitudinal=fleet.longitudinal[slots].astype(np.int64),
            lateral=fleet.lateral[slots].astype(np.int64),
            leader_gap_m=leader_gap,
            leader_ttc_s=time_to_collision_s(leader_gap, own, snapshot.speed_mps[leader]),
            follower_gap_m=follower_gap,
            follower_ttc_s=time_to_collision_s(follower_gap, snapshot.speed_mps[follower], own),
            demanded_decel_mps2=demanded_decel_mps2(fleet)[slots],
        )
        return np.column_stack([column.astype(np.float64) for column in columns])

    def _end_gaps(
        self, snapshot: Snapshot, names: Sequence[str], neighbours: IntColumn, gaps_m: FloatColumn
    ) -> None:
        """Set the gaps of vehicles that touch to 0, and of those that have touched before to ``inf``."""
        if not self._touching:
            return
        for row, (name, neighbour) in enumerate(zip(names, neighbours.tolist(), strict=True)):
            if neighbour >= 0:
                pair = frozenset((name, snapshot.ids[neighbour]))
                gaps_m[row] = self._touching.get(pair, gaps_m[row])

    def _driven_m(self, names: Sequence[str], travelled_m: FloatColumn) -> FloatColumn:
        for name, metres in zip(names, travelled_m.tolist(), strict=True):
            self._odometer_m[name] = self._odometer_m.get(name, 0.0) + metres
        return np.array([self._odometer_m[name] for name in names], np.float64)

    @property
    def collisions(self) -> tuple[Contact, ...]:
        """Return each contact of two vehicles once, however many steps it lasted."""
        return tuple(self._contacts.values())

    @property
    def gap_lows(self) -> dict[str, GapLows]:
        """Return how the least gaps of every vehicle that was ever bound went down."""
        return self._gaps.lows()

    @property
    def placements(self) -> dict[str, PlacementRow]:
        """Return how exactly the world had every vehicle that was ever bound."""
        return self._placements.rows()

    def series(self) -> dict[str, VehicleSeries]:
        """Return the series of each watched vehicle that was ever bound."""
        return {name: _series_of(np.array(rows)) for name, rows in self._rows.items()}


def demanded_decel_mps2(fleet: Fleet) -> FloatColumn:
    """Return the deceleration that each slot's mode demands, NaN where it demands no stop.

    A full brake demands what brake and tyres give on this road, whichever is less.
    """
    full = np.minimum(fleet.parameters.max_brake_decel_mps2, fleet.parameters.friction * GRAVITY_MPS2)
    pausing = fleet.longitudinal == Longitudinal.CONTROLLED_STOP
    braking = fleet.longitudinal == Longitudinal.FULL_BRAKE
    return np.where(pausing, fleet.stop_decel_mps2, np.where(braking, full, np.nan))


def _series_of(table: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> VehicleSeries:
    series = VehicleSeries(*table.T)
    return series._replace(
        safety_mode=series.safety_mode.astype(np.int64),
        longitudinal=series.longitudinal.astype(np.int64),
        lateral=series.lateral.astype(np.int64),
    )
