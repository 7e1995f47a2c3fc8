"""Bodies in the way: who is inside a junction, off the road or over a line, and reaches into a lane ahead.

SUMO knows a leader by his lane. One who waits inside a junction on another lane, to turn off it, may leave
his tail in the way of those who go straight on: he is nobody's leader there, and on no lane whose foe they
are. Somebody who crosses the way counts as standing in it for as long as he does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.surroundings import PREVIEW_M
from xgv_cosim.worlds.boxes import near_pairs

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix, IntColumn
    from xgv_cosim.snapshot import Snapshot

_NUM_POINTS = int(np.searchsorted(PREVIEW_M, 41.0, side="right"))
"""So many points of the way are looked at."""
_SIGHT_M = float(PREVIEW_M[_NUM_POINTS - 1])
_ROOM_M = 0.25
"""Beside the own body this much has to be free as well."""
_CORNERS = np.array([[0.0, 0.5], [0.0, -0.5], [1.0, -0.5], [1.0, 0.5]])
"""Of a body, one after the other around it: (lengths behind the front bumper, widths to the left)."""
_KINK_M = 0.2
"""Straight pieces of a way overlap by this much each way, so that nothing is missed outside of a kink."""


def bodies_in_the_way(
    snapshot: Snapshot,
    rows: IntColumn,
    way_x_m: FloatMatrix,
    way_y_m: FloatMatrix,
    lanes: IntColumn,
    over_lines: IntColumn,
    inside_junction: BoolColumn,
    places: Sequence[frozenset[str]],
) -> tuple[FloatColumn, FloatColumn]:
    """Return (gap from the front bumper, speed along the way) of the first body in each way.

    Args:
        snapshot: The world.
        rows: Rows of the vehicles that look ahead, shape ``(n,)``.
        way_x_m: Their ways at ``PREVIEW_M``, from the front bumper on, shape ``(n, len(PREVIEW_M))``.
        way_y_m: Likewise.
        lanes: The lanes of each way in their order, shape ``(n, k)``, -1 past the end or unknown.
        over_lines: Rows of those whose bodies reach over a line, in any order.
        inside_junction: Which lanes of the network lie inside a junction.
        places: The junctions at the ends of each lane; who has none in common is on another road.

    Returns:
        Columns of shape ``(n,)``: ``inf`` and 0 where nobody is in the way.
    """
    gap_m, speed_mps = np.full(rows.size, np.inf), np.zeros(rows.size)
    tail_inside = snapshot.lane_position_m < snapshot.length_m
    looked_at = (snapshot.lane < 0) | inside_junction[snapshot.lane] | tail_inside
    looked_at[over_lines] = True
    others = np.flatnonzero(looked_at)
    if not others.size or not rows.size:
        return gap_m, speed_mps
    half_m = 0.5 * np.hypot(snapshot.length_m, snapshot.width_m)
    centre = _places_on(snapshot, others, np.array([[0.5, 0.0]]))[:, 0]
    for number, seen in _in_sight(snapshot, rows, centre, half_m[others]):
        own = int(rows[number])
        near = seen[others[seen] != own]
        way = np.column_stack([way_x_m[number, :_NUM_POINTS], way_y_m[number, :_NUM_POINTS]])
        corridor_m = 0.5 * float(snapshot.width_m[own]) + _ROOM_M
        candidates = near[_away_m(way, centre[near]) < corridor_m + half_m[others[near]]]
        here = frozenset().union(*(places[lane] for lane in lanes[number].tolist() if lane >= 0))
        bodies = np.array(
            [
                other
                for other in others[candidates].tolist()
                if _is_on_this_road(snapshot, other, here, places)
            ],
            np.int64,
        )
        if bodies.size:
            gap_m[number], speed_mps[number] = _first(snapshot, bodies, way, corridor_m)
    return gap_m, speed_mps


def _in_sight(
    snapshot: Snapshot, rows: IntColumn, centre: FloatMatrix, half_m: FloatColumn
) -> Iterator[tuple[int, IntColumn]]:
    """Yield the vehicles that look ahead and have bodies in sight, with the places of these in ``centre``."""
    count = len(rows)
    x_m = np.concatenate([snapshot.front_x_m[rows], centre[:, 0]])
    y_m = np.concatenate([snapshot.front_y_m[rows], centre[:, 1]])
    reach_m = np.concatenate([np.full(count, _SIGHT_M), half_m])
    seen, looks = near_pairs(x_m, y_m, reach_m, np.arange(count, len(x_m)))
    looks, seen = looks[looks < count], seen[looks < count] - count  # two bodies are a pair as well
    order = np.lexsort((seen, looks))
    looks, seen = looks[order], seen[order]
    numbers, first = np.unique(looks, return_index=True)
    ends = np.append(first, len(seen))[1:]
    for number, begin, end in zip(numbers.tolist(), first, ends, strict=True):
        yield number, seen[begin:end]


def _is_on_this_road(
    snapshot: Snapshot, other: int, here: frozenset[str], places: Sequence[frozenset[str]]
) -> bool:
    """Return whether a body is at a junction of the way, rather than on a road that leads over it."""
    lane = int(snapshot.lane[other])
    return lane < 0 or not here or not places[lane].isdisjoint(here)


def _first(snapshot: Snapshot, bodies: IntColumn, way: FloatMatrix, corridor_m: float) -> tuple[float, float]:
    """Return where along the way the first of some bodies reaches into it, and its speed along the way.

    Each side of each body is cut to the strip along each straight piece of the way, (bodies, 4, pieces).
    """
    corners = _places_on(snapshot, bodies, _CORNERS)
    steps = np.diff(way, axis=0)
    lengths_m = np.maximum(np.hypot(*steps.T), 1e-6)
    units = steps / lengths_m[:, None]
    from_begin = corners[:, :, None, :] - way[:-1]
    along_m = (from_begin * units).sum(axis=-1)
    aside_m = units[:, 0] * from_begin[..., 1] - units[:, 1] * from_begin[..., 0]
    along_onward_m, aside_onward_m = np.roll(along_m, -1, axis=1), np.roll(aside_m, -1, axis=1)
    back_m = np.full(lengths_m.size, -_KINK_M)
    back_m[0] = 0.0
    from_a, to_a = _share_within(aside_m, aside_onward_m, -corridor_m, corridor_m)
    from_b, to_b = _share_within(along_m, along_onward_m, back_m, lengths_m + _KINK_M)
    begin, end = np.maximum(np.maximum(from_a, from_b), 0.0), np.minimum(np.minimum(to_a, to_b), 1.0)
    step_m = along_onward_m - along_m
    nearest_m = np.minimum(along_m + begin * step_m, along_m + end * step_m)
    at_m = PREVIEW_M[: lengths_m.size] + np.clip(nearest_m, 0.0, lengths_m)
    at_m = np.where((begin <= end) & (at_m < _SIGHT_M), at_m, np.inf)
    body, _, piece = np.unravel_index(int(at_m.argmin()), at_m.shape)
    found_m = float(at_m.min())
    if not np.isfinite(found_m):
        return np.inf, 0.0
    heading_rad = float(snapshot.heading_rad[bodies[body]])
    along = float(units[piece] @ [np.cos(heading_rad), np.sin(heading_rad)])
    return found_m, max(0.0, along * float(snapshot.speed_mps[bodies[body]]))


def _share_within(
    first: FloatMatrix, last: FloatMatrix, low: float | FloatColumn, high: FloatColumn | float
) -> tuple[FloatMatrix, FloatMatrix]:
    """Return which share of the way from one value to another lies between two bounds: (from, to)."""
    change = last - first
    change = np.where(np.abs(change) < 1e-12, 1e-12, change)
    at_low, at_high = (low - first) / change, (high - first) / change
    return np.minimum(at_low, at_high), np.maximum(at_low, at_high)


def _places_on(snapshot: Snapshot, bodies: IntColumn, places: FloatMatrix) -> FloatMatrix:
    """Return points on bodies, shape ``(m, p, 2)``.

    Args:
        snapshot: The world.
        bodies: Rows of the bodies, shape ``(m,)``.
        places: (how far behind the front bumper, in lengths; how far left of the middle, in widths).
    """
    heading_rad = snapshot.heading_rad[bodies][:, None]
    behind_m = places[:, 0] * snapshot.length_m[bodies][:, None]
    beside_m = places[:, 1] * snapshot.width_m[bodies][:, None]
    x_m = (
        snapshot.front_x_m[bodies][:, None] - behind_m * np.cos(heading_rad) - beside_m * np.sin(heading_rad)
    )
    y_m = (
        snapshot.front_y_m[bodies][:, None] - behind_m * np.sin(heading_rad) + beside_m * np.cos(heading_rad)
    )
    return np.stack([x_m, y_m], axis=-1)


def _away_m(way: FloatMatrix, points: FloatMatrix) -> FloatColumn:
    """Return the distance of points ``(p, 2)`` from a way."""
    steps = np.diff(way, axis=0)
    lengths_m = np.maximum(np.hypot(*steps.T), 1e-6)
    directions = steps / lengths_m[:, None]
    from_begin = points[:, None, :] - way[:-1]
    along_m = np.clip((from_begin * directions).sum(axis=-1), 0.0, lengths_m)
    offset = from_begin - along_m[..., None] * directions
    away_m: FloatColumn = np.hypot(offset[..., 0], offset[..., 1]).min(axis=-1)
    return away_m
