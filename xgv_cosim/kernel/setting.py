"""What the axis modes and the command in force make of each setpoint, slot by slot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xgv_cosim.actuation import Gear, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers.limits import clipped
from xgv_cosim.controllers.speed import STANDSTILL_MPS
from xgv_cosim.jit import inlinable
from xgv_cosim.kernel.vehicle import vehicle_of
from xgv_cosim.plant.gearbox import gear_direction

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, UInt8Column, UInt8Matrix

_DRIVE, _REVERSE = int(Gear.DRIVE), int(Gear.REVERSE)


@inlinable
def drives_as_commanded(gear: int, commanded_mps: float, speed_mps: float) -> bool:
    """Return whether the gear in effect drives as the commanded speed asks; low is left at standstill."""
    if not math.isfinite(commanded_mps):
        return True
    if gear == Gear.LOW and abs(speed_mps) < STANDSTILL_MPS:
        return False
    return gear_direction(gear) * commanded_mps > 0.0


@inlinable
def gear_to_select(longitudinal: int, gear: int, gear_wanted: int, commanded_mps: float) -> int:
    """Return the gear to which the selector is to go; modes without shifting leave it (XGV-31, XGV-36)."""
    if longitudinal == Longitudinal.OPEN_LOOP:
        return gear_wanted
    if longitudinal == Longitudinal.CLOSED_LOOP:
        if commanded_mps > 0.0:
            return _DRIVE
        if commanded_mps < 0.0:
            return _REVERSE
    return gear


def set_points_in_place(
    numbers: FloatMatrix,
    codes: UInt8Matrix,
    motion: FloatMatrix,
    reference: FloatMatrix,
    parameters: FloatMatrix,
    longitudinal: UInt8Column,
    lateral: UInt8Column,
    gear: UInt8Column,
    gear_wanted: UInt8Column,
    lost_functions: UInt8Column,
    frozen: BoolColumn,
    engine_on: BoolColumn,
    parking_brake: BoolColumn,
    centres_without_command: BoolColumn,
    stop_decel_mps2: FloatColumn,
    stop_hold_brake: FloatColumn,
    brake_share_without_engine: FloatColumn,
    held_throttle: FloatColumn,
    held_brake: FloatColumn,
    held_steer_rad: FloatColumn,
    command_kind: UInt8Column,
    commanded_mps: FloatColumn,
    accel_limit_mps2: FloatColumn,
    commanded_per_m: FloatColumn,
    commanded_rate_per_m_s: FloatColumn,
    commanded_throttle: FloatColumn,
    commanded_brake: FloatColumn,
    commanded_steering: FloatColumn,
) -> None:
    """Write the setpoints of every slot, see ``simulation.setpoints.setpoints_of``.

    ``numbers`` and ``codes`` are as in ``fleet.SetpointTables``; ``motion``, ``reference`` and ``parameters``
    are tables too, and all that follow columns of the fleet.
    """
    for slot in range(codes.shape[0]):
        vehicle, row, mode = vehicle_of(parameters, slot), numbers[slot], longitudinal[slot]
        is_frozen, speed, curvature = frozen[slot], commanded_mps[slot], reference[slot, 2]
        stops = mode == Longitudinal.CONTROLLED_STOP
        drives = drives_as_commanded(gear[slot], speed, motion[slot, 3])
        row[0] = 0.0 if stops or not drives else speed
        row[1] = accel_limit_mps2[slot]
        row[2] = stop_decel_mps2[slot] if stops else accel_limit_mps2[slot]
        row[3] = math.inf if stops else vehicle.max_jerk_mps3
        if command_kind[slot] == CommandKind.MOTION_PROFILE:
            most = vehicle.max_curvature_per_m
            row[4] = clipped(commanded_per_m[slot], -most, most)
            row[5] = commanded_rate_per_m_s[slot]
        else:
            row[4] = 0.0 if centres_without_command[slot] else curvature
            row[5] = vehicle.max_curvature_rate_per_m_s
        row[6] = vehicle.max_curvature_jerk_per_m_s2
        # A throttle that drove on in the old gear would keep standstill, and so the shift, from coming.
        turns = gear_direction(gear[slot]) != gear_direction(gear_wanted[slot])
        throttle = 0.0 if turns else commanded_throttle[slot]
        row[7] = held_throttle[slot] if is_frozen else throttle
        if mode == Longitudinal.OPEN_LOOP:
            row[8] = held_brake[slot] if is_frozen else commanded_brake[slot]
        else:
            row[8] = stop_hold_brake[slot]
        row[9] = held_steer_rad[slot] if is_frozen else commanded_steering[slot] * vehicle.max_steer_rad
        row[10] = 1.0 if engine_on[slot] else brake_share_without_engine[slot]
        codes[slot, 0], codes[slot, 1], codes[slot, 5] = mode, lateral[slot], lost_functions[slot]
        codes[slot, 2] = gear_to_select(mode, gear[slot], gear_wanted[slot], speed)
        codes[slot, 3], codes[slot, 4] = engine_on[slot], parking_brake[slot]
