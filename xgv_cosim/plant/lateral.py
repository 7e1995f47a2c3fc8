"""From road-wheel angle to path curvature: steady turn, yaw lag, friction circle."""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable


@inlinable
def steady_curvature_per_m(
    steer_rad: float, speed_mps: float, wheelbase_m: float, understeer_rad_s2_per_m: float
) -> float:
    """Return the curvature of the steady turn: ``tan(delta) / (L + Ku v²)``."""
    return math.tan(steer_rad) / (wheelbase_m + understeer_rad_s2_per_m * speed_mps * speed_mps)


@inlinable
def max_lateral_accel_mps2(longitudinal_mps2: float, grip_mps2: float, min_lateral_grip: float) -> float:
    """Return the friction circle's share for turning: ``sqrt((mu g)² - a_x²)``, at least what ABS leaves."""
    left = math.sqrt(max(0.0, grip_mps2 * grip_mps2 - longitudinal_mps2 * longitudinal_mps2))
    return max(left, min_lateral_grip * grip_mps2)


@inlinable
def advance_curvature(
    curvature_per_m: float,
    steady_per_m: float,
    speed_mps: float,
    longitudinal_mps2: float,
    grip_mps2: float,
    min_lateral_grip: float,
    yaw_lag_s2_per_m: float,
    dt: float,
) -> tuple[float, bool]:
    """Return the curvature after a tick, and whether it is less than the wheel leads to for want of grip.

    It follows with a lag ``tau = c v`` towards the steady turn, within the friction circle.

    Args:
        curvature_per_m: Present curvature, counter-clockwise positive.
        steady_per_m: Where the wheel leads to, see ``steady_curvature_per_m``.
        speed_mps: Present speed, either way.
        longitudinal_mps2: What the tyres give along the road.
        grip_mps2: All that the tyres can give, ``mu g``.
        min_lateral_grip: Share of the grip that turning keeps under any braking.
        yaw_lag_s2_per_m: The lag's time constant per speed.
        dt: The tick, in seconds.
    """
    lag_s = yaw_lag_s2_per_m * abs(speed_mps)
    share = 1.0 if lag_s <= 0.0 else 1.0 - math.exp(-dt / lag_s)
    curvature_per_m += share * (steady_per_m - curvature_per_m)
    lateral = abs(curvature_per_m) * speed_mps * speed_mps
    if lateral <= min_lateral_grip * grip_mps2:  # the usual case, without a root
        return curvature_per_m, False
    limit = max_lateral_accel_mps2(longitudinal_mps2, grip_mps2, min_lateral_grip)
    return curvature_per_m * min(1.0, limit / lateral), limit < lateral


@inlinable
def advance_grip_s(limited_s: float, free_s: float, is_limited: bool, dt: float) -> tuple[float, float]:
    """Return how long grip has limited the curvature, and how long ago that ended, after a tick."""
    if not is_limited:
        return limited_s, free_s + dt
    return (limited_s if free_s == 0.0 else 0.0) + dt, 0.0
