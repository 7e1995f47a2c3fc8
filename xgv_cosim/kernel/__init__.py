"""One compiled loop over vehicles and control ticks: references, controllers, actuators, plant.

``advance`` is the compiled loop, ``advance_plain`` the same Python code uncompiled: the oracle of the
tests. What it composes are the small scalar functions of ``controllers`` and ``plant``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.fleet import Motion, Reference, Setpoints, copied_motion, idle_motion, idle_setpoints
from xgv_cosim.jit import compiled
from xgv_cosim.kernel.loop import advance_in_place
from xgv_cosim.kernel.setting import set_points_in_place
from xgv_cosim.kernel.watching import note_inputs_in_place
from xgv_cosim.parameters import ParameterColumns, VehicleParameters, parameter_columns

__all__ = ["advance", "advance_plain", "kernel_sources", "note_inputs", "set_points", "warm_up"]


def kernel_sources() -> list[Path]:
    """Return every file whose code the compiled loop contains."""
    package = Path(__file__).parent.parent
    names = ("jit", "fleet", "parameters", "actuation", "clock", "commands")
    modules = [package / f"{name}.py" for name in names]
    folders = ("controllers", "kernel", "plant")
    return modules + [path for folder in folders for path in sorted((package / folder).glob("*.py"))]


_advance_compiled = compiled(advance_in_place, kernel_sources())
note_inputs = compiled(note_inputs_in_place, kernel_sources())
"""``watching.note_inputs_in_place`` as machine code."""
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
    after, followed = _copies(motion, reference)
    _advance_compiled(after, followed, setpoints, parameters, ticks, CONTROL_TICK_S)
    return after, followed


def advance_plain(
    motion: Motion, reference: Reference, setpoints: Setpoints, parameters: ParameterColumns, ticks: int
) -> tuple[Motion, Reference]:
    """Return what ``advance`` returns, computed by the same code in plain Python (slow: for tests)."""
    after, followed = _copies(motion, reference)
    advance_in_place(after, followed, setpoints, parameters, ticks, CONTROL_TICK_S)
    return after, followed


def warm_up() -> None:
    """Compile the loop, or load it from the disk cache, so that the first step does not."""
    reference = Reference(*(np.zeros(1) for _ in Reference._fields))
    advance(idle_motion(1), reference, idle_setpoints(1), parameter_columns(VehicleParameters(), 1), 1)


def _copies(motion: Motion, reference: Reference) -> tuple[Motion, Reference]:
    return copied_motion(motion), Reference(*(column.copy() for column in reference))
