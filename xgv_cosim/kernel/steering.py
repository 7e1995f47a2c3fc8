"""How each lateral mode moves the road wheels in a tick."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xgv_cosim.actuation import Lateral
from xgv_cosim.controllers.curvature import steer_for_curvature_rad
from xgv_cosim.jit import inlinable
from xgv_cosim.plant.actuators import advance_released_steer_rad, advance_steer_rad, taken_up_rad

if TYPE_CHECKING:
    from xgv_cosim.kernel.orders import Orders
    from xgv_cosim.parameters import VehicleParameters

_FREE = int(Lateral.FREE)


@inlinable
def advance_steering(
    orders: Orders,
    vehicle: VehicleParameters,
    lag: float,
    steer_rad: float,
    speed_mps: float,
    curvature_per_m: float,
    reference_per_m: float,
    dt: float,
) -> float:
    """Return the road-wheel angle after a tick.

    Args:
        orders: What the slot has to do.
        vehicle: Its parameters.
        lag: Share of the way to its command that the steering makes in a tick.
        steer_rad: Present road-wheel angle.
        speed_mps: Present speed.
        curvature_per_m: Present curvature of the path.
        reference_per_m: Curvature to follow in closed loop.
        dt: The tick, in seconds.
    """
    stop, rate = vehicle.max_steer_rad, vehicle.max_steer_rate_rad_s
    # A steering without its function is as if released (XGV-38); the driver turns the wheel himself.
    mode = orders.lateral if orders.has_steering or orders.lateral == Lateral.DRIVER else _FREE
    if mode == Lateral.CLOSED_LOOP:
        wanted = steer_for_curvature_rad(
            reference_per_m, speed_mps, vehicle.wheelbase_m, vehicle.understeer_rad_s2_per_m, stop
        )
        wanted = taken_up_rad(steer_rad, wanted, vehicle.steer_backlash_rad)
        return advance_steer_rad(steer_rad, wanted, lag, rate, stop, dt)
    if mode == Lateral.OPEN_LOOP and not math.isnan(orders.steer_rad):
        wanted = taken_up_rad(steer_rad, orders.steer_rad, vehicle.steer_backlash_rad)
        return advance_steer_rad(steer_rad, wanted, lag, rate, stop, dt)
    if mode == Lateral.FREE and vehicle.released_steering_self_aligns > 0.5:
        return advance_released_steer_rad(steer_rad, speed_mps, vehicle.self_align_distance_m, rate, dt)
    if mode == Lateral.DRIVER:  # the wheel stands as the driver's path needs it
        return steer_for_curvature_rad(
            curvature_per_m, speed_mps, vehicle.wheelbase_m, vehicle.understeer_rad_s2_per_m, stop
        )
    return steer_rad
