"""Time series of the vehicles that matter to a run's results: injected ones and those expected of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple
from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.clock import time_of_tick_s
from xgv_cosim.columns import FloatColumn, IntColumn
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.metrics.surrogate import time_to_collision_s
from xgv_cosim.snapshot import Snapshot

STANDARD_GRAVITY_MPS2 = 9.80665


class VehicleSeries(NamedTuple):
    """One vehicle's series, one value per world step; every column has shape ``(steps,)``."""

    t_s: FloatColumn
    x_m: FloatColumn
    y_m: FloatColumn
    speed_mps: FloatColumn
    accel_mps2: FloatColumn
    distance_m: FloatColumn
    """Distance driven since the series began."""
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
    """Collects the series; an observer of the simulation.

    Args:
        vehicle_ids: Vehicles to watch from the start; an injection adds its vehicle.
    """

    def __init__(self, vehicle_ids: Iterable[str] = ()) -> None:
        self._wanted = set(vehicle_ids)
        self._rows: dict[str, list[tuple[float, ...]]] = {}
        self._contacts: dict[tuple[str, str], Contact] = {}
        self.events: list[Event] = []
        self.num_vehicles_max = 0
        self.num_bound_max = 0

    def record_event(self, event: Event) -> None:
        """Keep an event; watch the vehicle of an injection from now on."""
        self.events.append(event)
        if event.kind == "injection":
            self._wanted.add(event.vehicle)

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Append a row for each watched vehicle that is bound."""
        self.num_vehicles_max = max(self.num_vehicles_max, len(snapshot.ids))
        self.num_bound_max = max(self.num_bound_max, len(fleet.bound_ids))
        for contact in snapshot.collisions:
            began = Contact(time_of_tick_s(tick), *astuple(contact))
            self._contacts.setdefault((contact.collider, contact.victim), began)
        watched = [(slot, name) for slot, name in fleet if name in self._wanted and name in snapshot.index_of]
        if not watched:
            return
        slots = np.array([slot for slot, _ in watched], np.int64)
        rows = np.array([snapshot.index_of[name] for _, name in watched], np.int64)
        own = fleet.motion.speed_mps[slots]
        leader, follower = snapshot.leader[rows], snapshot.follower[rows]
        leader_gap = np.where(leader >= 0, snapshot.leader_gap_m[rows], np.inf)
        follower_gap = np.where(follower >= 0, snapshot.follower_gap_m[rows], np.inf)
        columns = (
            np.full(slots.size, time_of_tick_s(tick)),
            fleet.motion.x_m[slots],
            fleet.motion.y_m[slots],
            own,
            fleet.motion.accel_mps2[slots],
            fleet.motion.travelled_m[slots],
            fleet.safety_mode[slots],
            fleet.longitudinal[slots],
            fleet.lateral[slots],
            leader_gap,
            time_to_collision_s(leader_gap, own, snapshot.speed_mps[leader]),
            follower_gap,
            time_to_collision_s(follower_gap, snapshot.speed_mps[follower], own),
            demanded_decel_mps2(fleet)[slots],
        )
        for (_, name), *values in zip(watched, *(column.tolist() for column in columns), strict=True):
            self._rows.setdefault(name, []).append(tuple(values))

    @property
    def collisions(self) -> tuple[Contact, ...]:
        """Return each contact of two vehicles once, however many steps it lasted."""
        return tuple(self._contacts.values())

    def series(self) -> dict[str, VehicleSeries]:
        """Return the series of each watched vehicle that was ever bound."""
        return {name: _series_of(np.array(rows)) for name, rows in self._rows.items()}


def demanded_decel_mps2(fleet: Fleet) -> FloatColumn:
    """Return the deceleration that each slot's mode demands, NaN where it demands no stop.

    A full brake demands what brake and tyres give on this road, whichever is less.
    """
    full = np.minimum(
        fleet.parameters.max_brake_decel_mps2, fleet.parameters.friction * STANDARD_GRAVITY_MPS2
    )
    pausing = fleet.longitudinal == Longitudinal.CONTROLLED_STOP
    braking = fleet.longitudinal == Longitudinal.FULL_BRAKE
    return np.where(pausing, fleet.stop_decel_mps2, np.where(braking, full, np.nan))


def _series_of(table: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> VehicleSeries:
    t, x, y, speed, accel, travelled, mode, longitudinal, lateral, *gaps = table.T
    whole = (mode.astype(np.int64), longitudinal.astype(np.int64), lateral.astype(np.int64))
    return VehicleSeries(t, x, y, speed, accel, np.cumsum(travelled), *whole, *gaps)
