"""Axis modes and commands become setpoints; references start from the measured state on entry."""

from __future__ import annotations

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.actuation import Gear, Longitudinal
from xgv_cosim.columns import BoolColumn, UInt8Column
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import Motion, Reference, Setpoints, motion_table, reference_table, setpoints_in
from xgv_cosim.parameters import ParameterColumns, parameter_table
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
    command, held = fleet.command, fleet.held
    numbers, codes = np.empty((fleet.num_slots, 11)), np.empty((fleet.num_slots, 6), np.uint8)
    kernel.set_points(
        numbers,
        codes,
        motion_table(fleet.motion),
        reference_table(fleet.reference),
        parameter_table(fleet.parameters),
        fleet.longitudinal,
        fleet.lateral,
        fleet.motion.gear,
        fleet.gear_wanted,
        fleet.lost_functions,
        fleet.frozen,
        fleet.engine_on,
        fleet.parking_brake,
        fleet.centres_without_command,
        fleet.stop_decel_mps2,
        fleet.stop_hold_brake,
        fleet.brake_share_without_engine,
        held.throttle,
        held.brake,
        held.steer_rad,
        command.kind,
        command.speed_mps,
        command.max_accel_mps2,
        command.curvature_per_m,
        command.max_curvature_rate_per_m_s,
        command.throttle,
        command.brake,
        command.steering,
    )
    return setpoints_in(numbers, codes)


def turns(gear: UInt8Column | np.uint8, wanted: UInt8Column | np.uint8) -> BoolColumn:
    """Return where a change of gear is one of direction; neutral and park drive nowhere."""
    changes: BoolColumn = _DIRECTIONS[gear] != _DIRECTIONS[wanted]
    return changes


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
