"""One compiled loop over vehicles and control ticks: references, controllers, actuators, plant.

``advance`` is the compiled loop, ``advance_plain`` the same Python code uncompiled: the oracle of the
tests. What it composes are the small scalar functions of ``controllers`` and ``plant``.
"""

from __future__ import annotations

import numpy as np

from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.columns import FloatMatrix, UInt8Column
from xgv_cosim.fleet_columns import (
    Motion,
    Reference,
    Setpoints,
    idle_motion,
    idle_setpoints,
    motion_in,
    motion_table,
    reference_in,
    reference_table,
    setpoint_tables,
)
from xgv_cosim.jit import compiled
from xgv_cosim.kernel.driven import settled
from xgv_cosim.kernel.loop import advance_in_place
from xgv_cosim.kernel.placing import adopt_in_place, own_in_place, place_in_place
from xgv_cosim.kernel.setting import set_points_in_place
from xgv_cosim.kernel.settling import (
    next_engagement_in,
    next_expiry_in,
    next_take_over_in,
)
from xgv_cosim.kernel.sources import kernel_sources
from xgv_cosim.kernel.watching import note_inputs_in_place
from xgv_cosim.parameters import ParameterColumns, VehicleParameters, parameter_columns, parameter_table

__all__ = [
    "adopt",
    "advance",
    "advance_plain",
    "kernel_sources",
    "next_engagement",
    "next_expiry",
    "next_take_over",
    "note_inputs",
    "own",
    "place",
    "set_points",
    "settled",
    "warm_up",
]


_advance_compiled = compiled(advance_in_place, kernel_sources())
note_inputs = compiled(note_inputs_in_place, kernel_sources())
"""``watching.note_inputs_in_place`` as machine code."""
next_expiry = compiled(next_expiry_in, kernel_sources())
"""``settling.next_expiry_in`` as machine code."""
next_take_over = compiled(next_take_over_in, kernel_sources())
"""``settling.next_take_over_in`` as machine code."""
next_engagement = compiled(next_engagement_in, kernel_sources())
"""``settling.next_engagement_in`` as machine code."""
own = compiled(own_in_place, kernel_sources())
"""``placing.own_in_place`` as machine code."""
place = compiled(place_in_place, kernel_sources())
"""``placing.place_in_place`` as machine code."""
adopt = compiled(adopt_in_place, kernel_sources())
"""``placing.adopt_in_place`` as machine code."""
set_points = compiled(set_points_in_place, kernel_sources())
"""``setting.set_points_in_place`` as machine code."""


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
    after, gears, followed = _copies(motion, reference)
    _advance_compiled(
        after,
        gears,
        followed,
        *setpoint_tables(setpoints),
        parameter_table(parameters),
        ticks,
        CONTROL_TICK_S,
    )
    return motion_in(after, gears), reference_in(followed)


def advance_plain(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, ticks: int
) -> tuple[Motion, Reference]:
    """Return what ``advance`` returns, computed by the same code in plain Python (slow: for tests)."""
    after, gears, followed = _copies(motion, reference)
    advance_in_place(
        after,
        gears,
        followed,
        *setpoint_tables(setpoints),
        parameter_table(parameters),
        ticks,
        CONTROL_TICK_S,
    )
    return motion_in(after, gears), reference_in(followed)


def warm_up() -> None:
    """Compile the loop, or load it from the disk cache, so that the first step does not."""
    reference = Reference(*(np.zeros(1) for _ in Reference._fields))
    advance(idle_motion(1), reference, idle_setpoints(1), parameter_columns(VehicleParameters(), 1), 1)


def _copies(motion: Motion, reference: Reference) -> tuple[FloatMatrix, UInt8Column, FloatMatrix]:
    return motion_table(motion).copy(), motion.gear.copy(), reference_table(reference).copy()
