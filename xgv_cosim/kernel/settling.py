"""What follows once a segment is driven, and when the next one has to end: small loops over all slots."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from xgv_cosim.actuation import Driver, Lateral, Longitudinal
from xgv_cosim.controllers.limits import STRAYED_MPS, clipped
from xgv_cosim.kernel.vehicle import vehicle_of

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, UInt8Column, UInt8Matrix

GEARS_CHANGED = 1
"""Bit of what ``settle_in_place`` returns: a gear is another one than before the segment."""
GRIP_CHANGED = 2
"""Likewise: the tyres gave less curvature than the wheel asks for, in some tick of the segment."""


def settle_in_place(
    reference: FloatMatrix,
    limited: FloatMatrix,
    motion: FloatMatrix,
    gear: UInt8Column,
    gear_before: UInt8Column,
    gear_by_driver: UInt8Column,
    gear_wanted: UInt8Column,
    codes: UInt8Matrix,
    latest_grip_s: float,
) -> int:
    """Join the references of ruckig and kernel, and the gears of drivers and of commands.

    Args:
        reference: From the kernel, as in ``fleet.ReferenceTable``; gets ruckig's where an axis follows a
            profile. Where the car cannot keep up, because grip or power lack, the speed reference waits
            within ``STRAYED_MPS`` of it, so that a later, lower command acts at once.
        limited: From ruckig, likewise.
        motion: At the end of the segment, as in ``fleet.MotionTable``.
        gear: In effect at the end.
        gear_before: In effect at the beginning.
        gear_by_driver: Gets the gears that drivers have put in at the beginning, else those before.
        gear_wanted: Last commanded; gets the one that closed loop or driver have left in, with which wrench
            efforts then go on.
        codes: As in ``fleet.SetpointTables``.
        latest_grip_s: Grip that was missing less long ago than this was missing in the segment.

    Returns:
        ``GEARS_CHANGED`` and ``GRIP_CHANGED``.
    """
    flags = 0
    for slot in range(gear.shape[0]):
        mode, speed = codes[slot, 0], motion[slot, 3]
        closed, driver = mode == Longitudinal.CLOSED_LOOP, mode == Longitudinal.DRIVER
        if closed or mode == Longitudinal.CONTROLLED_STOP:
            reference[slot, 0] = clipped(limited[slot, 0], speed - STRAYED_MPS, speed + STRAYED_MPS)
            reference[slot, 1] = limited[slot, 1]
        if codes[slot, 1] == Lateral.CLOSED_LOOP:
            reference[slot, 2], reference[slot, 3] = limited[slot, 2], limited[slot, 3]
        gear_by_driver[slot] = gear[slot] if driver else gear_before[slot]
        if closed or driver:
            gear_wanted[slot] = gear[slot]
        if gear[slot] != gear_before[slot]:
            flags |= GEARS_CHANGED
        if motion[slot, 12] > 0.0 and motion[slot, 13] < latest_grip_s:
            flags |= GRIP_CHANGED
    return flags


def next_expiry_in(expires_s: FloatColumn, frozen: BoolColumn) -> float:
    """Return when the next command of a controller that is not frozen expires, ``inf`` for never."""
    first_s = math.inf
    for slot in range(expires_s.shape[0]):
        if not frozen[slot]:
            first_s = min(first_s, expires_s[slot])
    return first_s


def next_take_over_in(
    driver: UInt8Column,
    reaction_s: FloatColumn,
    longitudinal: UInt8Column,
    lateral: UInt8Column,
    speed_released_s: FloatColumn,
    steering_released_s: FloatColumn,
) -> float:
    """Return when the next rider takes an axis that nobody has, ``inf`` if none will (XGV-64)."""
    first_s = math.inf
    for slot in range(driver.shape[0]):
        if driver[slot] == Driver.RIDER:
            if longitudinal[slot] == Longitudinal.FREE:
                first_s = min(first_s, speed_released_s[slot] + reaction_s[slot])
            if lateral[slot] == Lateral.FREE:
                first_s = min(first_s, steering_released_s[slot] + reaction_s[slot])
    return first_s


def next_engagement_in(
    codes: UInt8Matrix, gear: UInt8Column, motion: FloatMatrix, parameters: FloatMatrix
) -> float:
    """Return in how many seconds the next gear that the computer shifts is in, ``inf`` where none is."""
    first_s = math.inf
    for slot in range(gear.shape[0]):
        if codes[slot, 2] != gear[slot] and codes[slot, 0] != Longitudinal.DRIVER:
            vehicle = vehicle_of(parameters, slot)
            first_s = min(first_s, vehicle.shift_standstill_s + vehicle.shift_delay_s - motion[slot, 11])
    return first_s
