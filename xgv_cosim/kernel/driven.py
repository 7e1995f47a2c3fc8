"""A segment of the step, driven: what ruckig, kernel and gears make of it together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xgv_cosim.clock import CONTROL_TICK_S, time_of_tick_s
from xgv_cosim.columns import UInt8Column
from xgv_cosim.fleet_columns import (
    Motion,
    Reference,
    Setpoints,
    motion_table,
    reference_in,
    reference_table,
    setpoint_tables,
)
from xgv_cosim.jit import compiled
from xgv_cosim.kernel.settling import GEARS_CHANGED, GRIP_CHANGED, settle_in_place
from xgv_cosim.kernel.sources import kernel_sources

settle = compiled(settle_in_place, kernel_sources())


class Driven(NamedTuple):
    """What else is new at the end of a segment; every column has shape ``(num_slots,)``."""

    reference: Reference
    gear_by_driver: UInt8Column
    """Gears at the beginning, once the world's drivers have put theirs in."""
    gear_wanted: UInt8Column
    """The gear with which wrench efforts go on."""
    gears_changed: bool
    """Whether any gear is another one than before."""
    grip_changed: bool
    """Whether the tyres gave less curvature than the wheel asks for, in any tick."""


def settled(
    before: Motion,
    motion: Motion,
    followed: Reference,
    limited: Reference,
    wanted: Setpoints,
    gear_wanted: UInt8Column,
    ticks: int,
) -> Driven:
    """Return what follows once a segment is driven, see ``settling.settle_in_place``.

    No column of the arguments is written to but those of ``followed``, if they are a table's.

    Args:
        before: At the beginning of the segment.
        motion: At its end.
        followed: From the kernel.
        limited: From ruckig.
        wanted: Setpoints of the segment.
        gear_wanted: Gears last commanded.
        ticks: Control ticks of the segment.
    """
    by_driver, gear_kept = np.empty_like(motion.gear), gear_wanted.copy()
    reference = reference_table(followed)
    flags = settle(
        reference,
        reference_table(limited),
        motion_table(motion),
        motion.gear,
        before.gear,
        by_driver,
        gear_kept,
        setpoint_tables(wanted)[1],
        time_of_tick_s(ticks) - 0.5 * CONTROL_TICK_S,
    )
    return Driven(
        reference_in(reference),
        by_driver,
        gear_kept,
        bool(flags & GEARS_CHANGED),
        bool(flags & GRIP_CHANGED),
    )
