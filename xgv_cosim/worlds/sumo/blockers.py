"""Bodies in the way: who stands inside a junction, or off the road, and reaches into a lane ahead.

SUMO knows a leader by his lane. One who waits inside a junction on another lane, to turn off it, may leave
his tail in the way of those who go straight on: he is nobody's leader there, and on no lane whose foe they
are. Somebody who crosses the way counts as standing in it for as long as he does.
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
_APART_M = 1.0
"""Points on a body lie no further apart along it."""
_ACROSS = np.array([-0.5, 0.0, 0.5])
"""And so across it, in widths to the left."""


def bodies_in_the_way(
    snapshot: Snapshot,
    rows: IntColumn,
    way_x_m: FloatMatrix,
    way_y_m: FloatMatrix,
    lanes: IntColumn,
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
        inside_junction: Which lanes of the network lie inside a junction.
        places: The junctions at the ends of each lane; who has none in common is on another road.

    Returns:
        Columns of shape ``(n,)``: ``inf`` and 0 where nobody is in the way.
    """
    gap_m, speed_mps = np.full(rows.size, np.inf), np.zeros(rows.size)
    others = np.flatnonzero((snapshot.lane < 0) | inside_junction[snapshot.lane])
    if not others.size or not rows.size:
        return gap_m, speed_mps
    half_m = 0.5 * np.hypot(snapshot.length_m, snapshot.width_m)
    centre = _places_on(snapshot, others, np.array([0.5]), np.array([0.0]))[:, 0]
    for number, own in enumerate(rows.tolist()):
        near = np.hypot(centre[:, 0] - snapshot.front_x_m[own], centre[:, 1] - snapshot.front_y_m[own]) < (
            _SIGHT_M + half_m[others]
        )
        candidates = np.flatnonzero(near & (others != own))
        if not candidates.size:
            continue
        way = np.column_stack([way_x_m[number, :_NUM_POINTS], way_y_m[number, :_NUM_POINTS]])
        corridor_m = 0.5 * float(snapshot.width_m[own]) + _ROOM_M
        away_m = _along_way(way, centre[candidates][:, None])[1][:, 0]
        candidates = candidates[away_m < corridor_m + half_m[others[candidates]]]
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


def _is_on_this_road(
    snapshot: Snapshot, other: int, here: frozenset[str], places: Sequence[frozenset[str]]
) -> bool:
    """Return whether a body is at a junction of the way, rather than on a road that leads over it."""
    lane = int(snapshot.lane[other])
    return lane < 0 or not here or not places[lane].isdisjoint(here)


def _first(snapshot: Snapshot, bodies: IntColumn, way: FloatMatrix, corridor_m: float) -> tuple[float, float]:
    """Return where along the way the first of some bodies reaches into it, and its speed along the way."""
    longest_m = float(snapshot.length_m[bodies].max())
    share = np.linspace(0.0, 1.0, int(np.ceil(longest_m / _APART_M)) + 1)
    at_m, away_m, segment = _along_way(way, _places_on(snapshot, bodies, share, _ACROSS))
    reaches = (away_m < corridor_m) & (at_m > 0.0) & (at_m < _SIGHT_M)
    if not reaches.any():
        return np.inf, 0.0
    at_m = np.where(reaches, at_m, np.inf)
    body, point = np.unravel_index(int(at_m.argmin()), at_m.shape)
    step = way[segment[body, point] + 1] - way[segment[body, point]]
    heading_rad = float(snapshot.heading_rad[bodies[body]])
    along = float(step @ [np.cos(heading_rad), np.sin(heading_rad)]) / max(float(np.hypot(*step)), 1e-6)
    return float(at_m[body, point]), max(0.0, along * float(snapshot.speed_mps[bodies[body]]))


def _places_on(snapshot: Snapshot, bodies: IntColumn, share: FloatColumn, across: FloatColumn) -> FloatMatrix:
    """Return points on bodies, shape ``(m, len(share) * len(across), 2)``.

    Args:
        snapshot: The world.
        bodies: Rows of the bodies, shape ``(m,)``.
        share: How far behind the front bumper, in lengths.
        across: How far left of the middle, in widths.
    """
    back, left = (grid.ravel() for grid in np.meshgrid(share, across, indexing="ij"))
    heading_rad = snapshot.heading_rad[bodies][:, None]
    behind_m, beside_m = back * snapshot.length_m[bodies][:, None], left * snapshot.width_m[bodies][:, None]
    x_m = (
        snapshot.front_x_m[bodies][:, None] - behind_m * np.cos(heading_rad) - beside_m * np.sin(heading_rad)
    )
    y_m = (
        snapshot.front_y_m[bodies][:, None] - behind_m * np.sin(heading_rad) + beside_m * np.cos(heading_rad)
    )
    return np.stack([x_m, y_m], axis=-1)


def _along_way(way: FloatMatrix, points: FloatMatrix) -> tuple[FloatMatrix, FloatMatrix, IntColumn]:
    """Return (distance along a way, distance from it, nearest segment) of points ``(m, p, 2)``."""
    steps = np.diff(way, axis=0)
    lengths_m = np.maximum(np.hypot(*steps.T), 1e-6)
    directions = steps / lengths_m[:, None]
    from_begin = points[:, :, None, :] - way[:-1]
    along_m = np.clip((from_begin * directions).sum(axis=-1), 0.0, lengths_m)
    offset = from_begin - along_m[..., None] * directions
    away_m = np.hypot(offset[..., 0], offset[..., 1])
    nearest = away_m.argmin(axis=-1)
    found = nearest[..., None]
    at_m = PREVIEW_M[:_NUM_POINTS][nearest] + np.take_along_axis(along_m, found, -1)[..., 0]
    return at_m, np.take_along_axis(away_m, found, -1)[..., 0], nearest
