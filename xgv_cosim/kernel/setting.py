"""What the axis modes and the command in force make of each setpoint, slot by slot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xgv_cosim.actuation import Gear, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers.limits import clipped
from xgv_cosim.controllers.speed import STANDSTILL_MPS
from xgv_cosim.jit import inlinable
from xgv_cosim.plant.gearbox import gear_direction

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, UInt8Column

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
    gears: UInt8Column,
    longitudinal: UInt8Column,
    frozen: BoolColumn,
    engine_on: BoolColumn,
    centres_without_command: BoolColumn,
    gear_wanted: UInt8Column,
    gear: UInt8Column,
    speed_mps: FloatColumn,
    curvature_reference_per_m: FloatColumn,
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
    max_curvature_per_m: FloatColumn,
    max_curvature_rate_per_m_s: FloatColumn,
    max_jerk_mps3: FloatColumn,
    max_steer_rad: FloatColumn,
) -> None:
    """Write the setpoints that are not simply a column of the fleet, see ``simulation.setpoints``.

    The rows of ``numbers``, shape ``(9, num_slots)``, are target speed, limit of deceleration, limit of jerk,
    target curvature, limit of its rate, throttle, brake, angle of the road wheels, brake authority; ``gears``
    is the gear to which each selector is to go. All that follow are columns of the fleet.
    """
    for slot in range(gears.shape[0]):
        mode, is_frozen, speed = longitudinal[slot], frozen[slot], commanded_mps[slot]
        stops = mode == Longitudinal.CONTROLLED_STOP
        drives = drives_as_commanded(gear[slot], speed, speed_mps[slot])
        numbers[0, slot] = 0.0 if stops or not drives else speed
        numbers[1, slot] = stop_decel_mps2[slot] if stops else accel_limit_mps2[slot]
        numbers[2, slot] = math.inf if stops else max_jerk_mps3[slot]
        if command_kind[slot] == CommandKind.MOTION_PROFILE:
            most = max_curvature_per_m[slot]
            numbers[3, slot] = clipped(commanded_per_m[slot], -most, most)
            numbers[4, slot] = commanded_rate_per_m_s[slot]
        else:
            numbers[3, slot] = 0.0 if centres_without_command[slot] else curvature_reference_per_m[slot]
            numbers[4, slot] = max_curvature_rate_per_m_s[slot]
        # A throttle that drove on in the old gear would keep standstill, and so the shift, from coming.
        turns = gear_direction(gear[slot]) != gear_direction(gear_wanted[slot])
        throttle = 0.0 if turns else commanded_throttle[slot]
        numbers[5, slot] = held_throttle[slot] if is_frozen else throttle
        if mode == Longitudinal.OPEN_LOOP:
            numbers[6, slot] = held_brake[slot] if is_frozen else commanded_brake[slot]
        else:
            numbers[6, slot] = stop_hold_brake[slot]
        numbers[7, slot] = (
            held_steer_rad[slot] if is_frozen else commanded_steering[slot] * max_steer_rad[slot]
        )
        numbers[8, slot] = 1.0 if engine_on[slot] else brake_share_without_engine[slot]
        gears[slot] = gear_to_select(mode, gear[slot], gear_wanted[slot], speed)
