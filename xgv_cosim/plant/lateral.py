"""From road-wheel angle to path curvature: steady turn, yaw lag, friction circle."""

from __future__ import annotations

import math

from xgv_cosim.jit import inlinable
from xgv_cosim.plant.longitudinal import GRAVITY_MPS2


@inlinable
def steady_curvature_per_m(
    steer_rad: float, speed_mps: float, wheelbase_m: float, understeer_rad_s2_per_m: float
) -> float:
    """Return the curvature of the steady turn: ``tan(delta) / (L + Ku v²)``."""
    return math.tan(steer_rad) / (wheelbase_m + understeer_rad_s2_per_m * speed_mps * speed_mps)


@inlinable
def max_lateral_accel_mps2(longitudinal_mps2: float, friction: float, min_lateral_grip: float) -> float:
    """Return the friction circle's share for turning: ``sqrt((mu g)² - a_x²)``, at least what ABS leaves."""
    grip = friction * GRAVITY_MPS2
    left = math.sqrt(max(0.0, grip * grip - longitudinal_mps2 * longitudinal_mps2))
    return max(left, min_lateral_grip * grip)


@inlinable
def advance_curvature(
    curvature_per_m: float,
    steady_per_m: float,
    speed_mps: float,
    max_lateral_mps2: float,
    yaw_lag_s2_per_m: float,
    dt: float,
) -> float:
    """Return the curvature after a tick: lag ``tau = c v`` towards the steady turn, within the grip."""
    lag_s = yaw_lag_s2_per_m * speed_mps
    share = 1.0 if lag_s <= 0.0 else 1.0 - math.exp(-dt / lag_s)
    curvature_per_m += share * (steady_per_m - curvature_per_m)
    if abs(curvature_per_m) * speed_mps * speed_mps > max_lateral_mps2:
        return math.copysign(max_lateral_mps2 / (speed_mps * speed_mps), curvature_per_m)
    return curvature_per_m
