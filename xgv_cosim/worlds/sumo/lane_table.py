"""The lanes of a network as two tables for compiled code: one row for a lane, one for a vertex."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xgv_cosim.jit import inlinable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn

Table = npt.NDArray[Any]
"""A column of records, shape ``(n,)``; compiled code reads and writes the fields of a row by name."""

Row = np.record
"""One record of a table."""

LANE = np.dtype(
    [
        ("length_m", np.float64),
        ("width_m", np.float64),
        ("scale", np.float64),
        ("first_vertex", np.int64),
        ("last_vertex", np.int64),
        ("only_successor", np.int64),
    ]
)
VERTEX = np.dtype(
    [
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("at_m", np.float64),
        ("heading_rad", np.float64),
        ("cosine", np.float64),
        ("sine", np.float64),
    ]
)
_MOST_LANES_AHEAD = 16
"""So many lanes are followed past the end of the first; more lie beyond any preview."""


class LaneTables(NamedTuple):
    """A network."""

    lanes: Table
    """Rows of ``LANE``: lengths as SUMO counts them, ``scale`` metres of the drawn shape for each of these;
    the numbers of its first and last vertex; where it goes on when it has only one way to, else -1."""
    vertices: Table
    """Rows of ``VERTEX``: place, distance from the lane's beginning, direction to the next vertex."""
    leftwards: int
    """See ``SumoRoad.leftwards``."""


class LanePoint(NamedTuple):
    """A point of a lane's centre line; ``nan`` where there is no lane."""

    x_m: float
    y_m: float
    heading_rad: float
    cosine: float
    sine: float


def tables_of(
    shapes: Sequence[FloatMatrix],
    lengths_m: FloatColumn,
    widths_m: FloatColumn,
    only_successor: IntColumn,
    leftwards: int = 1,
) -> LaneTables:
    """Return the tables of lanes.

    Args:
        shapes: Centre line of each lane, shape ``(k, 2)``.
        lengths_m: SUMO's length of each lane.
        widths_m: Width of each lane.
        only_successor: Where each goes on when it has only one way to, else -1.
        leftwards: See ``SumoRoad.leftwards``.
    """
    lanes = np.zeros(len(shapes), LANE)
    lanes["length_m"], lanes["width_m"], lanes["only_successor"] = lengths_m, widths_m, only_successor
    last = np.cumsum([len(shape) for shape in shapes]) - 1
    lanes["first_vertex"] = np.concatenate([[0], last[:-1] + 1])
    lanes["last_vertex"] = last
    vertices = np.zeros(int(last[-1]) + 1, VERTEX)
    for lane, shape in zip(lanes, shapes, strict=True):
        rows = vertices[lane["first_vertex"] : lane["last_vertex"] + 1]
        steps = np.diff(shape, axis=0, append=shape[-1:])
        drawn_m = np.concatenate([[0.0], np.cumsum(np.hypot(*steps[:-1].T))])
        lane["scale"] = drawn_m[-1] / max(lane["length_m"], 1e-6)
        rows["x_m"], rows["y_m"] = shape.T
        rows["at_m"] = drawn_m / lane["scale"]
        rows["heading_rad"] = np.arctan2(steps[:, 1], steps[:, 0])
    vertices["cosine"], vertices["sine"] = np.cos(vertices["heading_rad"]), np.sin(vertices["heading_rad"])
    return LaneTables(lanes, vertices, leftwards)


@inlinable
def point_ahead(tables: LaneTables, lane: int, position_m: float, next_lane: int) -> LanePoint:
    """Return the point of the centre line at ``position_m``, as ``SumoRoad.points_ahead`` does for many."""
    if lane < 0:
        return LanePoint(np.nan, np.nan, np.nan, np.nan, np.nan)
    lanes, vertices = tables.lanes, tables.vertices
    for _ in range(_MOST_LANES_AHEAD):
        if next_lane < 0 or position_m <= lanes[lane].length_m:
            break
        position_m -= lanes[lane].length_m
        lane = next_lane
        next_lane = lanes[lane].only_successor
    within_m = min(max(position_m, 0.0), lanes[lane].length_m)
    low, high = lanes[lane].first_vertex, lanes[lane].last_vertex - 1
    while low < high:  # the last vertex but one that is not past it
        middle = (low + high + 1) // 2
        if vertices[middle].at_m <= within_m:
            low = middle
        else:
            high = middle - 1
    vertex = vertices[low]
    beyond_m = (position_m - vertex.at_m) * lanes[lane].scale
    return LanePoint(
        vertex.x_m + beyond_m * vertex.cosine,
        vertex.y_m + beyond_m * vertex.sine,
        vertex.heading_rad,
        vertex.cosine,
        vertex.sine,
    )
