"""The choice of ``CouplingKind.AUTO``: in the frame of the lane while that is exact, freely otherwise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn
    from xgv_cosim.worlds.sumo.lane_frame import InLane

TOLERANCE_M = 0.05
"""Largest distance of SUMO's front bumper from the plant's while a vehicle is mirrored."""
TOLERANCE_RAD = math.radians(1.0)
"""Largest difference of SUMO's heading from the plant's meanwhile."""
_BACKWARDS_M = 1e-3
"""So far back the projection may fall in one step without it being reverse."""
SETTLING_STEPS = 5
"""A vehicle is mirrored only after so many steps in a row in which that would have been exact."""


def is_exact(in_lane: InLane, along_m: FloatColumn, *, at_rest: BoolColumn) -> BoolColumn:
    """Return where SUMO can have the plant's pose in its lane, forwards, with front and body inside it.

    Args:
        in_lane: The placed vehicles in the frames of their lanes, shape ``(n,)``.
        along_m: Distance along the lane in this step, shape ``(n,)``.
        at_rest: Who stands.
    """
    half_m = 0.5 * in_lane.width_m
    exact: BoolColumn = (
        (in_lane.error_m <= TOLERANCE_M)
        & (in_lane.error_rad <= TOLERANCE_RAD)
        & (np.abs(in_lane.lateral_m) <= half_m)
        & (np.abs(in_lane.body_lateral_m) <= half_m)
        & ((along_m >= 0.0) | ((along_m >= -_BACKWARDS_M) & at_rest))
    )
    return exact


@dataclass(slots=True)
class Choice:
    """Of one vehicle: leaves the lane frame at once, and comes back only when it has settled."""

    _steps: int = 0
    """Steps in a row in which mirroring was exact, up to ``SETTLING_STEPS``; below 0 after a refusal."""

    def mirrors(self, exact: bool) -> bool:
        """Return whether the vehicle is mirrored in this step, if that is ``exact``."""
        self._steps = min(self._steps + 1, SETTLING_STEPS) if exact else min(self._steps, 0)
        return exact and self._steps >= SETTLING_STEPS

    def refuse(self) -> None:
        """Place it freely for a while: SUMO did otherwise than was foreseen."""
        self._steps = -10 * SETTLING_STEPS
