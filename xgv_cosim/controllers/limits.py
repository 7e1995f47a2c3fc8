"""Which targets, limits and states a motion profile accepts, and to what others are clipped.

ruckig refuses a whole batch for one bad number, and reports a profile of more than two hours by an
error without a name. Within these bounds neither happens. Both the reference generator (vectorised)
and the kernel (one slot) use them, so that they follow the same profile.
"""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable

MAX_SPEED_MPS = 100.0
MIN_ACCEL_MPS2 = 0.05
MAX_ACCEL_MPS2 = 12.0
MAX_CURVATURE_PER_M = 1.0
MIN_CURVATURE_RATE_PER_M_S = 1e-3
MAX_CURVATURE_RATE_PER_M_S = 1.0
MIN_JERK = 0.1
"""Of speed in m/s³ and of curvature in 1/(m s²)."""
MAX_JERK = 1e3
"""Above it and below infinity, likewise."""
MAX_STATE_SPEED_MPS = 200.0
MAX_STATE_ACCEL_MPS2 = 50.0
MAX_STATE_CURVATURE_PER_M = 10.0
MAX_STATE_CURVATURE_RATE_PER_M_S = 50.0
FALLBACK_STOP_DECEL_MPS2 = 2.5
"""With what a controlled stop brakes whose deceleration is not a positive number (XGV-36's default)."""


STRAYED_MPS = 2.0
"""Distance of speed and reference at which the reference waits for the car (no grip, no power)."""


@inlinable
def clipped(value: float, lower: float, upper: float) -> float:
    """Return ``value`` within ``lower .. upper``; NaN stays NaN."""
    if value < lower:
        return lower
    if value > upper:
        return upper
    return value


@inlinable
def clipped_jerk(jerk: float) -> float:
    """Return a jerk limit that ruckig accepts; infinite stays infinite."""
    if math.isinf(jerk):
        return jerk
    return clipped(jerk, MIN_JERK, MAX_JERK)


@inlinable
def are_usable(target: float, rise_limit: float, fall_limit: float, jerk: float) -> bool:
    """Return whether a closed-loop command can be followed: a finite target and limits of 0 or more."""
    return math.isfinite(target) and rise_limit >= 0.0 and fall_limit >= 0.0 and jerk >= 0.0


@inlinable
def stop_decel_mps2(decel_limit_mps2: float) -> float:
    """Return the deceleration of a controlled stop (XGV-36); it never falls out for a bad number."""
    if not (math.isfinite(decel_limit_mps2) and decel_limit_mps2 > 0.0):
        return FALLBACK_STOP_DECEL_MPS2
    return clipped(decel_limit_mps2, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2)


@inlinable
def is_state(value: float, rate: float, max_value: float, max_rate: float) -> bool:
    """Return whether a reference is one that a profile can start from."""
    return abs(value) <= max_value and abs(rate) <= max_rate
