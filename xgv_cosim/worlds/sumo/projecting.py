"""Points in the frame of a lane: how far along its centre line, and how far beside."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.jit import compiled
from xgv_cosim.worlds.sumo import lane_table

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn
    from xgv_cosim.worlds.sumo.lane_table import LaneTables


def project_in_place(
    tables: LaneTables,
    lane: int,
    x_m: FloatColumn,
    y_m: FloatColumn,
    position_m: FloatColumn,
    lateral_m: FloatColumn,
) -> None:
    """Find ``position_m`` and ``lateral_m`` of points at the nearest place of a lane's centre line."""
    first, last = tables.lanes[lane].first_vertex, tables.lanes[lane].last_vertex
    scale = tables.lanes[lane].scale
    for point in range(len(x_m)):
        nearest_m = np.inf
        for number in range(first, last):
            vertex = tables.vertices[number]
            east_m, north_m = x_m[point] - vertex.x_m, y_m[point] - vertex.y_m
            along_m = east_m * vertex.cosine + north_m * vertex.sine
            if along_m < 0.0 and number > first:
                along_m = 0.0
            drawn_m = (tables.vertices[number + 1].at_m - vertex.at_m) * scale
            if along_m > drawn_m and number < last - 1:
                along_m = drawn_m
            away_m = math.hypot(east_m - along_m * vertex.cosine, north_m - along_m * vertex.sine)
            if away_m < nearest_m:
                nearest_m = away_m
                position_m[point] = vertex.at_m + along_m / scale
                lateral_m[point] = math.copysign(away_m, north_m * vertex.cosine - east_m * vertex.sine)


_project_compiled = compiled(project_in_place, [Path(__file__), Path(lane_table.__file__)])


def project(
    tables: LaneTables, lane: int, x_m: FloatColumn, y_m: FloatColumn
) -> tuple[FloatColumn, FloatColumn]:
    """Return (position, offset to the left) of points at the nearest place of one lane's centre line.

    Before its beginning and past its end the line goes straight on.

    Args:
        tables: The lanes.
        lane: Which.
        x_m: East, shape ``(n,)``.
        y_m: North, likewise.
    """
    position_m, lateral_m = np.empty_like(x_m), np.empty_like(x_m)
    _project_compiled(tables, lane, x_m, y_m, position_m, lateral_m)
    return position_m, lateral_m
