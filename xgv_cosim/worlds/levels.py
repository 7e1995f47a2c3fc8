"""Which of two lanes that overlap on the map lies above the other: by height, else by how they cross.

A bridge crosses what is below it; carriageways that lie side by side, without a junction in common, do not.
Networks without heights tell the two apart only by that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from xgv_cosim.columns import FloatColumn, FloatMatrix

CLEARANCE_M = 2.5
"""Vehicles further apart in height do not touch; less than any bridge leaves below it."""
LEAST_CROSSING_RAD = float(np.radians(20.0))
"""Lanes at a smaller angle to each other lie side by side."""
NEAR_M = 20.0
"""So far around the place a crossing is looked for, also on the lanes before and behind."""

_Segments = tuple[FloatMatrix, FloatMatrix]
"""Where they start, and the step from there, each of shape ``(k, 2)``."""


@dataclass(frozen=True)
class Levels:
    """The lanes of a network, by their numbers."""

    shapes_m: tuple[FloatMatrix, ...]
    """Centre line of each lane, shape ``(k, 2)``, ``k`` at least 2, no point repeated."""
    height_m: Callable[[str], float]
    """Tells how high a vehicle stands; 0 where the network has no heights."""
    onward: tuple[tuple[int, ...], ...] = ()
    """The lanes that each lane leads to; empty: not known."""
    places: tuple[frozenset[str], ...] = ()
    """The junctions of each lane: lanes with one in common cross on one level. Empty: not known."""

    def are_apart(self, ids: tuple[str, str], lanes: tuple[int, int], x_m: float, y_m: float) -> bool:
        """Return whether two vehicles that overlap on the map, at a place on two lanes, pass each other."""
        first_m, second_m = (self.height_m(vehicle_id) for vehicle_id in ids)
        if first_m or second_m:
            return abs(first_m - second_m) > CLEARANCE_M
        return self._cross(*lanes, np.array([x_m, y_m]))

    @cached_property
    def _back(self) -> tuple[tuple[int, ...], ...]:
        """The lanes that lead to each lane."""
        back: list[list[int]] = [[] for _ in self.shapes_m]
        for lane, reached in enumerate(self.onward):
            for beyond in reached:
                back[beyond].append(lane)
        return tuple(map(tuple, back))

    def _cross(self, lane: int, other: int, place: FloatColumn) -> bool:
        """Return whether the ways over two lanes cross near a place, not at a small angle.

        A lane that begins or ends nearby is followed to those before and behind, wherever they bend to.
        """
        own, others = self._around(lane, place), self._around(other, place)
        return any(
            _any_cross(segments, other_segments)
            for number, segments in own
            for other_number, other_segments in others
            if not self.places or self.places[number].isdisjoint(self.places[other_number])
        )

    def _around(self, lane: int, place: FloatColumn) -> list[tuple[int, _Segments]]:
        """Return the segments near a place, by their lane, of a lane and of those before and behind it."""
        found = [(lane, _segments_near(self.shapes_m[lane], place))]
        for links, end in ((self.onward, -1), (self._back, 0)):
            waiting, seen = [lane], {lane}
            while waiting and links:
                here = waiting.pop()
                at_end = self.shapes_m[here][end]
                if np.hypot(*(at_end - place)) > NEAR_M:
                    continue
                for beyond in [lane for lane in links[here] if lane not in seen]:
                    shape = self.shapes_m[beyond]  # networks without lanes inside junctions have gaps there
                    joined = np.vstack([at_end, shape] if end else [shape, at_end])
                    found.append((beyond, _segments_near(joined, place)))
                    waiting.append(beyond)
                seen.update(links[here])
        return found


def _any_cross(segments: _Segments, others: _Segments) -> bool:
    """Return whether one of some segments crosses one of others, not at a small angle."""
    (start, step), (other_start, other_step) = segments, others
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


def _segments_near(line: FloatMatrix, place: FloatColumn) -> _Segments:
    """Return the segments near a place."""
    steps, off = np.diff(line, axis=0), place - line[:-1]
    squares = np.maximum((steps**2).sum(axis=1), np.finfo(np.float64).tiny)  # a lane joins on without a gap
    share = np.clip((off * steps).sum(axis=1) / squares, 0.0, 1.0)
    near = np.hypot(*(off - share[:, None] * steps).T) < NEAR_M
    return line[:-1][near], steps[near]
