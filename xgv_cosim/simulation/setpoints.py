"""Axis modes and commands become setpoints; references start from the measured state on entry."""

from __future__ import annotations

import numpy as np

from xgv_cosim.actuation import Gear, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn, UInt8Column
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers.speed import STANDSTILL_MPS
from xgv_cosim.fleet import Fleet, Motion, Reference, Setpoints
from xgv_cosim.parameters import ParameterColumns
from xgv_cosim.plant.gearbox import gear_direction

_DIRECTIONS = np.array([gear_direction(gear) for gear in Gear])
"""Where each gear drives."""
_SHIFTS_BY_COMMAND = np.array(
    [Longitudinal.OPEN_LOOP, Longitudinal.CONTROLLED_STOP, Longitudinal.HOLD], np.uint8
)


def setpoints_of(fleet: Fleet) -> Setpoints:
    """Return what each axis has to do, from the axis modes and the command in force.

    A commanded limit of exactly 0 holds that axis at its present reference (XGV-70): controllers and
    kernel know it. Closed-loop steering without a live command stays where it is, or goes straight
    (XGV-35). A frozen controller goes on putting out what it did (XGV-67).

    In closed loop the sign of the commanded speed chooses drive or reverse. Until that gear is in, the
    target is standstill: the reference never crosses zero without the gear (XGV-70). A pause leaves the
    gear where it is (XGV-36).
    """
    command, reference, limits = fleet.command, fleet.reference, fleet.parameters
    follows_motion = command.kind == CommandKind.MOTION_PROFILE
    stopping = fleet.longitudinal == Longitudinal.CONTROLLED_STOP

    without = np.where(fleet.centres_without_command, 0.0, reference.curvature_per_m)
    curvature = np.clip(command.curvature_per_m, -limits.max_curvature_per_m, limits.max_curvature_per_m)
    rate = np.where(follows_motion, command.max_curvature_rate_per_m_s, limits.max_curvature_rate_per_m_s)
    return Setpoints(
        longitudinal=fleet.longitudinal,
        lateral=fleet.lateral,
        target_speed_mps=np.where(stopping | ~_drives_as_commanded(fleet), 0.0, command.speed_mps),
        accel_limit_mps2=command.max_accel_mps2,
        decel_limit_mps2=np.where(stopping, fleet.stop_decel_mps2, command.max_accel_mps2),
        jerk_limit_mps3=np.where(stopping, np.inf, limits.max_jerk_mps3),
        target_curvature_per_m=np.where(follows_motion, curvature, without),
        curvature_rate_limit_per_m_s=rate,
        curvature_jerk_limit_per_m_s2=limits.max_curvature_jerk_per_m_s2,
        throttle=np.where(fleet.frozen, fleet.held.throttle, _throttle(fleet)),
        brake=np.where(
            fleet.longitudinal == Longitudinal.OPEN_LOOP,
            np.where(fleet.frozen, fleet.held.brake, command.brake),
            fleet.stop_hold_brake,
        ),
        steer_rad=np.where(fleet.frozen, fleet.held.steer_rad, command.steering * limits.max_steer_rad),
        gear_wanted=_gear_wanted(fleet),
        engine_on=fleet.engine_on,
        parking_brake=fleet.parking_brake,
        brake_authority=np.where(fleet.engine_on, 1.0, fleet.brake_share_without_engine),
        lost_functions=fleet.lost_functions,
    )


def turns(gear: UInt8Column | np.uint8, wanted: UInt8Column | np.uint8) -> BoolColumn:
    """Return where a change of gear is one of direction; neutral and park drive nowhere."""
    changes: BoolColumn = _DIRECTIONS[gear] != _DIRECTIONS[wanted]
    return changes


def _throttle(fleet: Fleet) -> FloatColumn:
    """Return the commanded throttle, withheld while a change of direction waits for standstill (XGV-70).

    Else it would drive the car on in the old gear, and the shift would never come.
    """
    return np.where(turns(fleet.motion.gear, fleet.gear_wanted), 0.0, fleet.command.throttle)


def _drives_as_commanded(fleet: Fleet) -> BoolColumn:
    """Return where the gear in effect drives as the commanded speed asks; low is left at standstill."""
    gear, speed = fleet.motion.gear, fleet.command.speed_mps
    starts_in_low = (gear == Gear.LOW) & (np.abs(fleet.motion.speed_mps) < STANDSTILL_MPS)
    drives: BoolColumn = (_DIRECTIONS[gear] * speed > 0.0) & ~starts_in_low
    return drives | ~np.isfinite(speed)


def _gear_wanted(fleet: Fleet) -> UInt8Column:
    """Return the gear to which each selector is to go; modes without shifting leave it (XGV-31, XGV-36)."""
    gear, speed = fleet.motion.gear, fleet.command.speed_mps
    by_sign = np.where(speed > 0.0, np.uint8(Gear.DRIVE), np.where(speed < 0.0, np.uint8(Gear.REVERSE), gear))
    by_command = np.where(fleet.longitudinal == Longitudinal.OPEN_LOOP, fleet.gear_wanted, gear)
    return np.where(fleet.longitudinal == Longitudinal.CLOSED_LOOP, by_sign, by_command)


def gear_kept(fleet: Fleet) -> UInt8Column:
    """Return the gear that wrench efforts go on with: the one that closed loop or driver have left in."""
    others = (fleet.longitudinal == Longitudinal.CLOSED_LOOP) | (fleet.longitudinal == Longitudinal.DRIVER)
    return np.where(others, fleet.motion.gear, fleet.gear_wanted)


def started_by_driver(fleet: Fleet, longitudinal: UInt8Column) -> BoolColumn:
    """Return which engines a driver who takes the speed has to start, because something stopped them."""
    started: BoolColumn = ~fleet.engine_on & (longitudinal == Longitudinal.DRIVER)
    return started


def released_by_driver(fleet: Fleet, longitudinal: UInt8Column) -> BoolColumn:
    """Return which parking brakes a driver who takes the speed has to release."""
    released: BoolColumn = fleet.parking_brake & (longitudinal == Longitudinal.DRIVER)
    return released


def dropped_shifts(fleet: Fleet, pausing: BoolColumn) -> BoolColumn:
    """Return where a commanded shift that has not come yet is dropped (XGV-34).

    The computer shifts by command in open loop, and before the first effort, when the car stops and
    holds. A frozen controller drops nothing: it goes on putting out what it did (XGV-67).
    """
    shifts = np.isin(fleet.longitudinal, _SHIFTS_BY_COMMAND) & ~pausing
    dropped: BoolColumn = (fleet.gear_wanted != fleet.motion.gear) & ~shifts & ~fleet.frozen
    return dropped


def without_drive(fleet: Fleet) -> BoolColumn:
    """Return where the computer is to drive the car, but its engine is off (XGV-31)."""
    drives = (fleet.longitudinal == Longitudinal.CLOSED_LOOP) | (fleet.longitudinal == Longitudinal.OPEN_LOOP)
    without: BoolColumn = ~fleet.engine_on & drives
    return without


def drags_parking_brake(fleet: Fleet) -> BoolColumn:
    """Return where the computer is to drive, by speed or throttle, against the set parking brake (XGV-60)."""
    command, longitudinal = fleet.command, fleet.longitudinal
    drives = (longitudinal == Longitudinal.CLOSED_LOOP) & (command.speed_mps != 0.0)
    drives |= (longitudinal == Longitudinal.OPEN_LOOP) & (command.throttle > 0.0)
    drags: BoolColumn = fleet.parking_brake & drives & ~fleet.frozen
    return drags


def seeded_references(
    reference: Reference,
    motion: Motion,
    parameters: ParameterColumns,
    speed_entered: BoolColumn,
    steering_entered: BoolColumn,
) -> Reference:
    """Return references that start from the measured state on axes whose mode has just changed (XGV-70).

    The speed is the one expected a response time ahead, as the speed controller compares it.
    """
    expected = motion.speed_mps + parameters.speed_response_s * motion.accel_mps2
    expected = np.where(expected * motion.speed_mps < 0.0, 0.0, expected)
    return Reference(
        speed_mps=np.where(speed_entered, expected, reference.speed_mps),
        accel_mps2=np.where(speed_entered, motion.accel_mps2, reference.accel_mps2),
        curvature_per_m=np.where(steering_entered, motion.curvature_per_m, reference.curvature_per_m),
        curvature_rate_per_m_s=np.where(steering_entered, 0.0, reference.curvature_rate_per_m_s),
    )
