"""Drivers for bound cars in tests of worlds: columns in, a placement out; they know no plant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from xgv_cosim.worlds.base import Placement

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.world import SumoWorld

STEP_S = 0.1
_DECEL_MPS2 = 3.0


def _safe_mps(ahead_mps: FloatColumn | float, gap_m: FloatColumn | float) -> Any:
    """Krauss's safe speed with a reaction of one second."""
    room = np.maximum(gap_m, 0.0)
    return -_DECEL_MPS2 + np.sqrt(_DECEL_MPS2**2 + np.square(ahead_mps) + 2 * _DECEL_MPS2 * room)


class WeavingDrivers:
    """Keep distance, stop at red, change to the lane of their route, and swing about its centre."""

    def __init__(self, world: SumoWorld, vehicle: Any, swing_m: float) -> None:
        self.world, self.vehicle, self.swing_m = world, vehicle, swing_m

    def place(self, snapshot: Snapshot, ids: tuple[str, ...]) -> Placement:
        road, rows = self.world.road, np.array([snapshot.index_of[name] for name in ids], np.int64)
        lane, position_m, next_lane = (
            column[rows] for column in (snapshot.lane, snapshot.lane_position_m, snapshot.next_lane)
        )
        assert (lane >= 0).all()
        now_mps = snapshot.speed_mps[rows]
        speed_mps = self._speeds(snapshot, ids, rows)
        here = road.points_ahead(lane, position_m, next_lane)
        lateral_m = (snapshot.front_y_m[rows] - here.y_m) * np.cos(here.heading_rad)
        lateral_m -= (snapshot.front_x_m[rows] - here.x_m) * np.sin(here.heading_rad)
        phase = np.array([sum(map(ord, name)) for name in ids], np.float64)
        goal_m = self.swing_m * np.sin(0.3 * snapshot.time_s + phase) + self._lane_changes_m(ids, lane)
        most_m = 0.02 * np.minimum(speed_mps, 5.0)
        lateral_m += np.clip(goal_m - lateral_m, -most_m, most_m)
        way_m = 0.5 * (speed_mps + now_mps) * STEP_S
        at = road.points_ahead(lane, position_m + way_m, next_lane)
        plants = np.ones(len(ids), np.bool_)
        return Placement(
            ids,
            at.x_m - np.sin(at.heading_rad) * lateral_m,
            at.y_m + np.cos(at.heading_rad) * lateral_m,
            at.heading_rad,
            speed_mps,
            way_m,
            plants,
            plants,
        )

    def _speeds(self, snapshot: Snapshot, ids: tuple[str, ...], rows: IntColumn) -> FloatColumn:
        now_mps, leader = snapshot.speed_mps[rows], snapshot.leader[rows]
        speed_mps = np.minimum(now_mps + 0.2, self.world.road.lane_limit_mps(snapshot.lane[rows]))
        following = _safe_mps(snapshot.speed_mps[leader], snapshot.leader_gap_m[rows] - 2.5)
        speed_mps = np.where(leader >= 0, np.minimum(speed_mps, following), speed_mps)
        for place, name in enumerate(ids):
            for _, _, distance_m, state in self.vehicle.getNextTLS(name)[:1]:
                if state == "r" or (state == "y" and distance_m > now_mps[place] ** 2 / 6.0):
                    speed_mps[place] = min(speed_mps[place], _safe_mps(0.0, distance_m - 1.5))
        return np.maximum(speed_mps, 0.0)

    def _lane_changes_m(self, ids: tuple[str, ...], lane: IntColumn) -> FloatColumn:
        """Return how far left lies the lane from which each route goes on."""
        road, shift_m = self.world.road, np.zeros(len(ids))
        for place, (name, number) in enumerate(zip(ids, lane.tolist(), strict=True)):
            for best in self.vehicle.getBestLanes(name):
                if best[0] == road.lane_ids[number]:
                    shift_m[place] = road.widths_m[number] * best[3] * road.leftwards
        return shift_m
