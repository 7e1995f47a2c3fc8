"""Whether anything has changed from which modes, hand-overs and their reports follow.

All of it is discrete: codes, bits, and on which side of a threshold a number is. Two words of bits for
each slot hold it. As long as they stay as they are, the modes are what they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.actuation import Driver, Lateral, Longitudinal

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, UInt8Column, UInt16Column, WordMatrix

_ROUNDING_S = 1e-9


def note_inputs_in_place(
    seen: WordMatrix,
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
    speed_mps: FloatColumn,
    brake: FloatColumn,
    commanded_mps: FloatColumn,
    commanded_throttle: FloatColumn,
    commanded_brake: FloatColumn,
    shift_speed_mps: FloatColumn,
    shift_brake: FloatColumn,
    reaction_s: FloatColumn,
    speed_released_s: FloatColumn,
    steering_released_s: FloatColumn,
    now_s: float,
) -> bool:
    """Write the words of every slot into ``seen``, shape ``(2, num_slots)``; return whether any is another.

    The last three columns and ``now_s`` count as one bit for each axis: whether a rider who reacts has it
    by now (XGV-64). Speeds and efforts count as what they are compared with (XGV-36, XGV-60, XGV-70).
    """
    changed = False
    for slot in range(seen.shape[1]):
        speed = speed_mps[slot]
        flags = int(frozen[slot]) | int(handed_over[slot]) << 1 | int(engine_on[slot]) << 2
        flags |= int(parking_brake[slot]) << 3 | int(speed > 0.0) << 4 | int(speed < 0.0) << 5
        flags |= int(commanded_mps[slot] != 0.0) << 6 | int(commanded_throttle[slot] > 0.0) << 7
        flags |= int(abs(speed) >= shift_speed_mps[slot]) << 8
        flags |= int(max(commanded_brake[slot], brake[slot]) <= shift_brake[slot]) << 9
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
        if seen[0, slot] != inputs or seen[1, slot] != outputs:
            seen[0, slot], seen[1, slot] = inputs, outputs
            changed = True
    return changed
