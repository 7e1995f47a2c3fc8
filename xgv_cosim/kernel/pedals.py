"""Which throttle and brake each longitudinal mode commands in a tick."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.controllers.speed import (
    STANDSTILL_MPS,
    advance_integral_m,
    expected_speed_mps,
    leading,
    pedals,
    speed_demand_mps2,
    stop_demand_mps2,
)
from xgv_cosim.jit import inlinable
from xgv_cosim.plant.longitudinal import maximum_braking_share, throttle_accel_mps2

if TYPE_CHECKING:
    from xgv_cosim.kernel.orders import Orders
    from xgv_cosim.kernel.vehicle import Lags
    from xgv_cosim.parameters import VehicleParameters


class Car(NamedTuple):
    """What the speed controller knows of the car at the beginning of a tick.

    Speeds and accelerations are positive in the direction in which the car rolls, or at standstill in
    that of its gear; so the same controller drives both ways (XGV-70).
    """

    speed_mps: float
    accel_mps2: float
    curvature_per_m: float
    throttle: float
    brake: float
    full_throttle_mps2: float
    """What full throttle would give: below 0 while the car rolls against its gear, 0 without drive."""
    resistance_mps2: float
    """Road load, parking brake and slope less creep."""
    slope_mps2: float
    """What the slope takes."""
    full_brake_mps2: float
    """What full brake effort gives on unlimited grip."""
    grip_mps2: float


class PedalCommands(NamedTuple):
    """Commands of one tick, and the speed controller's integral after it."""

    throttle: float
    brake: float
    integral_m: float


@inlinable
def pedal_commands(
    orders: Orders,
    vehicle: VehicleParameters,
    lags: Lags,
    car: Car,
    reference_mps: float,
    reference_mps2: float,
    integral_m: float,
    dt: float,
) -> PedalCommands:
    """Return what the longitudinal mode commands; outside closed loop the integral is 0 (XGV-70).

    A pedal whose function is lost follows no command and returns to 0 (XGV-38). Reference and integral
    are positive in the same direction as the car's motion.
    """
    mode = orders.longitudinal
    throttle, brake, integral = 0.0, 0.0, 0.0  # FREE releases both; under DRIVER the pedals are his
    if mode == Longitudinal.CLOSED_LOOP:
        throttle, brake, integral = _closed_loop(
            orders, vehicle, lags, car, reference_mps, reference_mps2, integral_m, dt
        )
    elif mode == Longitudinal.CONTROLLED_STOP:
        brake = _controlled_stop(orders, vehicle, lags, car, reference_mps)
    elif mode == Longitudinal.OPEN_LOOP:
        throttle, brake = orders.throttle, orders.brake
    elif mode == Longitudinal.FULL_BRAKE:
        brake = 1.0
    elif mode == Longitudinal.MAXIMUM_BRAKING:
        lateral = car.curvature_per_m * car.speed_mps * car.speed_mps
        brake = maximum_braking_share(lateral, vehicle.max_brake_decel_mps2, car.grip_mps2)
    elif mode == Longitudinal.HOLD:
        brake = orders.brake
    return PedalCommands(
        throttle if orders.has_throttle else 0.0, brake if orders.has_brake else 0.0, integral
    )


@inlinable
def _stands(orders: Orders, car: Car, reference_mps: float) -> bool:
    """Return whether the car stands, as far as the controller can see."""
    if orders.has_speed_feedback:
        return car.speed_mps < STANDSTILL_MPS
    return reference_mps == 0.0


@inlinable
def _speed_error_mps(orders: Orders, vehicle: VehicleParameters, car: Car, reference_mps: float) -> float:
    """Return reference less speed; without speed feedback the controller knows of no error (XGV-38)."""
    if not orders.has_speed_feedback:
        return 0.0
    return reference_mps - expected_speed_mps(car.speed_mps, car.accel_mps2, vehicle.speed_response_s)


@inlinable
def _closed_loop(
    orders: Orders,
    vehicle: VehicleParameters,
    lags: Lags,
    car: Car,
    reference_mps: float,
    reference_mps2: float,
    integral_m: float,
    dt: float,
) -> tuple[float, float, float]:
    """Return throttle, brake and integral with which the speed controller follows its reference (XGV-06)."""
    if reference_mps == 0.0 and _stands(orders, car, reference_mps):
        slope_share = abs(car.slope_mps2) / car.full_brake_mps2
        return 0.0, min(1.0, vehicle.standstill_brake + slope_share), 0.0
    error = _speed_error_mps(orders, vehicle, car, reference_mps)
    demand = speed_demand_mps2(
        error, integral_m, reference_mps2, vehicle.speed_gain_per_s, vehicle.speed_integral_gain_per_s2
    )
    tyres = demand + car.resistance_mps2
    throttle, brake = pedals(
        tyres,
        car.throttle,
        car.brake,
        throttle_accel_mps2(car.throttle, car.full_throttle_mps2, vehicle.throttle_dead_band),
        car.full_throttle_mps2,
        car.full_brake_mps2,
        vehicle.throttle_dead_band,
        vehicle.pedal_band_mps2,
    )
    if reference_mps == 0.0:  # a stop needs no throttle, also where the slope brakes harder than asked
        throttle = 0.0
    most_push = max(0.0, min(car.full_throttle_mps2, car.grip_mps2))
    most_braking = min(car.full_brake_mps2, car.grip_mps2)
    return (
        leading(throttle, car.throttle, lags.throttle_lead),
        leading(brake, car.brake, lags.brake_lead),
        advance_integral_m(integral_m, error, tyres, most_push, most_braking, dt),
    )


@inlinable
def _controlled_stop(
    orders: Orders, vehicle: VehicleParameters, lags: Lags, car: Car, reference_mps: float
) -> float:
    """Return the brake of a pause: constant deceleration, then the holding effort (XGV-33, XGV-36)."""
    if _stands(orders, car, reference_mps):
        return orders.brake
    error = 0.0
    # Once the reference stands, the rest of the way is driven at the set deceleration.
    if reference_mps > 0.0:
        error = _speed_error_mps(orders, vehicle, car, reference_mps)
    demand = stop_demand_mps2(error, orders.speed.fall_limit, vehicle.speed_gain_per_s)
    _, brake = pedals(
        demand + car.resistance_mps2,
        car.throttle,
        car.brake,
        throttle_accel_mps2(car.throttle, car.full_throttle_mps2, vehicle.throttle_dead_band),
        car.full_throttle_mps2,
        car.full_brake_mps2,
        vehicle.throttle_dead_band,
        0.0,
    )
    return leading(brake, car.brake, lags.brake_lead)


@inlinable
def driver_pedals(vehicle: VehicleParameters, car: Car) -> tuple[float, float]:
    """Return the throttle and brake with which the world's driver must accelerate as he does."""
    throttle, brake = pedals(
        car.accel_mps2 + car.resistance_mps2,
        0.0,
        0.0,
        0.0,
        car.full_throttle_mps2,
        car.full_brake_mps2,
        vehicle.throttle_dead_band,
        0.0,
    )
    return min(throttle, 1.0), min(brake, 1.0)
