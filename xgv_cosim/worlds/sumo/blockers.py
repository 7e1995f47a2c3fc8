"""Bodies in the way: who stands inside a junction, or off the road, and reaches into a lane ahead.

SUMO knows a leader by his lane. One who waits inside a junction on another lane, to turn off it, may leave
his tail in the way of those who go straight on: he is nobody's leader there, and on no lane whose foe they
are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.surroundings import PREVIEW_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.snapshot import Snapshot

_NUM_POINTS = int(np.searchsorted(PREVIEW_M, 41.0, side="right"))
"""So many points of the way are looked at."""
_SIGHT_M = float(PREVIEW_M[_NUM_POINTS - 1])
_ROOM_M = 0.25
"""Beside the own body this much has to be free as well."""
_OUTLINE = np.array([(-along, 0.5 * across) for along in (0.0, 0.5, 1.0) for across in (-1.0, 1.0)])
"""Points of a body's outline: (lengths behind the front bumper, widths to the left)."""


def bodies_in_the_way(
    snapshot: Snapshot,
    rows: IntColumn,
    way_x_m: FloatMatrix,
    way_y_m: FloatMatrix,
    lane: IntColumn,
    unlike_lanes: BoolColumn,
    places: Sequence[frozenset[str]],
) -> tuple[FloatColumn, FloatColumn]:
    """Return (gap from the front bumper, speed along the way) of the first body in each way.

    Args:
        snapshot: The world.
        rows: Rows of the vehicles that look ahead, shape ``(n,)``.
        way_x_m: Their ways at ``PREVIEW_M``, from the front bumper on, shape ``(n, len(PREVIEW_M))``.
        way_y_m: Likewise.
        lane: The lanes they are on, -1 off the road.
        unlike_lanes: Which lanes of the network lie inside a junction.
        places: The junctions at the ends of each lane; who has none in common is on another road.

    Returns:
        Columns of shape ``(n,)``: ``inf`` and 0 where nobody is in the way.
    """
    gap_m, speed_mps = np.full(rows.size, np.inf), np.zeros(rows.size)
    others = np.flatnonzero((snapshot.lane < 0) | unlike_lanes[snapshot.lane])
    if not others.size or not rows.size:
        return gap_m, speed_mps
    apart_x_m = snapshot.front_x_m[others] - snapshot.front_x_m[rows][:, None]
    apart_y_m = snapshot.front_y_m[others] - snapshot.front_y_m[rows][:, None]
    reach_m = _SIGHT_M + snapshot.length_m[others]
    near = (np.hypot(apart_x_m, apart_y_m) < reach_m) & (others != rows[:, None])
    for number, index in zip(*(side.tolist() for side in np.nonzero(near)), strict=True):
        other = int(others[index])
        there, here = int(snapshot.lane[other]), int(lane[number])
        if there >= 0 and here >= 0 and places[there].isdisjoint(places[here]):
            continue  # on a road that leads over this one
        found_m, along = _first_m(snapshot, int(rows[number]), other, way_x_m[number], way_y_m[number])
        if found_m < gap_m[number]:
            gap_m[number] = found_m
            speed_mps[number] = max(0.0, float(snapshot.speed_mps[other]) * along)
    return gap_m, speed_mps


def _first_m(
    snapshot: Snapshot, own: int, other: int, way_x_m: FloatColumn, way_y_m: FloatColumn
) -> tuple[float, float]:
    """Return where along the way a body first reaches into it (``inf``: nowhere), and how it heads there.

    The second value is the cosine between the other's heading and the way.
    """
    heading_rad = float(snapshot.heading_rad[other])
    forward = np.array([np.cos(heading_rad), np.sin(heading_rad)])
    left = np.array([-forward[1], forward[0]])
    front = np.array([snapshot.front_x_m[other], snapshot.front_y_m[other]])
    sizes = _OUTLINE * np.array([snapshot.length_m[other], snapshot.width_m[other]])
    outline = front + sizes[:, :1] * forward + sizes[:, 1:] * left
    way = np.column_stack([way_x_m[:_NUM_POINTS], way_y_m[:_NUM_POINTS]])
    steps = np.diff(way, axis=0)
    lengths_m = np.maximum(np.hypot(*steps.T), 1e-6)
    directions = steps / lengths_m[:, None]
    from_begin = outline[:, None, :] - way[:-1]
    along_m = np.clip((from_begin * directions).sum(axis=-1), 0.0, lengths_m)
    away_m = np.hypot(*np.moveaxis(from_begin - along_m[..., None] * directions, -1, 0))
    nearest = away_m.argmin(axis=1)
    points = np.arange(len(outline))
    at_m = PREVIEW_M[:_NUM_POINTS][nearest] + along_m[points, nearest]
    in_way = away_m[points, nearest] < 0.5 * snapshot.width_m[own] + _ROOM_M
    in_way &= (at_m > 0.0) & (at_m < _SIGHT_M)
    if not in_way.any():
        return np.inf, 0.0
    first = int(np.flatnonzero(in_way)[at_m[in_way].argmin()])
    return float(at_m[first]), float(directions[nearest[first]] @ forward)
