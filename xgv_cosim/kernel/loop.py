"""The loop over slots and ticks: references, controllers, actuators, plant.

Each tick the reference takes one step on its profile, the controllers answer with commands to the
pedals and the wheel, these follow with their lags, and the car moves on an exact arc with the tick's
mean speed and mean curvature. An axis that follows no profile has a reference that follows the car,
so that the next entry to closed loop starts from what the car does (XGV-70).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.actuation import Gear, Lateral, Longitudinal
from xgv_cosim.controllers.limits import (
    MAX_STATE_ACCEL_MPS2,
    MAX_STATE_CURVATURE_PER_M,
    MAX_STATE_CURVATURE_RATE_PER_M_S,
    MAX_STATE_SPEED_MPS,
    is_state,
)
from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile
from xgv_cosim.controllers.speed import STANDSTILL_MPS, expected_speed_mps
from xgv_cosim.jit import inlinable
from xgv_cosim.kernel.orders import orders_of
from xgv_cosim.kernel.pedals import Car, driver_pedals, pedal_commands
from xgv_cosim.kernel.steering import advance_steering
from xgv_cosim.kernel.vehicle import Road, lags_of, road_of, vehicle_of
from xgv_cosim.plant.actuators import advance_pedal
from xgv_cosim.plant.gearbox import (
    PARK_LOCK_MPS2,
    advance_shift,
    gear_direction,
    gear_under_driver,
    is_between_gears,
)
from xgv_cosim.plant.lateral import advance_curvature, advance_grip_s, steady_curvature_per_m
from xgv_cosim.plant.longitudinal import (
    advance_speed,
    brake_decel_mps2,
    creep_accel_mps2,
    engine_braking_mps2,
    full_throttle_accel_mps2,
    low_gear_share,
    road_load_mps2,
    throttle_accel_mps2,
)
from xgv_cosim.plant.pose import advance_pose

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatMatrix, UInt8Column, UInt8Matrix
    from xgv_cosim.kernel.orders import Orders
    from xgv_cosim.parameters import VehicleParameters


MIN_BRAKE_MPS2 = 1e-3
"""What the speed controller takes a brake without any authority to give, so that it can divide by it."""


class _Wanted(NamedTuple):
    """Where the profiles of one slot stand."""

    speed_mps: float
    accel_mps2: float
    curvature_per_m: float
    rate_per_m_s: float


class _Moving(NamedTuple):
    """How one slot moves along its path and round its bends."""

    speed_mps: float
    accel_mps2: float
    curvature_per_m: float
    distance_m: float
    is_grip_limited: bool


@inlinable
def _advance_reference(orders: Orders, wanted: _Wanted, dt: float) -> _Wanted:
    """Return the reference one tick later on the axes that follow a profile."""
    speed, accel, curvature, rate = wanted
    if orders.follows_speed:
        goal = orders.speed
        if goal.is_held:
            accel = 0.0
        else:
            speed, accel = advance_speed_profile(
                speed, accel, goal.target, goal.rise_limit, goal.fall_limit, goal.jerk, dt
            )
    if orders.follows_curvature:
        goal = orders.curvature
        if goal.is_held:
            rate = 0.0
        else:
            curvature, rate = advance_profile(
                curvature, rate, goal.target, goal.rise_limit, goal.fall_limit, goal.jerk, dt
            )
    return _Wanted(speed, accel, curvature, rate)


@inlinable
def _follow(
    orders: Orders,
    vehicle: VehicleParameters,
    wanted: _Wanted,
    speed_mps: float,
    accel_mps2: float,
    steer_rad: float,
) -> _Wanted:
    """Return the reference with what the car does on axes without a profile, or with a lost reference.

    The speed is the one expected a response time ahead, as the speed controller compares it; the
    curvature is the one that the wheel leads to. So neither pedals nor wheel jump at the entry.
    """
    speed, accel, curvature, rate = wanted
    if not (orders.follows_speed and is_state(speed, accel, MAX_STATE_SPEED_MPS, MAX_STATE_ACCEL_MPS2)):
        speed = expected_speed_mps(speed_mps, accel_mps2, vehicle.speed_response_s)
        accel = accel_mps2
    if not (
        orders.follows_curvature
        and is_state(curvature, rate, MAX_STATE_CURVATURE_PER_M, MAX_STATE_CURVATURE_RATE_PER_M_S)
    ):
        curvature = steady_curvature_per_m(
            steer_rad, speed_mps, vehicle.wheelbase_m, vehicle.understeer_rad_s2_per_m
        )
        rate = 0.0
    return _Wanted(speed, accel, curvature, rate)


class _Forces(NamedTuple):
    """What acts on one slot at the beginning of a tick, positive along its heading."""

    full_throttle_mps2: float
    """Full throttle, 0 or more, in the direction of the gear."""
    direction: float
    """1, -1 or 0: where the gear in effect drives."""
    creep_mps2: float
    road_load_mps2: float
    """Against motion, 0 or more."""


@inlinable
def _forces(
    orders: Orders, vehicle: VehicleParameters, road: Road, gear: int, shift_s: float, speed_mps: float
) -> _Forces:
    """Return drive and road load; without engine or between gears there is neither drive nor creep."""
    direction = gear_direction(gear)
    if not orders.engine_on or is_between_gears(shift_s, vehicle.shift_standstill_s):
        direction = 0.0
    full_throttle = full_throttle_accel_mps2(
        speed_mps, vehicle.max_drive_force_n, vehicle.max_drive_power_w, vehicle.mass_kg
    )
    if gear == Gear.LOW:
        full_throttle *= low_gear_share(speed_mps, vehicle.low_speed_cap_mps)
    creep = creep_accel_mps2(direction * speed_mps, vehicle.creep_accel_mps2, vehicle.creep_speed_mps)
    return _Forces(
        full_throttle,
        direction,
        direction * creep,
        road_load_mps2(
            speed_mps,
            vehicle.mass_kg,
            road.rolling_mps2,
            vehicle.drag_area_m2,
            vehicle.air_density_kg_per_m3,
        ),
    )


@inlinable
def _way(speed_mps: float, direction: float) -> float:
    """Return 1 or -1: where the car rolls, at standstill where its gear drives."""
    if abs(speed_mps) < STANDSTILL_MPS:
        return -1.0 if direction < 0.0 else 1.0
    return -1.0 if speed_mps < 0.0 else 1.0


@inlinable
def _move(
    orders: Orders,
    vehicle: VehicleParameters,
    road: Road,
    forces: _Forces,
    state: _Moving,
    gear: int,
    throttle: float,
    brake: float,
    steer_rad: float,
    dt: float,
) -> _Moving:
    """Return what the efforts in effect make of the car in a tick."""
    speed, curvature = state.speed_mps, state.curvature_per_m
    after, accel, distance = speed, state.accel_mps2, speed * dt
    along, is_grip_limited = accel, False
    # On an axis of the world's driver the car goes on as it went, until the world tells how it moved.
    if orders.longitudinal != Longitudinal.DRIVER:
        pull = min(
            throttle_accel_mps2(throttle, forces.full_throttle_mps2, vehicle.throttle_dead_band),
            road.grip_mps2,
        )
        braking = brake_decel_mps2(
            brake * orders.brake_authority,
            vehicle.max_brake_decel_mps2,
            road.parking_brake_mps2,
            road.grip_mps2,
        )
        push = forces.direction * pull + forces.creep_mps2
        resistance = braking + forces.road_load_mps2
        if gear == Gear.LOW and forces.direction != 0.0:
            resistance += engine_braking_mps2(
                speed, throttle, vehicle.low_engine_braking_mps2, vehicle.creep_speed_mps
            )
        elif gear == Gear.PARK:
            resistance += PARK_LOCK_MPS2
        along = push - math.copysign(braking, speed)
        after, accel, distance = advance_speed(speed, push - road.slope_mps2, resistance, dt)
    if orders.lateral != Lateral.DRIVER:
        curvature, is_grip_limited = advance_curvature(
            curvature,
            steady_curvature_per_m(steer_rad, after, vehicle.wheelbase_m, vehicle.understeer_rad_s2_per_m),
            after,
            along,
            road.grip_mps2,
            vehicle.min_lateral_grip,
            vehicle.yaw_lag_s2_per_m,
            dt,
        )
    return _Moving(after, accel, curvature, distance, is_grip_limited)


def advance_in_place(
    motion: FloatMatrix,
    gears: UInt8Column,
    reference: FloatMatrix,
    numbers: FloatMatrix,
    codes: UInt8Matrix,
    parameters: FloatMatrix,
    ticks: int,
    dt: float,
) -> None:
    """Advance every slot by ``ticks`` ticks of ``dt`` seconds, in the tables of motion and reference.

    Args:
        motion: As in ``fleet.MotionTable``; written to.
        gears: ``actuation.Gear`` in effect; written to.
        reference: As in ``fleet.ReferenceTable``; written to.
        numbers: As in ``fleet.SetpointTables``.
        codes: Likewise.
        parameters: As in ``parameters.ParameterTable``.
        ticks: Control ticks.
        dt: Seconds.
    """
    for slot in range(motion.shape[0]):
        orders, vehicle = orders_of(numbers, codes, slot), vehicle_of(parameters, slot)
        lags, road = lags_of(vehicle, dt), road_of(vehicle, orders)
        row = motion[slot]
        x, y, heading, speed, accel, curvature, steer = row[0], row[1], row[2], row[3], row[4], row[5], row[6]
        throttle, brake, integral, travelled = row[7], row[8], row[9], row[10]
        shift, limited, free = row[11], row[12], row[13]
        gear, follows = int(gears[slot]), reference[slot]
        wanted = _Wanted(follows[0], follows[1], follows[2], follows[3])
        wanted = _follow(orders, vehicle, wanted, speed, accel, steer)
        for _ in range(ticks):
            wanted = _advance_reference(orders, wanted, dt)
            forces = _forces(orders, vehicle, road, gear, shift, speed)
            way = _way(speed, forces.direction)
            car = Car(
                way * speed,
                way * accel,
                curvature,
                throttle,
                brake,
                way * forces.direction * forces.full_throttle_mps2,
                forces.road_load_mps2 + road.parking_brake_mps2 + way * (road.slope_mps2 - forces.creep_mps2),
                way * road.slope_mps2,
                max(MIN_BRAKE_MPS2, vehicle.max_brake_decel_mps2 * orders.brake_authority),
                road.grip_mps2,
            )
            if orders.longitudinal == Longitudinal.DRIVER:
                throttle, brake = driver_pedals(vehicle, car)
                gear, shift, integral = gear_under_driver(gear, speed, STANDSTILL_MPS), 0.0, 0.0
            else:
                command = pedal_commands(
                    orders, vehicle, lags, car, way * wanted.speed_mps, way * wanted.accel_mps2,
                    way * integral, dt,
                )  # fmt: skip
                integral = way * command.integral_m
                throttle = advance_pedal(throttle, command.throttle, lags.throttle)
                brake = advance_pedal(brake, command.brake, lags.brake)
                gear, shift = advance_shift(
                    gear,
                    shift,
                    orders.gear_wanted,
                    abs(speed) < vehicle.shift_speed_mps and brake > vehicle.shift_brake,
                    vehicle.shift_standstill_s,
                    vehicle.shift_delay_s,
                    dt,
                )
            steer = advance_steering(
                orders, vehicle, lags.steer, steer, speed, curvature, wanted.curvature_per_m, dt
            )
            before = _Moving(speed, accel, curvature, 0.0, False)
            after = _move(orders, vehicle, road, forces, before, gear, throttle, brake, steer, dt)
            x, y, heading = advance_pose(
                x, y, heading, after.distance_m, 0.5 * (curvature + after.curvature_per_m)
            )
            speed, accel, curvature = after.speed_mps, after.accel_mps2, after.curvature_per_m
            travelled += after.distance_m
            limited, free = advance_grip_s(limited, free, after.is_grip_limited, dt)
            wanted = _follow(orders, vehicle, wanted, speed, accel, steer)
        row[0], row[1], row[2], row[3], row[4], row[5], row[6] = x, y, heading, speed, accel, curvature, steer
        row[7], row[8], row[9], row[10] = throttle, brake, integral, travelled
        row[11], row[12], row[13] = shift, limited, free
        gears[slot] = gear
        follows[0], follows[1] = wanted.speed_mps, wanted.accel_mps2
        follows[2], follows[3] = wanted.curvature_per_m, wanted.rate_per_m_s
