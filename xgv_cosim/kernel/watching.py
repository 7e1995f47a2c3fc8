"""Whether anything has changed from which modes, hand-overs and their reports follow.

All of it is discrete: codes, bits, and on which side of a threshold a number is. Two words of bits for
each slot hold it. As long as they stay as they are, the modes are what they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.actuation import Driver, Lateral, Longitudinal
from xgv_cosim.jit import inlinable
from xgv_cosim.kernel.vehicle import vehicle_of

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, UInt8Column, UInt16Column, WordMatrix

_ROUNDING_S = 1e-9


@inlinable
def _brakes(longitudinal: int) -> bool:
    """Return whether it is a mode whose stop may be weaker than it should be."""
    return (
        longitudinal == Longitudinal.CONTROLLED_STOP  # noqa: PLR1714 - compiled
        or longitudinal == Longitudinal.FULL_BRAKE
        or longitudinal == Longitudinal.MAXIMUM_BRAKING
    )


def note_inputs_in_place(
    seen: WordMatrix,
    motion: FloatMatrix,
    parameters: FloatMatrix,
    safety_devices: UInt16Column,
    control_mode: UInt8Column,
    ready_mode: UInt8Column,
    safety_mode: UInt8Column,
    partial_mode: UInt8Column,
    command_kind: UInt8Column,
    lost_functions: UInt8Column,
    longitudinal: UInt8Column,
    lateral: UInt8Column,
    gear_wanted: UInt8Column,
    gear: UInt8Column,
    driver: UInt8Column,
    frozen: BoolColumn,
    handed_over: BoolColumn,
    engine_on: BoolColumn,
    parking_brake: BoolColumn,
    commanded_mps: FloatColumn,
    commanded_throttle: FloatColumn,
    commanded_brake: FloatColumn,
    reaction_s: FloatColumn,
    speed_released_s: FloatColumn,
    steering_released_s: FloatColumn,
    now_s: float,
) -> bool:
    """Write the words of every slot into ``seen``, shape ``(2, num_slots)``; return whether any is another.

    ``motion`` and ``parameters`` are tables, all that follow columns of the fleet; the last three of these
    and ``now_s`` count as one bit for each axis: whether a rider who reacts has it
    by now (XGV-64). Speeds and efforts count as what they are compared with, and only where they are: in a
    stop (XGV-36), against the parking brake (XGV-60), while a shift waits (XGV-70).
    """
    changed = False
    for slot in range(seen.shape[1]):
        vehicle, speed, brake = vehicle_of(parameters, slot), motion[slot, 3], motion[slot, 8]
        flags = int(frozen[slot]) | int(handed_over[slot]) << 1 | int(engine_on[slot]) << 2
        flags |= int(parking_brake[slot]) << 3
        if frozen[slot] or _brakes(longitudinal[slot]):
            flags |= int(speed > 0.0) << 4 | int(speed < 0.0) << 5
        if parking_brake[slot]:
            flags |= int(commanded_mps[slot] != 0.0) << 6 | int(commanded_throttle[slot] > 0.0) << 7
        if gear_wanted[slot] != gear[slot]:
            flags |= int(abs(speed) >= vehicle.shift_speed_mps) << 8
            flags |= int(max(commanded_brake[slot], brake) <= vehicle.shift_brake) << 9
        if driver[slot] == Driver.RIDER:
            reacted_s = now_s - reaction_s[slot] + _ROUNDING_S
            waits = longitudinal[slot] == Longitudinal.FREE
            flags |= int(waits and speed_released_s[slot] <= reacted_s) << 10
            waits = lateral[slot] == Lateral.FREE
            flags |= int(waits and steering_released_s[slot] <= reacted_s) << 11
        inputs = int(safety_devices[slot]) | int(control_mode[slot]) << 16 | int(ready_mode[slot]) << 24
        inputs |= int(safety_mode[slot]) << 32 | int(partial_mode[slot]) << 40
        inputs |= int(command_kind[slot]) << 48 | int(driver[slot]) << 52 | int(lost_functions[slot]) << 56
        outputs = int(longitudinal[slot]) | int(lateral[slot]) << 8 | int(gear_wanted[slot]) << 16
        outputs |= int(gear[slot]) << 24 | flags << 32
        # The compiler has them unsigned, and would compare signed with unsigned as floats, without low bits.
        first, second = np.int64(inputs), np.int64(outputs)
        if seen[0, slot] != first or seen[1, slot] != second:
            seen[0, slot], seen[1, slot] = first, second
            changed = True
    return changed
