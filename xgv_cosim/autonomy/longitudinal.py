"""Speed: limits and curves ahead, the leader, lines to stop at.

Speed follows the intelligent driver model (Treiber, Hennecke and Helbing, Phys. Rev. E 62, 2000):
``a = A (1 - (v/v0)^4 - (s*/s)^2)`` with ``s* = s0 + v T + v (v - v_leader) / (2 sqrt(A B))``.
A line to stop at is a leader who stands, without time headway.
"""

from __future__ import annotations

import math

from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.observation import Observation

STEERED_OVER_M = 2.0
"""The wheel is turned over this way at least."""
LINE_HEADWAY_S = 0.3
SLOWING_MPS2 = 1.4
"""Braking for limits and curves ahead."""
HARDEST_SLOWING_MPS2 = 4.0
TURN_RATE_RAD_S = 0.4
"""A turn so tight that the car would turn faster than this leaves no time to turn the wheel over."""
SLOWEST_MPS = 1.5
"""No curve asks for less."""


def free_speed_mps(seen: Observation, settings: ReferenceStackSettings) -> float:
    """Return the speed on a free road here."""
    wanted = settings.desired_speed_mps
    return seen.limit_mps if wanted is None else min(wanted, seen.limit_mps)


def follow_mps2(
    speed_mps: float,
    gap_m: float,
    leader_mps: float,
    standstill_gap_m: float,
    headway_s: float,
    settings: ReferenceStackSettings,
) -> float:
    """Return what following takes from the free acceleration: ``A (s*/s)^2``."""
    geometric = math.sqrt(settings.max_accel_mps2 * settings.comfortable_decel_mps2)
    dynamic_m = speed_mps * headway_s + speed_mps * (speed_mps - leader_mps) / (2.0 * geometric)
    share = (standstill_gap_m + max(0.0, dynamic_m)) / max(0.1, gap_m)
    return settings.max_accel_mps2 * share * share


def wanted_accel_mps2(
    seen: Observation,
    settings: ReferenceStackSettings,
    stop_m: float,
    *others: tuple[float, float],
    curvature_per_m: float = 0.0,
) -> float:
    """Return the acceleration wanted, limited to what the car can do.

    Args:
        seen: The view.
        settings: What the stack wants of the road.
        stop_m: How far ahead the front bumper has to stop, ``inf``: nowhere.
        curvature_per_m: What the steering is to be; too fast for it the car slows down.
        others: (gap, speed) of further vehicles to follow, such as the leader in the next lane.
    """
    speed = max(0.0, seen.speed_mps)
    free_mps = max(0.1, free_speed_mps(seen, settings))
    free = settings.max_accel_mps2 * (1.0 - (speed / free_mps) ** 4)
    accel = max(free, -settings.comfortable_decel_mps2)
    if curvature_per_m:
        steered_mps = math.sqrt(settings.max_lateral_accel_mps2 / abs(curvature_per_m))
        steered_mps = min(steered_mps, 1.2 * TURN_RATE_RAD_S / abs(curvature_per_m))
        accel = min(accel, slowing_mps2(speed, 0.0, max(SLOWEST_MPS, 0.9 * steered_mps)))
    for distance_m, limit_mps in (*seen.limits_ahead, *curve_speeds(seen, settings)):
        accel = min(accel, slowing_mps2(speed, distance_m, limit_mps))
    followed = [
        follow_mps2(speed, gap_m, leader_mps, settings.standstill_gap_m, settings.time_headway_s, settings)
        for gap_m, leader_mps in ((seen.leader_gap_m, seen.leader_speed_mps), *others)
        if math.isfinite(gap_m)
    ]
    accel = min([accel, *(free - taken for taken in followed)])
    if math.isfinite(stop_m):
        gap_m = stop_m + settings.stop_line_gap_m
        taken = follow_mps2(speed, gap_m, 0.0, settings.stop_line_gap_m, LINE_HEADWAY_S, settings)
        accel = min(accel, free - taken)
        if stop_m <= 0.3:
            accel = min(accel, -1.0)
    return min(max(accel, -settings.hardest_decel_mps2), settings.max_accel_mps2)


def slowing_mps2(speed_mps: float, distance_m: float, limit_mps: float) -> float:
    """Return the most acceleration that keeps to a limit some way ahead.

    Braking follows the speed from which the limit is reached by even, comfortable braking.
    """
    allowed_mps = math.sqrt(limit_mps * limit_mps + 2.0 * SLOWING_MPS2 * max(0.0, distance_m))
    expected = SLOWING_MPS2 * min(1.0, distance_m / max(1.0, speed_mps))
    return max(2.0 * (allowed_mps - speed_mps) - expected, -HARDEST_SLOWING_MPS2)


def curve_mps(curvature_per_m: float, settings: ReferenceStackSettings) -> float:
    """Return the speed for a curve."""
    tight_per_m = max(1e-6, abs(curvature_per_m))
    held_mps = math.sqrt(settings.curve_lateral_accel_mps2 / tight_per_m)
    return max(SLOWEST_MPS, min(held_mps, TURN_RATE_RAD_S / tight_per_m))


def curve_speeds(seen: Observation, settings: ReferenceStackSettings) -> list[tuple[float, float]]:
    """Return (distance from the front bumper, speed) of the curves ahead that ask for less than now.

    A curve asks for so much lateral acceleration, and where it begins for so fast a turn of the wheel.
    """
    slower: list[tuple[float, float]] = []
    speed = seen.speed_mps
    before_m, before_per_m = 0.0, None
    for distance_m, curvature_per_m in seen.curvature_ahead:
        limit_mps = curve_mps(curvature_per_m, settings)
        if before_per_m is not None:
            per_m = abs(curvature_per_m - before_per_m) / max(STEERED_OVER_M, distance_m - before_m)
            limit_mps = min(limit_mps, settings.curve_rate_per_m_s / max(1e-6, per_m))
        if limit_mps < 1.5 * speed + 1.0:
            slower.append((distance_m, max(SLOWEST_MPS, limit_mps)))
        before_m, before_per_m = distance_m, curvature_per_m
    return slower
