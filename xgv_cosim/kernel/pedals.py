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
    """What the speed controller knows of the car at the beginning of a tick."""

    speed_mps: float
    accel_mps2: float
    curvature_per_m: float
    throttle: float
    brake: float
    full_throttle_mps2: float
    """What full throttle would give."""
    resistance_mps2: float
    """Road load less creep."""


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
    """Return what the longitudinal mode commands; outside closed loop the integral is 0 (XGV-70)."""
    mode = orders.longitudinal
    if mode == Longitudinal.CLOSED_LOOP:
        return _closed_loop(vehicle, lags, car, reference_mps, reference_mps2, integral_m, dt)
    if mode == Longitudinal.CONTROLLED_STOP:
        return _controlled_stop(orders, vehicle, lags, car, reference_mps)
    throttle, brake = 0.0, 0.0  # FREE and DRIVER release both
    if mode == Longitudinal.OPEN_LOOP:
        throttle, brake = orders.throttle, orders.brake
    elif mode == Longitudinal.FULL_BRAKE:
        brake = 1.0
    elif mode == Longitudinal.MAXIMUM_BRAKING:
        lateral = car.curvature_per_m * car.speed_mps * car.speed_mps
        brake = maximum_braking_share(lateral, vehicle.max_brake_decel_mps2, vehicle.friction)
    elif mode == Longitudinal.HOLD:
        brake = orders.brake
    return PedalCommands(throttle, brake, 0.0)


@inlinable
def _closed_loop(
    vehicle: VehicleParameters,
    lags: Lags,
    car: Car,
    reference_mps: float,
    reference_mps2: float,
    integral_m: float,
    dt: float,
) -> PedalCommands:
    """Return the pedals with which the speed controller follows its reference (XGV-06)."""
    if reference_mps <= 0.0 and car.speed_mps < STANDSTILL_MPS:
        return PedalCommands(0.0, vehicle.standstill_brake, 0.0)
    error = reference_mps - expected_speed_mps(car.speed_mps, car.accel_mps2, vehicle.speed_response_s)
    demand = speed_demand_mps2(
        error, integral_m, reference_mps2, vehicle.speed_gain_per_s, vehicle.speed_integral_gain_per_s2
    )
    throttle, brake = pedals(
        demand + car.resistance_mps2,
        car.throttle,
        car.brake,
        throttle_accel_mps2(car.throttle, car.full_throttle_mps2, vehicle.throttle_dead_band),
        car.full_throttle_mps2,
        vehicle.max_brake_decel_mps2,
        vehicle.throttle_dead_band,
        vehicle.pedal_band_mps2,
    )
    return PedalCommands(
        leading(throttle, car.throttle, lags.throttle_lead),
        leading(brake, car.brake, lags.brake_lead),
        advance_integral_m(integral_m, error, throttle, brake, dt),
    )


@inlinable
def _controlled_stop(
    orders: Orders, vehicle: VehicleParameters, lags: Lags, car: Car, reference_mps: float
) -> PedalCommands:
    """Return the pedals of a pause: constant deceleration, then the holding effort (XGV-33, XGV-36)."""
    if car.speed_mps < STANDSTILL_MPS:
        return PedalCommands(0.0, orders.brake, 0.0)
    error = 0.0
    if (
        reference_mps > 0.0
    ):  # once the reference stands, the rest of the way is driven at the set deceleration
        error = reference_mps - expected_speed_mps(car.speed_mps, car.accel_mps2, vehicle.speed_response_s)
    demand = stop_demand_mps2(error, orders.speed.fall_limit, vehicle.speed_gain_per_s)
    _, brake = pedals(
        demand + car.resistance_mps2,
        car.throttle,
        car.brake,
        throttle_accel_mps2(car.throttle, car.full_throttle_mps2, vehicle.throttle_dead_band),
        car.full_throttle_mps2,
        vehicle.max_brake_decel_mps2,
        vehicle.throttle_dead_band,
        0.0,
    )
    return PedalCommands(0.0, leading(brake, car.brake, lags.brake_lead), 0.0)
