"""What surrounds the bound vehicles of a SUMO world: way, neighbours, signals, right of way.

What does not change is read once; per step SUMO is asked only what it alone knows: the states of the
signals in sight, and the routes of those who have just come onto a road to a junction that matters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.surroundings import (
    PREVIEW_M,
    Beside,
    Foe,
    Junction,
    Signal,
    Surroundings,
    lateral_m,
    leaders_of,
    rows_of,
)
from xgv_cosim.worlds.sumo.blockers import bodies_in_the_way
from xgv_cosim.worlds.sumo.conflicts import Conflicts
from xgv_cosim.worlds.sumo.foes import FoesOf, RoutesAhead, Signals
from xgv_cosim.worlds.sumo.network import SumoNetwork
from xgv_cosim.worlds.sumo.routes import RoutePlan, Way, plan_route, way_along
from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic
from xgv_cosim.worlds.sumo.ways import Line, Ways, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

_SIGHT_M = 250.0
"""How far beyond its lane a vehicle's way is followed."""
_REPLAN_S = 1.0
"""So often a vehicle's route is read again: somebody may have given it another."""
_FOES_FROM_M = 80.0
"""From so far off a junction others are looked for at it, further at speeds that need it."""
_FOES_DECEL_MPS2 = 2.0
_RIGHT_OF_WAY = {
    "m": "minor", "g": "minor", "o": "minor", "u": "minor", "r": "minor", "y": "major", "Y": "major",
    "s": "stop", "=": "equal", "w": "allway_stop", "Z": "zipper",
}  # fmt: skip
_GO_FIRST = frozenset("GMO")
"""Who has one of these goes before all who are not inside the junction yet."""


_SAME_M = 0.5
"""A body in the way counts when it is nearer than the leader by this much."""
_BACK_M, _ONWARD_M = 3.0, 30.0
"""So far before and behind its last place on its way a vehicle off the road is looked for."""


@dataclass(slots=True)
class _Known:
    """What is kept of one vehicle from step to step."""

    vehicle_class: str
    plan: RoutePlan
    read_s: float
    index: int
    """Edge of the route that it is on, or has left for the junction that it is in."""
    lane: int
    way: Way
    lines: tuple[Line, ...]
    limits: tuple[tuple[float, float], ...]
    here_m: float = 0.0
    """Where on its way it was last, from the beginning of the way's first lane."""


NOWHERE = _Known("", RoutePlan((), ()), -math.inf, 0, -1, Way((-1,), (0.0,), math.inf, math.inf, 0), (), ())
"""Of a vehicle that has not been on the road yet."""


@dataclass(slots=True)
class SurroundingsReader:
    """Reads what surrounds vehicles, see ``Surroundings``."""

    engine: Engine
    road: SumoRoad
    network: SumoNetwork
    _conflicts: Conflicts
    _routes: RoutesAhead
    _known: dict[str, _Known] = field(default_factory=dict)

    @classmethod
    def of(cls, engine: Engine, road: SumoRoad) -> SurroundingsReader:
        """Return a reader for an open simulation."""
        network = SumoNetwork.read(engine, road)
        return cls(engine, road, network, Conflicts(engine, road, network), RoutesAhead(engine))

    def read(self, snapshot: Snapshot, vehicle_ids: Sequence[str]) -> Surroundings:
        """Return what surrounds vehicles of the snapshot."""
        rows = rows_of(snapshot, vehicle_ids)
        lane, position_m = snapshot.lane[rows], snapshot.lane_position_m[rows].copy()
        on_road = lane >= 0
        self._known = {name: self._known[name] for name in vehicle_ids if name in self._known}
        known = [
            self._renewed(name, int(number), snapshot.time_s)
            if number >= 0
            else self._known.get(name, NOWHERE)
            for name, number in zip(vehicle_ids, lane.tolist(), strict=True)
        ]
        ways = Ways.of([entry.way for entry in known])
        for number in np.flatnonzero(~on_road & (ways.lanes[:, 0] >= 0)).tolist():
            position_m[number] = self._nearest_m(known[number], snapshot, int(rows[number]))
        positions = position_m.tolist()
        for entry, here_m in zip(known, positions, strict=True):
            entry.here_m = here_m
        way_x_m, way_y_m, heading_rad = self._preview(ways, position_m)
        traffic = LaneTraffic.of(self.road, snapshot.lane, snapshot.lane_position_m)
        left_m = ways.first_left_m(position_m)
        leader_gap_m, leader_speed_mps = self._leaders(snapshot, rows, position_m, ways, traffic)
        blocked_m, blocker_mps = bodies_in_the_way(
            snapshot, rows, way_x_m, way_y_m, ways.lanes, self.road.inside_junction, self.road.junctions
        )
        blocked = blocked_m < leader_gap_m - _SAME_M
        leader_gap_m = np.where(blocked, blocked_m, leader_gap_m)
        leader_speed_mps = np.where(blocked, blocker_mps, leader_speed_mps)
        has_way = ways.lanes[:, 0] >= 0
        signals = Signals(self.engine)
        self._routes.keep(snapshot.index_of)
        foes = FoesOf(snapshot, traffic, self.network, self._conflicts, self._routes, signals)
        return Surroundings(
            way_x_m=way_x_m,
            way_y_m=way_y_m,
            has_way=has_way,
            lane=lane,
            lateral_m=lateral_m(snapshot, rows, way_x_m[:, 0], way_y_m[:, 0], heading_rad),
            lane_width_m=self.road.lane_width_m(ways.lanes[:, 0]),
            limit_mps=np.where(has_way, self.road.lane_limit_mps(ways.lanes[:, 0]), np.inf),
            limits_ahead=tuple(
                tuple((at_m - here_m, limit) for at_m, limit in entry.limits if at_m > here_m)
                for entry, here_m in zip(known, positions, strict=True)
            ),
            lane_end_m=left_m.lane_end_m,
            lane_changes=np.where(on_road, ways.changes, 0),
            route_end_m=left_m.route_end_m,
            leader_gap_m=leader_gap_m,
            leader_speed_mps=leader_speed_mps,
            left=self._beside(1, snapshot, rows, known, traffic),
            right=self._beside(-1, snapshot, rows, known, traffic),
            signals=_next_signals(known, positions, signals),
            junctions=tuple(
                self._junction(
                    next((line for line in entry.lines if line.exit_m > here_m), None), here_m, speed, foes
                )
                if here
                else None
                for entry, here_m, speed, here in zip(
                    known,
                    positions,
                    snapshot.speed_mps[rows].tolist(),
                    on_road.tolist(),
                    strict=True,
                )
            ),
        )

    def _nearest_m(self, entry: _Known, snapshot: Snapshot, row: int) -> float:
        """Return the place on its way nearest to a vehicle off the road, not far from the last one."""
        near_m = entry.here_m + np.arange(-_BACK_M, _ONWARD_M, 0.5)
        lane, along_m = Ways.of([entry.way]).at(near_m[None, :])
        points = self.road.points_ahead(lane[0], along_m[0], np.full(lane.shape[1], -1, np.int64))
        distance_m = np.hypot(points.x_m - snapshot.front_x_m[row], points.y_m - snapshot.front_y_m[row])
        return float(near_m[np.argmin(distance_m)])

    def _renewed(self, vehicle_id: str, lane: int, now_s: float) -> _Known:
        """Return what is known of a vehicle, its way anew where its lane or route has changed."""
        entry = self._known.get(vehicle_id)
        late = entry is None or now_s - entry.read_s >= _REPLAN_S - 1e-9
        if entry is not None and not late and entry.lane == lane:
            return entry
        vehicle = self.engine.vehicle
        vehicle_class = entry.vehicle_class if entry else vehicle.getVehicleClass(vehicle_id)
        plan, read_s = (entry.plan, entry.read_s) if entry else (RoutePlan((), ()), now_s)
        if late:
            route, read_s = tuple(vehicle.getRoute(vehicle_id)), now_s
            if entry is not None and route == plan.edges and entry.lane == lane:
                entry.read_s = now_s
                return entry
            if route != plan.edges:
                plan = plan_route(self.road, self.network, route, vehicle_class)
        index = vehicle.getRouteIndex(vehicle_id)
        way = way_along(self.road, self.network, plan, index, lane, _SIGHT_M)
        lines = lines_of(self.network, self._conflicts, way)
        entry = _Known(vehicle_class, plan, read_s, index, lane, way, lines, self._limits(way))
        self._known[vehicle_id] = entry
        return entry

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

    def _preview(self, ways: Ways, position_m: FloatColumn) -> tuple[FloatMatrix, FloatMatrix, FloatColumn]:
        """Return the points of the ways at ``PREVIEW_M`` and the heading at the first of them."""
        lane, along_m = ways.at(position_m[:, None] + PREVIEW_M)
        nowhere = np.full(lane.size, -1, np.int64)
        points = self.road.points_ahead(lane.ravel(), along_m.ravel(), nowhere)
        shape = lane.shape
        heading_rad = points.heading_rad.reshape(shape)[:, 0]
        return points.x_m.reshape(shape), points.y_m.reshape(shape), heading_rad

    def _leaders(
        self,
        snapshot: Snapshot,
        rows: IntColumn,
        position_m: FloatColumn,
        ways: Ways,
        traffic: LaneTraffic,
    ) -> tuple[FloatColumn, FloatColumn]:
        """Return (gap, speed) of who drives ahead: SUMO's answer, or the first along the way if nearer."""
        gap_m, speed_mps = leaders_of(snapshot, rows)
        index, ahead_m = traffic.first_ahead(ways.lanes, ways.starts_m, position_m, rows)
        along_m = np.where(index >= 0, ahead_m - snapshot.length_m[index], np.inf)
        nearer = along_m < gap_m
        return (
            np.where(nearer, along_m, gap_m),
            np.where(nearer, np.where(index >= 0, snapshot.speed_mps[index], 0.0), speed_mps),
        )

    def _beside(
        self,
        side: int,
        snapshot: Snapshot,
        rows: IntColumn,
        known: Sequence[_Known],
        traffic: LaneTraffic,
    ) -> Beside:
        """Return the lane to the left (1) or right (-1) of each vehicle and who drives there."""
        count, road = len(known), self.road
        lane = np.array(
            [
                self.network.beside(entry.lane, side, entry.vehicle_class) if here else -1
                for entry, here in zip(known, (snapshot.lane[rows] >= 0).tolist(), strict=True)
            ],
            np.int64,
        ).reshape(count)
        offset_m = np.full(count, np.nan)
        leader_gap_m, follower_gap_m = np.full(count, np.inf), np.full(count, np.inf)
        leader_speed_mps, follower_speed_mps = np.zeros(count), np.zeros(count)
        for number in np.flatnonzero(lane >= 0).tolist():
            own, other, row = known[number].lane, int(lane[number]), int(rows[number])
            offset_m[number] = side * 0.5 * float(road.widths_m[own] + road.widths_m[other])
            scale = float(road.lengths_m[other] / max(road.lengths_m[own], 1e-6))
            at_m = float(snapshot.lane_position_m[row]) * scale
            leader, gap_m = traffic.ahead_on(self._lanes_after(known[number], other), at_m, row)
            if leader >= 0:
                leader_gap_m[number] = gap_m - snapshot.length_m[leader]
                leader_speed_mps[number] = snapshot.speed_mps[leader]
            follower, gap_m = traffic.behind_on(self.network, other, at_m, row)
            if follower >= 0:
                follower_gap_m[number] = gap_m - snapshot.length_m[row]
                follower_speed_mps[number] = snapshot.speed_mps[follower]
        return Beside(offset_m, leader_gap_m, leader_speed_mps, follower_gap_m, follower_speed_mps)

    def _lanes_after(self, entry: _Known, lane: int) -> tuple[int, ...]:
        """Return a lane beside the own one and those that follow it, along the route where it leads there."""
        choices = entry.plan.choices
        choice = choices[entry.index].get(lane) if 0 <= entry.index < len(choices) else None
        if choice is not None and choice.onward:
            return (lane, *choice.onward)
        return (lane, *(link.first for link in self.network.links[lane][:1]))

    def _junction(self, line: Line | None, here_m: float, speed_mps: float, foes: FoesOf) -> Junction | None:
        """Return the next line at which others have a say, with who is there if it is near.

        Inside a junction it is the one that has been crossed, for its foes.
        """
        if line is None:
            return None
        line_m = line.waits_m - here_m
        letter = foes.signals.letter(line.signal) if line.signal else line.letter
        right_of_way = _RIGHT_OF_WAY.get(letter, "major")
        goes_first = letter in _GO_FIRST
        if right_of_way == "major" and not goes_first and any(item.first for item in line.conflicts):
            right_of_way = "minor"
        sight_m = max(_FOES_FROM_M, 0.5 * speed_mps * speed_mps / _FOES_DECEL_MPS2 + 20.0)
        found: tuple[Foe, ...] = ()
        if line_m < sight_m:
            found = foes.at(line.conflicts, here_m - line.at_m, goes_first=goes_first)
        return Junction(line_m, line.exit_m - here_m, right_of_way, found)


def _next_signals(
    known: Sequence[_Known], positions: Sequence[float], signals: Signals
) -> tuple[Signal | None, ...]:
    """Return the next signal of each way."""
    found: list[Signal | None] = []
    for entry, here_m in zip(known, positions, strict=True):
        line = next((line for line in entry.lines if line.signal and line.at_m >= here_m - 1e-6), None)
        if line is None or line.signal is None:
            found.append(None)
        else:
            found.append(Signal(line.at_m - here_m, signals.letter(line.signal)))
    return tuple(found)
