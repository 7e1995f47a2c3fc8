"""Commands and references of many slots, checked and clipped for ruckig (see ``limits``).

Compiled, slot by slot; the same functions uncompiled are the oracle of the tests.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.controllers.limits import (
    FALLBACK_STOP_DECEL_MPS2,
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
)
from xgv_cosim.controllers.profile import crosses_zero
from xgv_cosim.jit import compiled, inlinable

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, BoolMatrix, FloatBlock, FloatMatrix, UInt8Matrix
    from xgv_cosim.fleet_columns import Setpoints


class Profiles(NamedTuple):
    """Profiles that ruckig accepts; every array has shape ``(2, n)``: row 0 speed, row 1 curvature."""

    value: FloatMatrix
    rate: FloatMatrix
    target: FloatMatrix
    rise_limit: FloatMatrix
    fall_limit: FloatMatrix
    jerk: FloatMatrix


def profile_axes(setpoints: Setpoints) -> tuple[BoolColumn, BoolColumn]:
    """Return which slots follow a profile in speed, and which in curvature."""
    speed = (setpoints.longitudinal == Longitudinal.CLOSED_LOOP) | (
        setpoints.longitudinal == Longitudinal.CONTROLLED_STOP
    )
    return speed, setpoints.lateral == Lateral.CLOSED_LOOP


@inlinable
def _write(
    profiles: FloatBlock,
    axis: int,
    index: int,
    value: float,
    rate: float,
    target: float,
    rise: float,
    fall: float,
    jerk: float,
    moves: bool,
) -> None:
    """Write one profile; an axis that does not move rests where it is."""
    profiles[0, axis, index] = value
    profiles[1, axis, index] = rate if moves else 0.0
    profiles[2, axis, index] = target if moves else value
    profiles[3, axis, index] = rise if moves else 1.0
    profiles[4, axis, index] = fall if moves else 1.0
    profiles[5, axis, index] = clipped_jerk(jerk) if moves else 1.0


def check_in_place(
    profiles: FloatBlock,
    is_governed: BoolMatrix,
    failed: BoolColumn,
    crossing: BoolColumn,
    reference: FloatMatrix,
    numbers: FloatMatrix,
    codes: UInt8Matrix,
    first: int,
) -> bool:
    """Write the profiles of some consecutive slots, and which have an unusable command or reference.

    An axis that follows no profile, is held by a limit of 0 (XGV-70) or is unusable rests where it is,
    or at 0 if that is no number. A controlled stop with an unusable deceleration takes the default.

    Args:
        profiles: Shape ``(6, 2, n)``: the arrays of ``Profiles``; written.
        is_governed: Shape ``(2, n)``: which axes follow a profile; written.
        failed: Shape ``(n,)``, written.
        crossing: Which slots' speed profile ``profile.crosses_zero`` concerns; written.
        reference: As in ``fleet.ReferenceTable``.
        numbers: As in ``fleet.SetpointTables``.
        codes: Likewise.
        first: The first of the slots.

    Returns:
        Whether any speed profile crosses zero.
    """
    any_crosses = False
    for index in range(failed.shape[0]):
        slot = first + index
        wanted, stops = numbers[slot], codes[slot, 0] == Longitudinal.CONTROLLED_STOP
        target, rise, decel, jerk = wanted[0], wanted[1], wanted[2], wanted[3]
        lacks_decel = stops and not (math.isfinite(decel) and decel > 0.0)
        if lacks_decel:
            decel = FALLBACK_STOP_DECEL_MPS2
        if stops:
            target, rise, jerk = 0.0, decel, math.inf
        is_governed[0, index] = stops or codes[slot, 0] == Longitudinal.CLOSED_LOOP
        is_governed[1, index] = codes[slot, 1] == Lateral.CLOSED_LOOP
        speed_known = is_state(
            reference[slot, 0], reference[slot, 1], MAX_STATE_SPEED_MPS, MAX_STATE_ACCEL_MPS2
        )
        curvature_known = is_state(
            reference[slot, 2],
            reference[slot, 3],
            MAX_STATE_CURVATURE_PER_M,
            MAX_STATE_CURVATURE_RATE_PER_M_S,
        )
        speed_usable = speed_known and are_usable(target, rise, decel, jerk)
        curvature_usable = curvature_known and are_usable(wanted[4], wanted[5], wanted[5], wanted[6])
        failed[index] = (
            lacks_decel
            or (is_governed[0, index] and not speed_usable)
            or (is_governed[1, index] and not curvature_usable)
        )
        moves = is_governed[0, index] and speed_usable and rise > 0.0 and decel > 0.0
        _write(
            profiles,
            0,
            index,
            reference[slot, 0] if speed_known else 0.0,
            reference[slot, 1],
            clipped(target, -MAX_SPEED_MPS, MAX_SPEED_MPS),
            clipped(rise, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2),
            clipped(decel, MIN_ACCEL_MPS2, MAX_ACCEL_MPS2),
            jerk,
            moves,
        )
        rate = clipped(wanted[5], MIN_CURVATURE_RATE_PER_M_S, MAX_CURVATURE_RATE_PER_M_S)
        _write(
            profiles,
            1,
            index,
            reference[slot, 2] if curvature_known else 0.0,
            reference[slot, 3],
            clipped(wanted[4], -MAX_CURVATURE_PER_M, MAX_CURVATURE_PER_M),
            rate,
            rate,
            wanted[6],
            is_governed[1, index] and curvature_usable and wanted[5] > 0.0,
        )
        crossing[index] = crosses_zero(
            profiles[0, 0, index], profiles[1, 0, index], profiles[2, 0, index], profiles[5, 0, index]
        )
        any_crosses = any_crosses or crossing[index]
    return any_crosses


def note_changes_in_place(
    is_stale: BoolColumn,
    kept_reference: FloatMatrix,
    kept_numbers: FloatMatrix,
    kept_codes: UInt8Matrix,
    reference: FloatMatrix,
    numbers: FloatMatrix,
    codes: UInt8Matrix,
    slots_per_shard: int,
) -> bool:
    """Mark the shards in which anything is not what was kept, and keep what is given.

    Args:
        is_stale: One truth for each shard of ``slots_per_shard`` slots; only set, never cleared.
        kept_reference: What the next call was expected to bring; all ``kept`` are written.
        kept_numbers: Likewise.
        kept_codes: Likewise.
        reference: As in ``fleet.ReferenceTable``.
        numbers: As in ``fleet.SetpointTables``.
        codes: Likewise.
        slots_per_shard: How many.

    Returns:
        Whether any is marked.
    """
    for slot in range(reference.shape[0]):
        same = True
        for column in range(reference.shape[1]):
            if reference[slot, column] != kept_reference[slot, column]:
                kept_reference[slot, column], same = reference[slot, column], False
        for column in range(numbers.shape[1]):
            if numbers[slot, column] != kept_numbers[slot, column]:
                kept_numbers[slot, column], same = numbers[slot, column], False
        for column in range(codes.shape[1]):
            if codes[slot, column] != kept_codes[slot, column]:
                kept_codes[slot, column], same = codes[slot, column], False
        if not same:
            is_stale[slot // slots_per_shard] = True
    return bool(is_stale.any())


def take_in_place(
    reference: FloatMatrix, is_governed: BoolMatrix, values: FloatMatrix, rates: FloatMatrix, first: int
) -> None:
    """Write value and rate of the axes that follow a profile into the references of consecutive slots.

    Args:
        reference: As in ``fleet.ReferenceTable``; written.
        is_governed: Shape ``(2, n)``.
        values: Shape ``(2, n)``: row 0 speed, row 1 curvature.
        rates: Likewise.
        first: The first of the slots.
    """
    for index in range(is_governed.shape[1]):
        if is_governed[0, index]:
            reference[first + index, 0], reference[first + index, 1] = values[0, index], rates[0, index]
        if is_governed[1, index]:
            reference[first + index, 2], reference[first + index, 3] = values[1, index], rates[1, index]


def _sources() -> list[Path]:
    here = Path(__file__).parent
    names = ("actuation.py", "jit.py")
    return [*(here.parent / name for name in names), *sorted(here.glob("*.py"))]


check = compiled(check_in_place, _sources())
"""``check_in_place`` as machine code."""
note_changes = compiled(note_changes_in_place, _sources())
"""``note_changes_in_place`` as machine code."""
take = compiled(take_in_place, _sources())
"""``take_in_place`` as machine code."""


def with_speed_at_rest(profiles: FloatBlock, slots: BoolColumn) -> FloatBlock:
    """Return the profiles with the speed axis of some slots at rest at 0."""
    resting = profiles.copy()
    resting[:, 0, slots] = np.array([[0.0], [0.0], [0.0], [1.0], [1.0], [1.0]])
    return resting
