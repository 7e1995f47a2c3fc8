"""How far SUMO moves a vehicle in a step: by its new speed (Euler), or the mean of old and new (ballistic).

SUMO does not tell which. Ballistic is chosen by ``--step-method.ballistic``, by any
``--default.action-step-length``, and (measured) for the whole simulation by the first type or vehicle that
is given an action step of its own, even in the middle of a run; not so where ``--step-method.ballistic
false`` stands in the configuration, which looks like the default. So it is guessed at first, and learnt from
vehicles that accelerate in the frame of their lanes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.inputs import TRUE

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn
    from xgv_cosim.worlds.sumo.engine import Engine

TELLING_M = 4e-3
"""Places that differ by this much from one way to the other tell which it is."""
_AGREES = 0.2
"""A vehicle is where one way would have it, if it is that much nearer to it than to the other."""


@dataclass(slots=True)
class Integration:
    """The way in use, as far as it is known."""

    step_s: float
    is_ballistic: bool = False

    @classmethod
    def of(cls, engine: Engine, step_s: float) -> Integration:
        """Return what options and types of the open simulation let expect."""
        option, types = engine.simulation.getOption, engine.vehicletype
        action_steps_s = {types.getActionStepLength(name) for name in types.getIDList()}
        is_option = option("step-method.ballistic").lower() in TRUE
        chosen = is_option or float(option("default.action-step-length")) > 0.0
        return cls(step_s, chosen or any(abs(length_s - step_s) > 1e-6 for length_s in action_steps_s))

    def otherwise_m(self, distance_m: FloatColumn, before_mps: FloatColumn) -> FloatColumn:
        """Return how much further vehicles get under the other way.

        Args:
            distance_m: How far they were to go in the step.
            before_mps: Their speeds before it.
        """
        mean_mps, before_mps = np.maximum(distance_m, 0.0) / self.step_s, np.maximum(before_mps, 0.0)
        if self.is_ballistic:
            return (np.maximum(2.0 * mean_mps - before_mps, 0.0) - mean_mps) * self.step_s
        return 0.5 * (before_mps - mean_mps) * self.step_s

    def learn(self, further_m: FloatColumn, otherwise_m: FloatColumn) -> None:
        """Take the other way for the one in use if vehicles are where that would have them.

        Args:
            further_m: How much further they got than they were to go.
            otherwise_m: How much further they would have under the other way.
        """
        telling = np.abs(otherwise_m) > TELLING_M
        shares = further_m[telling] / otherwise_m[telling]
        if np.sum(np.abs(shares - 1.0) < _AGREES) > np.sum(np.abs(shares) < _AGREES):
            self.is_ballistic = not self.is_ballistic
