"""Where the plant's pose lies in the frame of its lane, and what SUMO would make of it there.

SUMO knows a vehicle by its lane, a position along it and an offset across; pose and heading follow from
them: the front bumper lies beside the lane's centre line, and the heading is that of the chord from the
rear bumper to it, both at the same offset; while the rear bumper is still on the lane before, it keeps the
offset that the front had there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xgv_cosim.jit import inlinable
from xgv_cosim.worlds.sumo.lane_table import LaneTables, Row, Table, point_ahead
from xgv_cosim.worlds.sumo.placing_tables import LANES_BEHIND, UNSEEN

_REAR_OFFSET_M = 0.04
"""So well is it known (measured) where SUMO has the rear bumper across a lane that the front has left."""
_SEARCHES = 3
"""Projections onto the lane: the plant's distance and the lane's differ in curves."""


class InLane(NamedTuple):
    """A pose in the frame of its lane."""

    position_m: float
    """Front bumper from the beginning of the lane; may lie past its end."""
    lateral_m: float
    body_lateral_m: float
    error_m: float
    """Distance of SUMO's front bumper from the plant's, if SUMO has it at this position and offset."""
    error_rad: float
    """Largest difference of SUMO's heading from the plant's then, ``nan`` where SUMO's cannot be told."""


@inlinable
def follow(lanes: Table, row: Row, lane: int, next_lane: int) -> None:
    """Note on which lane the vehicle is now, and the lanes behind it; none after a lane change."""
    left, lane_between = row.lane, row.next_lane
    if left not in (UNSEEN, lane):
        path = np.full(4 * LANES_BEHIND, -1)
        path[0] = left
        count = 1
        while lane_between >= 0 and lane_between != lane and count <= 2 * LANES_BEHIND:
            for place in range(count, 0, -1):
                path[place] = path[place - 1]
            path[0] = lane_between
            count += 1
            lane_between = lanes[lane_between].only_successor
        if lane_between == lane and left >= 0:
            path[count], path[count + 1] = row.behind_0, row.behind_1
            path[count + 2], path[count + 3] = row.behind_2, row.behind_3
        else:
            path[:] = -1
        row.behind_0, row.behind_1, row.behind_2, row.behind_3 = path[0], path[1], path[2], path[3]
    row.lane, row.next_lane = lane, next_lane
    if lane >= 0:
        row.road_lane = lane


@inlinable
def _rear(
    tables: LaneTables, row: Row, lane: int, position_m: float, next_lane: int
) -> tuple[int, float, int]:
    """Return lane, position and next lane of the rear bumper; lane -1 where it is not known."""
    if position_m >= 0.0 or lane < 0:
        return lane, position_m, next_lane
    for number in range(LANES_BEHIND):
        previous = row.behind_0
        if number == 1:
            previous = row.behind_1
        elif number == 2:
            previous = row.behind_2
        elif number == 3:
            previous = row.behind_3
        if previous < 0:
            break
        next_lane, lane = lane, previous
        position_m += tables.lanes[previous].length_m
        if position_m >= 0.0:
            return lane, position_m, next_lane
    return -1, position_m, next_lane


@inlinable
def _rear_lateral_m(
    row: Row, lane_length_m: float, position_m: float, length_m: float, lateral_m: float
) -> float:
    """Return where the rear bumper is across its lane: where the front is, or was as it crossed."""
    crossing = position_m > lane_length_m
    if crossing:
        row.crossing_m = row.lateral_m
    row.lateral_m = lateral_m
    return row.crossing_m if crossing or position_m < length_m else lateral_m


@inlinable
def _wrapped(angle_rad: float) -> float:
    return (angle_rad + np.pi) % (2.0 * np.pi) - np.pi


@inlinable
def project(
    tables: LaneTables,
    row: Row,
    position_m: float,
    length_m: float,
    x_m: float,
    y_m: float,
    heading_rad: float,
) -> InLane:
    """Project a front bumper onto the lane of ``row``, near ``position_m``; that lane exists."""
    lane, next_lane = row.lane, row.next_lane
    lateral_m = 0.0
    centre = point_ahead(tables, lane, position_m, next_lane)
    for search in range(_SEARCHES):
        if search > 0:
            centre = point_ahead(tables, lane, position_m, next_lane)
        east_m, north_m = x_m - centre.x_m, y_m - centre.y_m
        lateral_m = north_m * centre.cosine - east_m * centre.sine
        position_m += east_m * centre.cosine + north_m * centre.sine
    body_m = lateral_m - 0.5 * length_m * math.sin(heading_rad - centre.heading_rad)
    front = point_ahead(tables, lane, position_m, next_lane)
    sumo_x_m, sumo_y_m = front.x_m - lateral_m * front.sine, front.y_m + lateral_m * front.cosine
    lane_length_m = tables.lanes[lane].length_m
    rear_lateral_m = _rear_lateral_m(row, lane_length_m, position_m, length_m, lateral_m)
    rear_lane, rear_position_m, after_rear = _rear(tables, row, lane, position_m - length_m, next_lane)
    rear = point_ahead(tables, rear_lane, rear_position_m, after_rear)
    chord_x_m = sumo_x_m - (rear.x_m - rear_lateral_m * rear.sine)
    chord_y_m = sumo_y_m - (rear.y_m + rear_lateral_m * rear.cosine)
    turned_rad = abs(_wrapped(math.atan2(chord_y_m, chord_x_m) - heading_rad))
    unsure_rad = _REAR_OFFSET_M / length_m if position_m < length_m else 0.0
    return InLane(
        position_m,
        lateral_m,
        body_m,
        math.hypot(x_m - sumo_x_m, y_m - sumo_y_m),
        turned_rad + unsure_rad,
    )
