"""Bodies as oriented boxes: which are near each other, and which overlap, by separating axes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn, IntMatrix
from xgv_cosim.jit import compiled, inlinable
from xgv_cosim.snapshot import Snapshot

TOLERANCE_M = 0.01
"""Boxes overlap when they reach further than this into each other on every axis."""
_FIELDS = ("front_x_m", "front_y_m", "heading_rad", "length_m", "width_m")


def near_pairs(
    x_m: FloatColumn, y_m: FloatColumn, reach_m: FloatColumn, subjects: IntColumn
) -> tuple[IntColumn, IntColumn]:
    """Return (subject, other) of the pairs whose circles overlap, shape ``(k,)`` each.

    A pair of two subjects comes up once, with the smaller row first.

    Args:
        x_m: Centres, shape ``(n,)``.
        y_m: Likewise.
        reach_m: Radii of circles around the bodies, shape ``(n,)``.
        subjects: Rows whose neighbours are sought.
    """
    if np.ptp(y_m) > np.ptp(x_m):  # the longer side tells more of them apart
        x_m, y_m = y_m, x_m
    order = np.argsort(x_m, kind="stable")
    sorted_x_m, widest_m = x_m[order], float(reach_m.max(initial=0.0))
    first = np.searchsorted(sorted_x_m, x_m[subjects] - reach_m[subjects] - widest_m, side="left")
    last = np.searchsorted(sorted_x_m, x_m[subjects] + reach_m[subjects] + widest_m, side="right")
    counts = last - first
    one = np.repeat(subjects, counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    other = order[np.repeat(first, counts) + within]
    is_subject = np.zeros(len(x_m), np.bool_)
    is_subject[subjects] = True
    apart_m = np.hypot(x_m[other] - x_m[one], y_m[other] - y_m[one])
    kept = (apart_m < reach_m[one] + reach_m[other]) & (one != other) & (~is_subject[other] | (one < other))
    return one[kept], other[kept]


def overlap(
    centre_m: FloatColumn, heading_rad: FloatColumn, half_m: FloatColumn, one: IntColumn, other: IntColumn
) -> BoolColumn:
    """Return which pairs of boxes overlap by more than ``TOLERANCE_M`` on every axis, shape ``(k,)``.

    Args:
        centre_m: Centres of the boxes, shape ``(n, 2)``.
        heading_rad: Directions of their long sides, shape ``(n,)``.
        half_m: Half lengths and half widths, shape ``(n, 2)``.
        one: First box of each pair, shape ``(k,)``.
        other: Second box of each pair, shape ``(k,)``.
    """
    forward = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    axes = np.stack([forward, np.column_stack([-forward[:, 1], forward[:, 0]])], axis=1)
    apart_m = centre_m[other] - centre_m[one]
    overlaps = np.ones(len(one), np.bool_)
    for box in (one, other):
        for number in (0, 1):
            axis = axes[box, number]
            room_m = np.abs((apart_m * axis).sum(axis=1))
            for each in (one, other):
                shadow = np.abs(np.einsum("kij,kj->ki", axes[each], axis))
                room_m = room_m - (half_m[each] * shadow).sum(axis=1)
            overlaps &= room_m < -TOLERANCE_M
    return overlaps


class Boxes(NamedTuple):
    """Bodies; every column has shape ``(n,)``."""

    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    length_m: FloatColumn
    width_m: FloatColumn

    def placed(self) -> tuple[FloatMatrix, FloatColumn, FloatMatrix]:
        """Return centres, headings and half sizes, as ``overlap`` takes them."""
        half_m = 0.5 * np.column_stack([self.length_m, self.width_m])
        x_m = self.front_x_m - half_m[:, 0] * np.cos(self.heading_rad)
        y_m = self.front_y_m - half_m[:, 0] * np.sin(self.heading_rad)
        return np.column_stack([x_m, y_m]), self.heading_rad, half_m


def boxes_of(snapshot: Snapshot, rows: IntColumn) -> Boxes:
    """Return the bodies of some rows; nobody else's is read."""
    return Boxes(*[snapshot.of(name, rows) for name in _FIELDS])


class _Sorted(NamedTuple):
    """Boxes along one axis of the map; every column has shape ``(n,)``."""

    x_m: FloatColumn
    """Centres."""
    y_m: FloatColumn
    cosine: FloatColumn
    """Direction of the long side."""
    sine: FloatColumn
    half_length_m: FloatColumn
    half_width_m: FloatColumn
    reach_m: FloatColumn
    """Radius of the circle around the box."""
    is_subject: BoolColumn


@inlinable
def _apart(boxes: _Sorted, one: int, other: int) -> bool:
    """Return whether one of the four axes of two boxes separates them."""
    east_m, north_m = boxes.x_m[other] - boxes.x_m[one], boxes.y_m[other] - boxes.y_m[one]
    cosine = boxes.cosine[one] * boxes.cosine[other] + boxes.sine[one] * boxes.sine[other]
    sine = boxes.cosine[one] * boxes.sine[other] - boxes.sine[one] * boxes.cosine[other]
    cosine, sine = abs(cosine), abs(sine)  # of the angle between them
    for number in (one, other):
        away = other if number == one else one
        half_length_m, half_width_m = boxes.half_length_m[away], boxes.half_width_m[away]
        along_m = abs(east_m * boxes.cosine[number] + north_m * boxes.sine[number])
        room_m = along_m - boxes.half_length_m[number] - half_length_m * cosine - half_width_m * sine
        if room_m >= -TOLERANCE_M:
            return True
        across_m = abs(north_m * boxes.cosine[number] - east_m * boxes.sine[number])
        room_m = across_m - boxes.half_width_m[number] - half_length_m * sine - half_width_m * cosine
        if room_m >= -TOLERANCE_M:
            return True
    return False


def touching_in(boxes: _Sorted, pairs: IntMatrix) -> int:
    """Note the pairs that overlap, as many as there is room for, and return how many there are."""
    widest_m, found = boxes.reach_m.max(), 0
    for one in range(len(boxes.x_m)):
        for other in range(one + 1, len(boxes.x_m)):
            ahead_m, reach_m = boxes.x_m[other] - boxes.x_m[one], boxes.reach_m[one] + boxes.reach_m[other]
            if ahead_m >= boxes.reach_m[one] + widest_m:
                break
            if ahead_m >= reach_m or not (boxes.is_subject[one] or boxes.is_subject[other]):
                continue
            if math.hypot(ahead_m, boxes.y_m[other] - boxes.y_m[one]) >= reach_m or _apart(boxes, one, other):
                continue
            if found < len(pairs):
                pairs[found, 0], pairs[found, 1] = one, other
            found += 1
    return found


_touching_compiled = compiled(touching_in, [Path(__file__)])
_ROOM = 32
"""So many pairs are usually enough."""


def touching(boxes: Boxes, subjects: IntColumn) -> IntMatrix:
    """Return the pairs of boxes that overlap, one of them a subject at least, the smaller row first.

    The compiled equal of ``near_pairs`` and ``overlap``.

    Args:
        boxes: Bodies.
        subjects: Rows.

    Returns:
        Rows, shape ``(k, 2)``, in their order.
    """
    if len(boxes.front_x_m) < 2:
        return np.zeros((0, 2), np.int64)
    cosine, sine = np.cos(boxes.heading_rad), np.sin(boxes.heading_rad)
    half_length_m, half_width_m = 0.5 * boxes.length_m, 0.5 * boxes.width_m
    x_m, y_m = boxes.front_x_m - half_length_m * cosine, boxes.front_y_m - half_length_m * sine
    is_subject = np.zeros(len(x_m), np.bool_)
    is_subject[subjects] = True
    if np.ptp(y_m) > np.ptp(x_m):  # the longer side tells more of them apart; east and north change places
        x_m, y_m, cosine, sine = y_m, x_m, sine, cosine
    order = np.argsort(x_m, kind="stable")
    along = _Sorted(
        x_m[order],
        y_m[order],
        cosine[order],
        sine[order],
        half_length_m[order],
        half_width_m[order],
        np.hypot(half_length_m, half_width_m)[order],
        is_subject[order],
    )
    pairs = np.zeros((_ROOM, 2), np.int64)
    found = _touching_compiled(along, pairs)
    if found > len(pairs):
        pairs = np.zeros((found, 2), np.int64)
        _touching_compiled(along, pairs)
    rows = np.sort(order[pairs[:found]], axis=1)
    return rows[np.lexsort((rows[:, 1], rows[:, 0]))]
