"""Whose body reaches over the line into the lane beside: all vehicles of a snapshot at once.

SUMO and the snapshot have a vehicle on the lane that the middle of its front bumper is in. A driver who
looks whether the lane beside is free sees more: who pulls into it from the other side, and who has not
quite left it. One who drives along a lane brakes for those.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from xgv_cosim.worlds.sumo.traffic_lanes import LaneTraffic

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.road import SumoRoad

OVER_M = 0.05
"""Who reaches no further over the line than this only drives at the edge of his lane."""


class OverLines(NamedTuple):
    """Bodies in a lane beside their own, shape ``(n,)``; who reaches over both lines is there twice."""

    rows: IntColumn
    """Whose body, row of the snapshot."""
    lane: IntColumn
    """The lane that it reaches into."""
    position_m: FloatColumn
    """Front bumper along that lane."""


class _Reaches(NamedTuple):
    """How far one end of bodies reaches from the centre line there, positive to the left."""

    left_m: FloatColumn
    right_m: FloatColumn

    @classmethod
    def of(
        cls,
        road: SumoRoad,
        lane: IntColumn,
        position_m: FloatColumn,
        x_m: FloatColumn,
        y_m: FloatColumn,
        heading_rad: FloatColumn,
        width_m: FloatColumn,
    ) -> Self:
        """Return it for ends whose middle is at points beside positions along lanes."""
        line = road.points_ahead(lane, position_m, np.full(len(lane), -1, np.int64))
        cosine, sine = np.cos(line.heading_rad), np.sin(line.heading_rad)
        middle_m = (y_m - line.y_m) * cosine - (x_m - line.x_m) * sine
        half_m = 0.5 * width_m * np.abs(np.cos(heading_rad - line.heading_rad))
        return cls(middle_m + half_m, middle_m - half_m)


def bodies_over_lines(road: SumoRoad, snapshot: Snapshot) -> OverLines:
    """Return who reaches into a lane beside his own.

    Args:
        road: The lanes; those inside junctions have none beside.
        snapshot: Who is where.
    """
    lane = snapshot.lane
    to_left, to_right = road.lanes_beside
    has_beside = (to_left >= 0) | (to_right >= 0)
    rows = np.flatnonzero((lane >= 0) & has_beside[lane])
    lane, position_m = lane[rows], snapshot.lane_position_m[rows]
    length_m, width_m = snapshot.length_m[rows], snapshot.width_m[rows]
    heading_rad = snapshot.heading_rad[rows]
    front_x_m, front_y_m = snapshot.front_x_m[rows], snapshot.front_y_m[rows]
    rear_x_m, rear_y_m = (
        front_x_m - length_m * np.cos(heading_rad),
        front_y_m - length_m * np.sin(heading_rad),
    )
    front = _Reaches.of(road, lane, position_m, front_x_m, front_y_m, heading_rad, width_m)
    rear = _Reaches.of(road, lane, position_m - length_m, rear_x_m, rear_y_m, heading_rad, width_m)
    line_m = 0.5 * road.widths_m[lane] + OVER_M
    over_left = np.maximum(front.left_m, rear.left_m) > line_m
    over_right = np.minimum(front.right_m, rear.right_m) < -line_m
    found = []
    for beside, is_over in zip((to_left, to_right), (over_left, over_right), strict=True):
        chosen = np.flatnonzero(is_over & (beside[lane] >= 0))
        reached = beside[lane[chosen]]
        scale = road.lengths_m[reached] / np.maximum(road.lengths_m[lane[chosen]], 1e-6)
        found.append((rows[chosen], reached, position_m[chosen] * scale))
    rows_over, lanes, at_m = (np.concatenate(columns) for columns in zip(*found, strict=True))
    return OverLines(rows_over, lanes, at_m)


def traffic_with(road: SumoRoad, snapshot: Snapshot, over: OverLines) -> LaneTraffic:
    """Return who is in which lane, and in which lanes else."""
    return LaneTraffic.of(
        road,
        np.concatenate([snapshot.lane, over.lane]),
        np.concatenate([snapshot.lane_position_m, over.position_m]),
        rows=np.concatenate([np.arange(len(snapshot.lane)), over.rows]),
    )
