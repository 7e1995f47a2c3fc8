"""Which of two lanes that overlap on the map lies above the other: by height, else by how they cross.

A bridge crosses what is below it; carriageways that lie side by side, without a junction in common, do not.
Networks without heights tell the two apart only by that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from xgv_cosim.columns import FloatColumn, FloatMatrix

CLEARANCE_M = 2.5
"""Vehicles further apart in height do not touch; less than any bridge leaves below it."""
LEAST_CROSSING_RAD = float(np.radians(20.0))
"""Lanes at a smaller angle to each other lie side by side."""
NEAR_M = 20.0
"""So far around the place a crossing is looked for; past its ends a lane goes straight on that far."""


@dataclass(frozen=True, slots=True)
class Levels:
    """The lanes of a network, by their numbers."""

    shapes_m: tuple[FloatMatrix, ...]
    """Centre line of each lane, shape ``(k, 2)``, ``k`` at least 2, no point repeated."""
    height_m: Callable[[str], float]
    """Tells how high a vehicle stands; 0 where the network has no heights."""

    def are_apart(self, ids: tuple[str, str], lanes: tuple[int, int], x_m: float, y_m: float) -> bool:
        """Return whether two vehicles that overlap on the map, at a place on two lanes, pass each other."""
        first_m, second_m = (self.height_m(vehicle_id) for vehicle_id in ids)
        if first_m or second_m:
            return abs(first_m - second_m) > CLEARANCE_M
        return self._cross(*lanes, np.array([x_m, y_m]))

    def _cross(self, lane: int, other: int, place: FloatColumn) -> bool:
        """Return whether two centre lines cross near a place, not at a small angle."""
        (start, step), (other_start, other_step) = (
            _segments_near(self.shapes_m[number], place) for number in (lane, other)
        )
        step, other_step = step[:, None], other_step[None]
        off = other_start[None] - start[:, None]
        turn = _cross_product(step, other_step)
        lengths = np.hypot(*np.moveaxis(step, 2, 0)) * np.hypot(*np.moveaxis(other_step, 2, 0))
        steep = np.abs(turn) > np.sin(LEAST_CROSSING_RAD) * lengths
        divisor = np.where(steep, turn, 1.0)
        along, along_other = _cross_product(off, other_step) / divisor, _cross_product(off, step) / divisor
        meets = (along >= 0.0) & (along <= 1.0) & (along_other >= 0.0) & (along_other <= 1.0)
        return bool((steep & meets).any())


def _cross_product(one: FloatColumn, other: FloatColumn) -> FloatColumn:
    product: FloatColumn = one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]
    return product


def _segments_near(shape: FloatMatrix, place: FloatColumn) -> tuple[FloatMatrix, FloatMatrix]:
    """Return (start, step) of the segments near a place, of a line that goes straight on at its ends."""
    first, last = shape[0] - shape[1], shape[-1] - shape[-2]
    ends = [shape[0] + first * (NEAR_M / np.hypot(*first)), shape[-1] + last * (NEAR_M / np.hypot(*last))]
    longer = np.vstack([ends[0], shape, ends[1]])
    steps, off = np.diff(longer, axis=0), place - longer[:-1]
    share = np.clip((off * steps).sum(axis=1) / (steps**2).sum(axis=1), 0.0, 1.0)
    near = np.hypot(*(off - share[:, None] * steps).T) < NEAR_M
    return longer[:-1][near], steps[near]
