"""What surrounds the bound vehicles of a SUMO world: way, neighbours, signals, right of way.

What does not change is read once; per step SUMO is asked only what it alone knows: the states of the
signals in sight, and the routes of those who have just come onto a road to a junction that matters.
"""

from __future__ import annotations

from dataclasses import dataclass
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
from xgv_cosim.worlds.sumo.known_ways import KnownWays
from xgv_cosim.worlds.sumo.network import SumoNetwork
from xgv_cosim.worlds.sumo.over_lines import bodies_over_lines, traffic_with
from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.known_ways import BesideColumns
    from xgv_cosim.worlds.sumo.road import SumoRoad
    from xgv_cosim.worlds.sumo.ways import Line, Ways

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
class SurroundingsReader:
    """Reads what surrounds vehicles, see ``Surroundings``."""

    engine: Engine
    road: SumoRoad
    network: SumoNetwork
    _routes: RoutesAhead
    _conflicts: Conflicts
    _known: KnownWays

    @classmethod
    def of(cls, engine: Engine, road: SumoRoad) -> SurroundingsReader:
        """Return a reader for an open simulation."""
        network = SumoNetwork.read(engine, road)
        conflicts = Conflicts(engine, road, network)
        known = KnownWays(engine, road, network, conflicts)
        return cls(engine, road, network, RoutesAhead(engine), conflicts, known)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that has left the world: whoever has its id later is another."""
        self._known.forget(vehicle_id)
        self._routes.forget(vehicle_id)

    def read(self, snapshot: Snapshot, vehicle_ids: Sequence[str]) -> Surroundings:
        """Return what surrounds vehicles of the snapshot."""
        rows, known = rows_of(snapshot, vehicle_ids), self._known
        lane, position_m = snapshot.lane[rows], snapshot.lane_position_m[rows].copy()
        on_road = lane >= 0
        known.renew(vehicle_ids, lane, snapshot.time_s)
        ways = known.ways
        for number in np.flatnonzero(~on_road & (ways.lanes[:, 0] >= 0)).tolist():
            position_m[number] = self._nearest_m(number, snapshot, int(rows[number]))
        known.here_m = position_m
        way_x_m, way_y_m, heading_rad = self._preview(ways, position_m)
        traffic = LaneTraffic.of(self.road, snapshot.lane, snapshot.lane_position_m)
        left_m = ways.first_left_m(position_m)
        leader_gap_m, leader_speed_mps = self._leaders(snapshot, rows, position_m, ways, traffic)
        over = bodies_over_lines(self.road, snapshot)
        blocked_m, blocker_mps = bodies_in_the_way(
            snapshot,
            rows,
            way_x_m,
            way_y_m,
            ways.lanes,
            over.rows,
            self.road.inside_junction,
            self.road.junctions,
        )
        blocked = blocked_m < leader_gap_m - _SAME_M
        leader_gap_m = np.where(blocked, blocked_m, leader_gap_m)
        leader_speed_mps = np.where(blocked, blocker_mps, leader_speed_mps)
        has_way = ways.lanes[:, 0] >= 0
        signals = Signals(self.engine)
        foes = FoesOf(snapshot, traffic, self.network, self._conflicts, self._routes, signals)
        to_left, to_right = known.beside
        bodies = traffic_with(self.road, snapshot, over)
        speed_mps = snapshot.speed_mps[rows]
        return Surroundings(
            way_x_m=way_x_m,
            way_y_m=way_y_m,
            has_way=has_way,
            lane=lane,
            lateral_m=lateral_m(snapshot, rows, way_x_m[:, 0], way_y_m[:, 0], heading_rad),
            lane_width_m=self.road.lane_width_m(ways.lanes[:, 0]),
            limit_mps=np.where(has_way, self.road.lane_limit_mps(ways.lanes[:, 0]), np.inf),
            limits_ahead=self._limits_ahead(position_m),
            lane_end_m=left_m.lane_end_m,
            lane_changes=np.where(on_road, ways.changes, 0),
            route_end_m=left_m.route_end_m,
            leader_gap_m=leader_gap_m,
            leader_speed_mps=leader_speed_mps,
            left=self._beside(to_left, snapshot, rows, on_road, bodies),
            right=self._beside(to_right, snapshot, rows, on_road, bodies),
            signals=self._next_signals(position_m, signals),
            junctions=self._next_junctions(position_m, speed_mps, on_road, foes),
        )

    def _nearest_m(self, number: int, snapshot: Snapshot, row: int) -> float:
        """Return the place on its way nearest to a vehicle off the road, not far from the last one."""
        near_m = self._known.here_m[number] + np.arange(-_BACK_M, _ONWARD_M, 0.5)
        lane, along_m = self._known.ways.at(near_m[None, :], np.array([number]))
        points = self.road.points_ahead(lane[0], along_m[0], np.full(lane.shape[1], -1, np.int64))
        distance_m = np.hypot(points.x_m - snapshot.front_x_m[row], points.y_m - snapshot.front_y_m[row])
        return float(near_m[np.argmin(distance_m)])

    def _limits_ahead(self, position_m: FloatColumn) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Return the changes of the limit ahead of each vehicle; few have any."""
        found: list[tuple[tuple[float, float], ...]] = [()] * len(position_m)
        for number in np.flatnonzero(self._known.has_limits).tolist():
            here_m = float(position_m[number])
            limits = self._known.entries[number].limits
            found[number] = tuple((at_m - here_m, limit) for at_m, limit in limits if at_m > here_m)
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
        beside: BesideColumns,
        snapshot: Snapshot,
        rows: IntColumn,
        on_road: BoolColumn,
        traffic: LaneTraffic,
    ) -> Beside:
        """Return the lane to one side of each vehicle and who drives there."""
        lanes = np.where(on_road[:, None], beside.ways.lanes, -1)
        at_m = snapshot.lane_position_m[rows] * beside.scale
        leader, ahead_m = traffic.first_ahead(lanes, beside.ways.starts_m, at_m, rows)
        follower, behind_m = traffic.first_behind(self.network, lanes[:, 0], at_m, rows)
        return Beside(
            np.where(lanes[:, 0] >= 0, beside.offset_m, np.nan),
            ahead_m - np.where(leader >= 0, snapshot.length_m[leader], 0.0),
            np.where(leader >= 0, snapshot.speed_mps[leader], 0.0),
            behind_m - np.where(follower >= 0, snapshot.length_m[rows], 0.0),
            np.where(follower >= 0, snapshot.speed_mps[follower], 0.0),
        )

    def _next_junctions(
        self, position_m: FloatColumn, speed_mps: FloatColumn, on_road: BoolColumn, foes: FoesOf
    ) -> tuple[Junction | None, ...]:
        """Return the next junction of each way."""
        found: list[Junction | None] = [None] * len(position_m)
        places_m, entries = position_m.tolist(), self._known.entries
        for number in np.flatnonzero(self._known.has_lines & on_road).tolist():
            here_m = places_m[number]
            for line in entries[number].lines:
                if line.exit_m > here_m:
                    found[number] = self._junction(line, here_m, float(speed_mps[number]), foes)
                    break
        return tuple(found)

    def _next_signals(self, position_m: FloatColumn, signals: Signals) -> tuple[Signal | None, ...]:
        """Return the next signal of each way."""
        found: list[Signal | None] = [None] * len(position_m)
        places_m, entries = position_m.tolist(), self._known.entries
        for number in np.flatnonzero(self._known.has_signals).tolist():
            here_m = places_m[number]
            for line in entries[number].lines:
                if line.signal is not None and line.at_m >= here_m - 1e-6:
                    found[number] = Signal(line.at_m - here_m, signals.letter(line.signal))
                    break
        return tuple(found)

    def _junction(self, line: Line, here_m: float, speed_mps: float, foes: FoesOf) -> Junction:
        """Return the next line at which others have a say, with who is there if it is near.

        Inside a junction it is the one that has been crossed, for its foes.
        """
        line_m = line.waits_m - here_m
        if line.signal is None and not line.conflicts:
            return Junction(line_m, line.exit_m - here_m, _RIGHT_OF_WAY.get(line.letter, "major"))
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
