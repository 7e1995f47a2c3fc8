"""The ways of vehicles that have a stack: kept from step to step, read anew where lane or route changed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.worlds.sumo.routes import RoutePlan, Way, plan_route, way_along
from xgv_cosim.worlds.sumo.ways import Line, PaddedLanes, Ways, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.worlds.sumo.conflicts import Conflicts
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.network import SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad

_SIGHT_M = 250.0
"""How far beyond its lane a vehicle's way is followed."""
_REPLAN_S = 1.0
"""So often a vehicle's route and class are read again: somebody may have given it others."""
SIDES = (1, -1)
"""Left, right."""


class BesideWay(NamedTuple):
    """The lane beside that may be changed to, and those that follow it."""

    lanes: tuple[int, ...] = ()
    starts_m: tuple[float, ...] = ()
    offset_m: float = math.nan
    """From the own centre line to that lane's, positive left."""
    scale: float = 1.0
    """Metres of that lane for each of the own one."""


@dataclass(slots=True)
class KnownWay:
    """What is kept of one vehicle from step to step."""

    vehicle_class: str
    plan: RoutePlan
    read_s: float
    index: int
    """Edge of the route that it is on, or has left for the junction that it is in."""
    lane: int
    way: Way
    lines: tuple[Line, ...] = ()
    limits: tuple[tuple[float, float], ...] = ()
    """(where, limit) of each change of the limit along the way."""
    beside: tuple[BesideWay, BesideWay] = (BesideWay(), BesideWay())
    """To the left, to the right."""


_NO_WAY = Way((-1,), (0.0,), math.inf, math.inf, 0)


def nowhere() -> KnownWay:
    """Return what is known of a vehicle that has not been on the road yet."""
    return KnownWay("", RoutePlan((), ()), -math.inf, 0, -1, _NO_WAY)


@dataclass(slots=True)
class BesideColumns:
    """The lanes beside, of all vehicles."""

    ways: PaddedLanes
    offset_m: FloatColumn
    scale: FloatColumn

    @classmethod
    def of(cls, count: int) -> BesideColumns:
        """Return columns that say: no lane."""
        return cls(PaddedLanes.of(count), np.full(count, np.nan), np.ones(count))

    def put(self, number: int, beside: BesideWay) -> None:
        """Replace one vehicle's."""
        self.ways.put(number, beside.lanes, beside.starts_m)
        self.offset_m[number], self.scale[number] = beside.offset_m, beside.scale


@dataclass(slots=True)
class KnownWays:
    """The ways of some vehicles, as objects and as columns in the order in which they are asked for."""

    engine: Engine
    road: SumoRoad
    network: SumoNetwork
    conflicts: Conflicts
    ids: tuple[str, ...] = ()
    entries: list[KnownWay] = field(default_factory=list)
    ways: Ways = field(default_factory=lambda: Ways.of(0))
    beside: tuple[BesideColumns, BesideColumns] = field(
        default_factory=lambda: (BesideColumns.of(0), BesideColumns.of(0))
    )
    here_m: FloatColumn = field(default_factory=lambda: np.zeros(0))
    """Where on its way each was last, from the beginning of the way's first lane."""
    has_limits: BoolColumn = field(default_factory=lambda: np.zeros(0, np.bool_))
    has_lines: BoolColumn = field(default_factory=lambda: np.zeros(0, np.bool_))
    has_signals: BoolColumn = field(default_factory=lambda: np.zeros(0, np.bool_))
    _lane: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    _read_s: FloatColumn = field(default_factory=lambda: np.zeros(0))

    def renew(self, vehicle_ids: Sequence[str], lane: IntColumn, now_s: float) -> None:
        """Bring everything up to date: a lane of -1 leaves a vehicle the way that it has left."""
        if tuple(vehicle_ids) != self.ids:
            self._reorder(tuple(vehicle_ids))
        due = (lane >= 0) & ((lane != self._lane) | (now_s - self._read_s >= _REPLAN_S - 1e-9))
        for number in np.flatnonzero(due).tolist():
            before = self.entries[number]
            entry = self._renewed(self.ids[number], before, int(lane[number]), now_s)
            self._lane[number], self._read_s[number] = entry.lane, entry.read_s
            if entry is not before:
                self._put(number, entry)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that has left the world: whoever has its id later is another."""
        if vehicle_id in self.ids:
            self._reorder(tuple(name for name in self.ids if name != vehicle_id))

    def _reorder(self, ids: tuple[str, ...]) -> None:
        known = dict(zip(self.ids, zip(self.entries, self.here_m.tolist(), strict=True), strict=True))
        kept = [known.get(name) or (nowhere(), 0.0) for name in ids]
        count = len(ids)
        self.ids, self.entries = ids, [entry for entry, _ in kept]
        self.here_m = np.array([here_m for _, here_m in kept], np.float64)
        self.ways, self.beside = Ways.of(count), (BesideColumns.of(count), BesideColumns.of(count))
        self.has_limits, self.has_lines, self.has_signals = np.zeros((3, count), np.bool_)
        self._lane = np.array([entry.lane for entry in self.entries], np.int64)
        self._read_s = np.array([entry.read_s for entry in self.entries], np.float64)
        for number, entry in enumerate(self.entries):
            self._put(number, entry)

    def _put(self, number: int, entry: KnownWay) -> None:
        self.entries[number] = entry
        self.ways.put(number, entry.way)
        self.has_limits[number], self.has_lines[number] = bool(entry.limits), bool(entry.lines)
        self.has_signals[number] = any(line.signal is not None for line in entry.lines)
        for columns, beside in zip(self.beside, entry.beside, strict=True):
            columns.put(number, beside)

    def _renewed(self, vehicle_id: str, before: KnownWay, lane: int, now_s: float) -> KnownWay:
        """Return what is known of a vehicle, the same object where lane, route and class are the same."""
        vehicle = self.engine.vehicle
        vehicle_class, plan, read_s = before.vehicle_class, before.plan, before.read_s
        if now_s - read_s >= _REPLAN_S - 1e-9:
            route, read_s = tuple(vehicle.getRoute(vehicle_id)), now_s
            vehicle_class = vehicle.getVehicleClass(vehicle_id)
            is_same = route == plan.edges and vehicle_class == before.vehicle_class
            if is_same and before.lane == lane:
                before.read_s = now_s
                return before
            if not is_same:
                plan = plan_route(self.road, self.network, route, vehicle_class)
        index = vehicle.getRouteIndex(vehicle_id)
        way = way_along(self.road, self.network, plan, index, lane, _SIGHT_M)
        return KnownWay(
            vehicle_class,
            plan,
            read_s,
            index,
            lane,
            way,
            lines_of(self.network, self.conflicts, way),
            self._limits(way),
            (
                self._beside(SIDES[0], lane, plan, index, vehicle_class),
                self._beside(SIDES[1], lane, plan, index, vehicle_class),
            ),
        )

    def _limits(self, way: Way) -> tuple[tuple[float, float], ...]:
        """Return (where, limit) of each change of the limit along a way."""
        found: list[tuple[float, float]] = []
        before = float(self.road.limits_mps[way.lanes[0]])
        for lane, start_m in zip(way.lanes[1:], way.starts_m[1:], strict=True):
            limit = float(self.road.limits_mps[lane])
            if limit != before:
                found.append((start_m, limit))
            before = limit
        return tuple(found)

    def _beside(self, side: int, lane: int, plan: RoutePlan, index: int, vehicle_class: str) -> BesideWay:
        """Return the lane to one side and those that follow it, along the route where it leads there."""
        road, other = self.road, self.network.beside(lane, side, vehicle_class)
        if other < 0:
            return BesideWay()
        choice = plan.choices[index].get(other) if 0 <= index < len(plan.choices) else None
        if choice is not None and choice.onward:
            lanes = (other, *choice.onward)
        else:
            lanes = (other, *(link.first for link in self.network.links[other][:1]))
        lengths_m = road.lengths_m[list(lanes)]
        starts_m = (0.0, *np.cumsum(lengths_m[:-1]).tolist())
        offset_m = side * 0.5 * float(road.widths_m[lane] + road.widths_m[other])
        return BesideWay(
            lanes, starts_m, offset_m, float(road.lengths_m[other] / max(road.lengths_m[lane], 1e-6))
        )
