"""How the reference stacks drive, whatever commands they put it into: acceleration and curvature."""

from __future__ import annotations

import math
from typing import NamedTuple

from xgv_cosim.autonomy.crossing import Crossings
from xgv_cosim.autonomy.lateral import (
    CENTRED_M,
    SHORTEST_CHANGE_M,
    LaneChanges,
    urgency,
    wanted_curvature_per_m,
    within_grip_per_m,
)
from xgv_cosim.autonomy.longitudinal import slowing_mps2, wanted_accel_mps2
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.observation import LaneBeside, Observation

ADAPTS_FROM = 0.2
"""From this urgency on the car follows the leader of the lane that it wants to change to."""
LANE_END_GAP_M = 3.0
LATE_CHANGE_M, LATE_CHANGE_MPS = 20.0, 3.0
"""So far before the end of its lane it is so slow that a short edge is enough to change lanes."""
BACK_MPS = 2.5
"""At which it drives back to a road that it has left."""


class Wish(NamedTuple):
    """What the driver wants of the car now."""

    accel_mps2: float
    curvature_per_m: float


TAKES_OVER_MPS = 1.0
"""Slower than this it takes over anywhere."""
TAKES_OVER_DECEL_MPS2 = 2.5
TAKES_OVER_LATERAL_MPS2 = 2.0
"""It takes over from another driver where no more than this has to be done."""


MOVES_ASIDE_MPS = 0.2
"""Who moves faster than this to the side is being brought onto another lane."""


class RouteDriving:
    """Drives along a route: lane changes, signals, right of way, limits, curves, the leader."""

    def __init__(self, settings: ReferenceStackSettings) -> None:
        self._settings = settings
        self._changes = LaneChanges()
        self._crossings = Crossings(settings)
        self._last: Observation | None = None
        self._moves_aside = False

    def wish(self, seen: Observation) -> Wish:
        """Return what to do now; without a way: brake, straight on."""
        self._moves_aside = self._last is not None and moves_aside(self._last, seen)
        self._last = seen
        if not seen.lane_ahead_m:
            return Wish(-self._settings.lost_decel_mps2, 0.0)
        beside = self._changes.decide(seen)
        goal_m = 0.0 if beside is None else beside.offset_m
        changes = self._changes.side != 0
        stop_m = min(self._crossings.stop_m(seen), lane_end_stop_m(seen, changes=changes))
        curvature = wanted_curvature_per_m(seen, goal_m, self._settings)
        accel = wanted_accel_mps2(
            seen, self._settings, stop_m, *_also_followed(seen, beside), curvature_per_m=curvature
        )
        accel = min(accel, late_change_mps2(seen))
        if not seen.on_road:
            accel = min(accel, max(BACK_MPS - seen.speed_mps, -self._settings.lost_decel_mps2))
        return Wish(accel, within_grip_per_m(curvature, seen.speed_mps, self._settings))

    def may_take_over(self, seen: Observation, wish: Wish) -> bool:
        """Return whether the car can go on from here: not in the middle of what another driver has begun.

        A driver of the world takes turns that no car can; who took over in one would leave the road. And he
        has looked whether the lane is free that he is moving to. Ask after ``wish`` of the same view.
        """
        if abs(seen.speed_mps) < TAKES_OVER_MPS:
            return True
        if self._moves_aside and abs(seen.lateral_m) > CENTRED_M:
            return False
        curvature = max(abs(wish.curvature_per_m), abs(seen.curvature_per_m))
        return wish.accel_mps2 > -TAKES_OVER_DECEL_MPS2 and (
            curvature * seen.speed_mps**2 < TAKES_OVER_LATERAL_MPS2
        )


def moves_aside(before: Observation, now: Observation) -> bool:
    """Return whether the car has moved across its lane since the last view, or onto another one."""
    lasted_s = now.time_s - before.time_s
    if lasted_s <= 0.0:
        return False
    return now.lane_id != before.lane_id or (
        abs(now.lateral_m - before.lateral_m) > MOVES_ASIDE_MPS * lasted_s
    )


def lane_end_stop_m(seen: Observation, *, changes: bool) -> float:
    """Return where to wait for a lane change that has not succeeded: with room left to make it.

    Args:
        seen: The view.
        changes: The car moves over now, into a gap: the lane's end is a line that it may cross aslant.
    """
    if seen.lane_changes == 0 or not math.isfinite(seen.lane_end_m):
        return math.inf
    if changes and abs(seen.lane_changes) == 1:
        return math.inf
    room_m = LANE_END_GAP_M + abs(seen.lane_changes) * SHORTEST_CHANGE_M
    return max(0.0, seen.lane_end_m - room_m)


def late_change_mps2(seen: Observation) -> float:
    """Return the most acceleration towards a lane's end where little room is left to leave it."""
    if not math.isfinite(seen.lane_end_m) or (seen.lane_changes and seen.lane_end_m > LATE_CHANGE_M):
        return math.inf
    return slowing_mps2(seen.speed_mps, max(0.0, seen.lane_end_m - LATE_CHANGE_M), LATE_CHANGE_MPS)


def _also_followed(seen: Observation, beside: LaneBeside | None) -> tuple[tuple[float, float], ...]:
    """Return the leader of the lane that is changed to, or of the one that it will soon have to be."""
    if beside is None and urgency(seen) > ADAPTS_FROM:
        beside = seen.left if seen.lane_changes > 0 else seen.right
    if beside is None or beside.leader_gap_m < 0.5:
        return ()
    return ((beside.leader_gap_m, beside.leader_speed_mps),)
