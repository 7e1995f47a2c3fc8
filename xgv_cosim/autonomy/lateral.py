"""Steering: along the lane's centre line, and over to the next lane where the route asks for it.

Steering is pure pursuit (Coulter, CMU-RI-TR-92-01): the arc through the rear axle, tangent to the
heading, that meets the line to follow at the look-ahead distance: ``curvature = 2 y / d^2``. A lane
change moves that line sideways, at a bounded lateral speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.observation import LaneBeside, Observation

CHANGE_FROM_M = 800.0
"""A lane change that is due this far ahead is begun as soon as the gap allows."""
LATERAL_SPEED_MPS = 1.2
"""At which the line to follow moves over."""
STEEPEST_SHIFT, FLATTEST_SHIFT = 0.45, 0.04
"""Way to the side for each way ahead."""
CHANGE_TIME_S = 4.0
SHORTEST_CHANGE_M = 12.0
"""What one lane change takes at least, however slow."""
TIGHTEST_PER_M = 0.3
REACHED_PER_M = 0.235
"""A point that asks for more lies within the car's own circle: it would drive round it for ever."""
MOST_INWARD_M = 0.8
SHARPER, SHARPER_FROM_PER_M = 0.2, 0.1
"""In a curve of that curvature it steers so much sharper than the arc to the point: the wheel takes time."""
BACKWARD = 0.5
"""A line that goes so much further back than to the side comes back."""
MOST_LOOKAHEADS, LONGER = 8, 1.2
"""So often it looks further ahead for a point that it can reach, each time so much further."""
CENTRED_M = 0.7
"""Nobody begins a lane change, or takes over from another driver, further from the centre of his lane."""


def change_room_m(seen: Observation) -> float:
    """Return the way that the lane changes needed take at the present speed."""
    return abs(seen.lane_changes) * (CHANGE_TIME_S * seen.speed_mps + SHORTEST_CHANGE_M)


def urgency(seen: Observation) -> float:
    """Return 0 while a lane change has time, 1 when it must be made now."""
    if seen.lane_changes == 0 or not math.isfinite(seen.lane_end_m):
        return 0.0
    room_m = change_room_m(seen)
    return min(1.0, max(0.0, 1.0 - (seen.lane_end_m - room_m) / max(1.0, 2.0 * room_m)))


def gap_allows(seen: Observation, beside: LaneBeside, hurry: float) -> bool:
    """Return whether the gaps in the next lane let the car in; the more hurry, the shorter they may be."""
    speed, least_m, decel_mps2 = seen.speed_mps, 2.0 - hurry, 2.0 + 2.0 * hurry
    ahead_m = least_m + _braking_m(speed, beside.leader_speed_mps, decel_mps2)
    ahead_m += (0.6 - 0.4 * hurry) * speed
    behind_m = least_m + _braking_m(beside.follower_speed_mps, speed, decel_mps2)
    behind_m += (0.8 - 0.5 * hurry) * beside.follower_speed_mps
    return beside.leader_gap_m > ahead_m and beside.follower_gap_m > behind_m


def _braking_m(behind_mps: float, ahead_mps: float, decel_mps2: float) -> float:
    return max(0.0, behind_mps**2 - ahead_mps**2) / (2.0 * decel_mps2)


class LaneChanges:
    """Which line the car follows: its lane's, or the next lane's while it changes."""

    def __init__(self) -> None:
        self.side = 0
        """1: it moves over to the left, -1: to the right, 0: it keeps its lane."""
        self._from_lane = ""

    def decide(self, seen: Observation) -> LaneBeside | None:
        """Begin, go on with, give up or end a lane change; return the lane it moves to, None: its own."""
        if self.side and seen.lane_id != self._from_lane:
            self.side = 0  # the front bumper is over the line: what was the next lane is the own one
        side = self.side or (seen.lane_changes > 0) - (seen.lane_changes < 0)
        beside = (seen.left if side > 0 else seen.right) if side else None
        if beside is None or seen.lane_changes * side <= 0:
            self.side = 0
            return None
        hurry = urgency(seen)
        if self.side:
            if not gap_allows(seen, beside, 1.0) and abs(seen.lateral_m) < 0.25 * seen.lane_width_m:
                self.side = 0  # back to its lane while most of the car is in it
                return None
            return beside
        if (
            seen.lane_end_m < CHANGE_FROM_M
            and abs(seen.lateral_m) < CENTRED_M
            and gap_allows(seen, beside, hurry)
        ):
            self.side, self._from_lane = side, seen.lane_id
            return beside
        return None


def wanted_curvature_per_m(seen: Observation, goal_m: float, settings: ReferenceStackSettings) -> float:
    """Return the pure-pursuit curvature towards a line beside the centre line, positive left, at any speed.

    Args:
        seen: The view.
        goal_m: Where the line to follow lies, to the left of the centre line.
        settings: Look-ahead.
    """
    if not seen.lane_ahead_m:
        return 0.0
    speed = abs(seen.speed_mps)
    lookahead_m = settings.shortest_lookahead_m + speed * settings.lookahead_time_s
    slope = min(STEEPEST_SHIFT, max(FLATTEST_SHIFT, LATERAL_SPEED_MPS / max(0.1, speed)))
    most_m, beside_m = slope * lookahead_m, seen.lateral_m
    if abs(beside_m) > 0.5 * seen.lane_width_m and len(seen.lane_ahead_m) > 1:
        beside_m -= _axle_behind_m(seen.lane_ahead_m)
    curvature = 0.0
    for number in range(MOST_LOOKAHEADS):
        curve_per_m = sharpest_per_m(seen, lookahead_m)
        inward_m = inward_of_curve_m(seen, curve_per_m)
        shift_m = beside_m + min(most_m, max(-most_m, goal_m + inward_m - beside_m))
        x, y = point_at(seen.lane_ahead_m, lookahead_m, shift_m)
        if x > 0.0:
            sharper = 1.0 + SHARPER * min(1.0, abs(curve_per_m) / SHARPER_FROM_PER_M)
            wanted = sharper * 2.0 * y / max(1.0, x * x + y * y)
            if number == 0 or abs(wanted) <= REACHED_PER_M:
                curvature = wanted
            if abs(wanted) <= REACHED_PER_M:
                break
        elif number == 0:
            curvature = math.copysign(TIGHTEST_PER_M, y)
        lookahead_m *= LONGER
    return min(max(curvature, -TIGHTEST_PER_M), TIGHTEST_PER_M)


def _axle_behind_m(line: Sequence[tuple[float, float]]) -> float:
    """Return how much further left the front bumper is than the rear axle, across a line."""
    (x0, y0), (x1, y1) = line[:2]
    return -math.hypot(x0, y0) * (y1 - y0) / max(1e-9, math.hypot(x1 - x0, y1 - y0))


def sharpest_per_m(seen: Observation, distance_m: float) -> float:
    """Return the sharpest curvature of the way from the front bumper to a distance from the axle."""
    onward_m = distance_m - math.hypot(*seen.lane_ahead_m[0])
    sharpest = 0.0
    for at_m, curvature_per_m in seen.curvature_ahead:
        if abs(curvature_per_m) > abs(sharpest):
            sharpest = curvature_per_m
        if at_m >= onward_m:
            break
    return sharpest


def inward_of_curve_m(seen: Observation, curvature_per_m: float) -> float:
    """Return how far left of the line the rear axle has to go in a curve, so that the body's middle is on it.

    With the rear axle on a circle of radius R the front bumper, ``l`` before it, is ``l^2 / 2 R`` outside:
    half of that each way. In a turn that no car can follow it stays out.
    """
    if abs(curvature_per_m) > TIGHTEST_PER_M:
        return 0.0
    front_m = math.hypot(*seen.lane_ahead_m[0])
    inward_m = 0.25 * front_m * front_m * curvature_per_m
    return min(MOST_INWARD_M, max(-MOST_INWARD_M, inward_m))


def within_grip_per_m(curvature_per_m: float, speed_mps: float, settings: ReferenceStackSettings) -> float:
    """Return a curvature, limited to the lateral acceleration that the stack wants at most."""
    limit = settings.max_lateral_accel_mps2 / max(1.0, abs(speed_mps)) ** 2
    return min(max(curvature_per_m, -limit), limit)


def point_at(points: Sequence[tuple[float, float]], distance_m: float, shift_m: float) -> tuple[float, float]:
    """Return the point at a distance from the origin of a polyline that is moved to its left by ``shift_m``.

    The last point if the line ends before, the first if it begins beyond. Where the line comes back, as in
    a turn round, the point where it begins to: who looked past that would steer for what lies behind.
    """
    x, y = points[0]
    onward = len(points) > 1 and points[1][0] > points[0][0]
    for (x0, y0), (x1, y1) in pairwise(points):
        if onward and x1 < x0 - BACKWARD * abs(y1 - y0):
            break
        shift = shift_m / max(1e-9, math.hypot(x1 - x0, y1 - y0))
        from_x, from_y = x0 - shift * (y1 - y0), y0 + shift * (x1 - x0)
        to_x, to_y = x1 - shift * (y1 - y0), y1 + shift * (x1 - x0)
        near, far = math.hypot(from_x, from_y), math.hypot(to_x, to_y)
        x, y = to_x, to_y
        if far >= distance_m:
            share = min(1.0, max(0.0, (distance_m - near) / max(1e-9, far - near)))
            return from_x + share * (to_x - from_x), from_y + share * (to_y - from_y)
    return x, y
