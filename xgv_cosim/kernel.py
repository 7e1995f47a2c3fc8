"""One compiled loop over vehicles and control ticks: references, controllers, actuators, plant.

``advance`` is the compiled loop, ``advance_plain`` the same Python code uncompiled: the oracle of the
tests. What it composes are the small scalar functions of ``controllers`` and ``plant``.

Each tick the reference takes one step on its profile, the controllers answer with commands to the
pedals and the wheel, these follow with their lags, and the car moves on an exact arc with the tick's
mean speed and mean curvature. An axis that follows no profile has a reference that follows the car,
so that the next entry to closed loop starts from what the car does (XGV-70). This version drives
forward only: the speed never falls below 0.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.controllers.curvature import steer_for_curvature_rad
from xgv_cosim.controllers.limits import (
    MAX_ACCEL_MPS2,
    MAX_CURVATURE_PER_M,
    MAX_CURVATURE_RATE_PER_M_S,
    MAX_SPEED_MPS,
    MAX_STATE_ACCEL_MPS2,
    MAX_STATE_CURVATURE_PER_M,
    MAX_STATE_CURVATURE_RATE_PER_M_S,
    MAX_STATE_SPEED_MPS,
    MIN_ACCEL_MPS2,
    MIN_CURVATURE_RATE_PER_M_S,
    are_usable,
    clipped,
    clipped_jerk,
    is_state,
    stop_decel_mps2,
)
from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile
from xgv_cosim.controllers.speed import (
    STANDSTILL_MPS,
    advance_integral_m,
    expected_speed_mps,
    leading,
    pedals,
    speed_demand_mps2,
    stop_demand_mps2,
)
from xgv_cosim.fleet import Motion, Reference, Setpoints
from xgv_cosim.jit import compiled, inlinable
from xgv_cosim.parameters import ParameterColumns, VehicleParameters, parameter_columns
from xgv_cosim.plant.actuators import advance_pedal, advance_released_steer_rad, advance_steer_rad, lag_share
from xgv_cosim.plant.lateral import advance_curvature, max_lateral_accel_mps2, steady_curvature_per_m
from xgv_cosim.plant.longitudinal import (
    advance_speed,
    brake_decel_mps2,
    creep_accel_mps2,
    full_throttle_accel_mps2,
    maximum_braking_share,
    road_load_mps2,
    throttle_accel_mps2,
)
from xgv_cosim.plant.pose import advance_pose


class _Profile(NamedTuple):
    """A checked and clipped command of one axis."""

    target: float
    rise_limit: float
    fall_limit: float
    jerk: float
    holds: bool
    """The reference stays as it is: a limit is 0 (XGV-70), or the command is no number."""


class _Shares(NamedTuple):
    """What stays the same in every tick of a step: shares of first-order lags, and leads over them."""

    throttle: float
    brake: float
    steer: float
    throttle_lead: float
    brake_lead: float


@inlinable
def _speed_profile(setpoints: Setpoints, slot: int) -> _Profile:
    if setpoints.longitudinal[slot] == Longitudinal.CONTROLLED_STOP:
        decel = stop_decel_mps2(setpoints.decel_limit_mps2[slot])
        return _Profile(0.0, decel, decel, math.inf, False)
    target, jerk = setpoints.target_speed_mps[slot], setpoints.jerk_limit_mps3[slot]
    rise, fall = setpoints.accel_limit_mps2[slot], setpoints.decel_limit_mps2[slot]
    return _Profile(
        clipped(target, -MAX_SPEED_MPS, MAX_SPEED_MPS),
        clipped(rise, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2),
        clipped(fall, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2),
        clipped_jerk(jerk),
        rise == 0.0 or fall == 0.0 or not are_usable(target, rise, fall, jerk),
    )


@inlinable
def _curvature_profile(setpoints: Setpoints, slot: int) -> _Profile:
    target, jerk = setpoints.target_curvature_per_m[slot], setpoints.curvature_jerk_limit_per_m_s2[slot]
    rate = setpoints.curvature_rate_limit_per_m_s[slot]
    limit = clipped(rate, MIN_CURVATURE_RATE_PER_M_S, MAX_CURVATURE_RATE_PER_M_S)
    return _Profile(
        clipped(target, -MAX_CURVATURE_PER_M, MAX_CURVATURE_PER_M),
        limit,
        limit,
        clipped_jerk(jerk),
        rate == 0.0 or not are_usable(target, rate, rate, jerk),
    )


@inlinable
def _shares(parameters: ParameterColumns, slot: int, dt: float) -> _Shares:
    throttle = lag_share(parameters.throttle_lag_s[slot], dt)
    brake = lag_share(parameters.brake_lag_s[slot], dt)
    response = lag_share(parameters.speed_response_s[slot], dt)
    steer = lag_share(parameters.steer_lag_s[slot], dt)
    return _Shares(throttle, brake, steer, max(1.0, response / throttle), max(1.0, response / brake))


@inlinable
def _effort(share: float) -> float:
    """Return a commanded effort within 0 to 1; what is no number releases the pedal."""
    return clipped(share, 0.0, 1.0) if math.isfinite(share) else 0.0


@inlinable
def _pedal_commands(
    motion: Motion,
    reference: Reference,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    slot: int,
    shares: _Shares,
    full_throttle_mps2: float,
    resistance_mps2: float,
    dt: float,
) -> tuple[float, float]:
    """Return throttle and brake commands of this tick; the integral of the speed error advances in place."""
    mode = setpoints.longitudinal[slot]
    if mode == Longitudinal.CLOSED_LOOP or mode == Longitudinal.CONTROLLED_STOP:  # noqa: PLR1714 - compiled
        return _governed_pedals(
            motion, reference, setpoints, parameters, slot, shares, full_throttle_mps2, resistance_mps2, dt
        )
    motion.speed_error_integral_m[slot] = 0.0
    if mode == Longitudinal.OPEN_LOOP:
        return _effort(setpoints.throttle[slot]), _effort(setpoints.brake[slot])
    if mode == Longitudinal.FULL_BRAKE:
        return 0.0, 1.0
    if mode == Longitudinal.MAXIMUM_BRAKING:
        lateral = motion.curvature_per_m[slot] * motion.speed_mps[slot] ** 2
        return 0.0, maximum_braking_share(
            lateral, parameters.max_brake_decel_mps2[slot], parameters.friction[slot]
        )
    if mode == Longitudinal.HOLD:
        return 0.0, _effort(setpoints.brake[slot])
    return 0.0, 0.0


@inlinable
def _governed_pedals(
    motion: Motion,
    reference: Reference,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    slot: int,
    shares: _Shares,
    full_throttle_mps2: float,
    resistance_mps2: float,
    dt: float,
) -> tuple[float, float]:
    """Return the pedals of the two modes in which the speed controller follows a profile (XGV-06, XGV-33)."""
    speed, throttle, brake = motion.speed_mps[slot], motion.throttle[slot], motion.brake[slot]
    wanted_speed, gain = reference.speed_mps[slot], parameters.speed_gain_per_s[slot]
    expected = expected_speed_mps(speed, motion.accel_mps2[slot], parameters.speed_response_s[slot])
    error, integral = wanted_speed - expected, motion.speed_error_integral_m[slot]
    stopping = setpoints.longitudinal[slot] == Longitudinal.CONTROLLED_STOP
    if stopping:
        motion.speed_error_integral_m[slot] = 0.0
        if speed < STANDSTILL_MPS:
            return 0.0, _effort(setpoints.brake[slot])
        decel = stop_decel_mps2(setpoints.decel_limit_mps2[slot])
        # Once the reference stands still, the rest of the way is driven at the set deceleration.
        demand = stop_demand_mps2(error if wanted_speed > 0.0 else 0.0, decel, gain)
    else:
        if wanted_speed <= 0.0 and speed < STANDSTILL_MPS:
            motion.speed_error_integral_m[slot] = 0.0
            return 0.0, parameters.standstill_brake[slot]
        demand = speed_demand_mps2(
            error, integral, reference.accel_mps2[slot], gain, parameters.speed_integral_gain_per_s2[slot]
        )
    tyres = demand + resistance_mps2
    dead_band = parameters.throttle_dead_band[slot]
    wanted_throttle, wanted_brake = pedals(
        tyres,
        throttle,
        brake,
        throttle_accel_mps2(throttle, full_throttle_mps2, dead_band),
        full_throttle_mps2,
        parameters.max_brake_decel_mps2[slot],
        dead_band,
        0.0 if stopping else parameters.pedal_band_mps2[slot],
    )
    brake_command = leading(wanted_brake, brake, shares.brake_lead)
    if stopping:
        return 0.0, brake_command
    motion.speed_error_integral_m[slot] = advance_integral_m(
        integral, error, wanted_throttle, wanted_brake, dt
    )
    return leading(wanted_throttle, throttle, shares.throttle_lead), brake_command


@inlinable
def _advance_speed_reference(
    motion: Motion,
    reference: Reference,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    slot: int,
    profile: _Profile,
    dt: float,
) -> None:
    mode = setpoints.longitudinal[slot]
    speed, accel = reference.speed_mps[slot], reference.accel_mps2[slot]
    known = is_state(speed, accel, MAX_STATE_SPEED_MPS, MAX_STATE_ACCEL_MPS2)
    governed = mode == Longitudinal.CLOSED_LOOP or mode == Longitudinal.CONTROLLED_STOP  # noqa: PLR1714 - compiled
    if not (known and governed):
        return
    if profile.holds:
        reference.accel_mps2[slot] = 0.0
        return
    reference.speed_mps[slot], reference.accel_mps2[slot] = advance_speed_profile(
        speed, accel, profile.target, profile.rise_limit, profile.fall_limit, profile.jerk, dt
    )


@inlinable
def _follow_speed(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, slot: int
) -> None:
    """Let the reference of an axis without a profile, or an unusable one, be what the car does."""
    mode = setpoints.longitudinal[slot]
    governed = mode == Longitudinal.CLOSED_LOOP or mode == Longitudinal.CONTROLLED_STOP  # noqa: PLR1714 - compiled
    if governed and is_state(
        reference.speed_mps[slot], reference.accel_mps2[slot], MAX_STATE_SPEED_MPS, MAX_STATE_ACCEL_MPS2
    ):
        return
    accel = motion.accel_mps2[slot]
    reference.speed_mps[slot] = expected_speed_mps(
        motion.speed_mps[slot], accel, parameters.speed_response_s[slot]
    )
    reference.accel_mps2[slot] = accel


@inlinable
def _advance_curvature_reference(
    reference: Reference, setpoints: Setpoints, slot: int, profile: _Profile, dt: float
) -> None:
    if setpoints.lateral[slot] != Lateral.CLOSED_LOOP:
        return
    if profile.holds:
        reference.curvature_rate_per_m_s[slot] = 0.0
        return
    reference.curvature_per_m[slot], reference.curvature_rate_per_m_s[slot] = advance_profile(
        reference.curvature_per_m[slot],
        reference.curvature_rate_per_m_s[slot],
        profile.target,
        profile.rise_limit,
        profile.fall_limit,
        profile.jerk,
        dt,
    )


@inlinable
def _advance_steering(
    motion: Motion,
    reference: Reference,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    slot: int,
    share: float,
    dt: float,
) -> None:
    """Move the road wheels of one slot by a tick, as its lateral mode says."""
    mode, steer, speed = setpoints.lateral[slot], motion.steer_rad[slot], motion.speed_mps[slot]
    stop, rate = parameters.max_steer_rad[slot], parameters.max_steer_rate_rad_s[slot]
    wheelbase, understeer = parameters.wheelbase_m[slot], parameters.understeer_rad_s2_per_m[slot]
    if mode == Lateral.CLOSED_LOOP:
        command = steer_for_curvature_rad(reference.curvature_per_m[slot], speed, wheelbase, understeer, stop)
        motion.steer_rad[slot] = advance_steer_rad(steer, command, share, rate, stop, dt)
    elif mode == Lateral.OPEN_LOOP:
        command = setpoints.steer_rad[slot]
        if math.isfinite(command):
            motion.steer_rad[slot] = advance_steer_rad(
                steer, clipped(command, -stop, stop), share, rate, stop, dt
            )
    elif mode == Lateral.FREE:
        if parameters.released_steering_self_aligns[slot] > 0.5:
            distance = parameters.self_align_distance_m[slot]
            motion.steer_rad[slot] = advance_released_steer_rad(steer, speed, distance, rate, dt)
    elif mode == Lateral.DRIVER:
        motion.steer_rad[slot] = steer_for_curvature_rad(
            motion.curvature_per_m[slot], speed, wheelbase, understeer, stop
        )


@inlinable
def _follow_curvature(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, slot: int
) -> None:
    """Let the reference of an axis without a profile be the curvature to which the wheels lead."""
    if setpoints.lateral[slot] == Lateral.CLOSED_LOOP and is_state(
        reference.curvature_per_m[slot],
        reference.curvature_rate_per_m_s[slot],
        MAX_STATE_CURVATURE_PER_M,
        MAX_STATE_CURVATURE_RATE_PER_M_S,
    ):
        return
    reference.curvature_per_m[slot] = steady_curvature_per_m(
        motion.steer_rad[slot],
        motion.speed_mps[slot],
        parameters.wheelbase_m[slot],
        parameters.understeer_rad_s2_per_m[slot],
    )
    reference.curvature_rate_per_m_s[slot] = 0.0


@inlinable
def _move(
    motion: Motion,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    slot: int,
    full_throttle_mps2: float,
    road_load: float,
    creep: float,
    dt: float,
) -> None:
    """Advance speed, curvature and pose of one slot by a tick of the present actuator efforts."""
    speed, curvature = motion.speed_mps[slot], motion.curvature_per_m[slot]
    friction = parameters.friction[slot]
    if setpoints.longitudinal[slot] == Longitudinal.DRIVER:
        # The world's driver moves the car; until the world's step tells how, it goes on as it went.
        along, after, distance = motion.accel_mps2[slot], speed, speed * dt
    else:
        pull = throttle_accel_mps2(
            motion.throttle[slot], full_throttle_mps2, parameters.throttle_dead_band[slot]
        )
        braking = brake_decel_mps2(motion.brake[slot], parameters.max_brake_decel_mps2[slot], friction)
        along = pull + creep - braking
        after, accel, distance = advance_speed(speed, pull + creep, braking + road_load, dt)
        motion.accel_mps2[slot] = accel
    new_curvature = curvature
    if setpoints.lateral[slot] != Lateral.DRIVER:
        new_curvature = advance_curvature(
            curvature,
            steady_curvature_per_m(
                motion.steer_rad[slot],
                after,
                parameters.wheelbase_m[slot],
                parameters.understeer_rad_s2_per_m[slot],
            ),
            after,
            max_lateral_accel_mps2(along, friction, parameters.min_lateral_grip[slot]),
            parameters.yaw_lag_s2_per_m[slot],
            dt,
        )
    motion.x_m[slot], motion.y_m[slot], motion.heading_rad[slot] = advance_pose(
        motion.x_m[slot],
        motion.y_m[slot],
        motion.heading_rad[slot],
        distance,
        0.5 * (curvature + new_curvature),
    )
    motion.speed_mps[slot] = after
    motion.curvature_per_m[slot] = new_curvature
    motion.travelled_m[slot] += distance


def _advance_in_place(
    motion: Motion,
    reference: Reference,
    setpoints: Setpoints,
    parameters: ParameterColumns,
    ticks: int,
    dt: float,
) -> None:
    for slot in range(motion.speed_mps.shape[0]):
        speed_profile = _speed_profile(setpoints, slot)
        curvature_profile = _curvature_profile(setpoints, slot)
        shares = _shares(parameters, slot, dt)
        motion.speed_mps[slot] = max(motion.speed_mps[slot], 0.0)  # in this order a NaN stays visible
        _follow_speed(motion, reference, setpoints, parameters, slot)
        _follow_curvature(motion, reference, setpoints, parameters, slot)
        for _ in range(ticks):
            speed = motion.speed_mps[slot]
            full_throttle = full_throttle_accel_mps2(
                speed,
                parameters.max_drive_force_n[slot],
                parameters.max_drive_power_w[slot],
                parameters.mass_kg[slot],
            )
            creep = creep_accel_mps2(
                speed, parameters.creep_accel_mps2[slot], parameters.creep_speed_mps[slot]
            )
            road_load = road_load_mps2(
                speed,
                parameters.mass_kg[slot],
                parameters.rolling_resistance[slot],
                parameters.drag_area_m2[slot],
                parameters.air_density_kg_per_m3[slot],
            )
            _advance_speed_reference(motion, reference, setpoints, parameters, slot, speed_profile, dt)
            throttle, brake = _pedal_commands(
                motion, reference, setpoints, parameters, slot, shares, full_throttle, road_load - creep, dt
            )
            motion.throttle[slot] = advance_pedal(motion.throttle[slot], throttle, shares.throttle)
            motion.brake[slot] = advance_pedal(motion.brake[slot], brake, shares.brake)
            _advance_curvature_reference(reference, setpoints, slot, curvature_profile, dt)
            _advance_steering(motion, reference, setpoints, parameters, slot, shares.steer, dt)
            _move(motion, setpoints, parameters, slot, full_throttle, road_load, creep, dt)
            _follow_speed(motion, reference, setpoints, parameters, slot)
            _follow_curvature(motion, reference, setpoints, parameters, slot)


def kernel_sources() -> list[Path]:
    """Return every file whose code the compiled loop contains."""
    package = Path(__file__).parent
    names = ("kernel", "jit", "fleet", "commands", "parameters", "actuation", "clock", "columns")
    modules = [package / f"{name}.py" for name in names]
    return modules + [
        path for folder in ("controllers", "plant") for path in sorted((package / folder).glob("*.py"))
    ]


_advance_compiled = compiled(_advance_in_place, kernel_sources())


def advance(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, ticks: int
) -> tuple[Motion, Reference]:
    """Return motion and reference of every slot after some control ticks of constant setpoints.

    No column of the arguments is written to. A slot with a NaN does not touch any other slot.

    Args:
        motion: State of the plant; ``travelled_m`` goes on from the value given.
        reference: Where the profiles stand.
        setpoints: What each axis has to do, the same in every tick.
        parameters: Of each vehicle.
        ticks: Control ticks of ``CONTROL_TICK_S`` each.
    """
    after, followed = _copies(motion, reference)
    _advance_compiled(after, followed, setpoints, parameters, ticks, CONTROL_TICK_S)
    return after, followed


def advance_plain(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, ticks: int
) -> tuple[Motion, Reference]:
    """Return what ``advance`` returns, computed by the same code in plain Python (slow: for tests)."""
    after, followed = _copies(motion, reference)
    _advance_in_place(after, followed, setpoints, parameters, ticks, CONTROL_TICK_S)
    return after, followed


def _copies(motion: Motion, reference: Reference) -> tuple[Motion, Reference]:
    return Motion(*(column.copy() for column in motion)), Reference(*(column.copy() for column in reference))


def warm_up() -> None:
    """Compile the loop, or load it from the disk cache, so that the first step does not."""
    modes = [np.zeros(1, np.uint8) for _ in range(2)]
    setpoints = Setpoints(*modes, *(np.zeros(1) for _ in Setpoints._fields[2:]))
    motion = Motion(*(np.zeros(1) for _ in Motion._fields))
    reference = Reference(*(np.zeros(1) for _ in Reference._fields))
    advance(motion, reference, setpoints, parameter_columns(VehicleParameters(), 1), 1)
