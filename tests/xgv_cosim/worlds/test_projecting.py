"""Points in the frame of a lane, against shapely's geometry."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from xgv_cosim.worlds.sumo.lane_table import tables_of
from xgv_cosim.worlds.sumo.projecting import project

FAR_M = 1e4
metres = st.floats(-60.0, 60.0)
steps = st.tuples(st.floats(1.0, 30.0), st.floats(-1.2, 1.2))


@settings(deadline=None)  # the first call compiles
@given(
    turns=st.lists(steps, min_size=1, max_size=6),
    points=st.lists(st.tuples(metres, metres), min_size=1, max_size=4),
    scale=st.floats(0.5, 2.0),
)
def test_a_point_lies_where_shapely_finds_the_nearest_place_of_the_line(
    turns: list[tuple[float, float]], points: list[tuple[float, float]], scale: float
) -> None:
    lengths_m, angles_rad = np.array(turns).T
    courses_rad = np.cumsum(angles_rad)
    units = np.stack([np.cos(courses_rad), np.sin(courses_rad)], axis=1)
    shape = np.concatenate([[[0.0, 0.0]], np.cumsum(units * lengths_m[:, None], axis=0)])
    drawn_m = float(lengths_m.sum())
    other = np.array([[0.0, 0.0], [1.0, 0.0]])  # lanes lie one behind the other in the tables
    tables = tables_of(
        [other, shape], np.array([1.0, drawn_m / scale]), np.array([3.2, 3.2]), np.array([-1, -1])
    )

    x_m, y_m = np.array(points).T.copy()
    position_m, lateral_m = project(tables, 1, x_m, y_m)

    longer = np.concatenate([shape[:1] - FAR_M * units[0], shape[1:-1], shape[-1:] + FAR_M * units[-1]])
    line = shapely.LineString(longer)
    for number, point in enumerate(points):
        away_m = shapely.distance(line, shapely.Point(point))
        assert abs(lateral_m[number]) == pytest.approx(away_m, abs=1e-6)
        place = shapely.line_interpolate_point(line, FAR_M + position_m[number] * scale)
        assert shapely.distance(place, shapely.Point(point)) == pytest.approx(away_m, abs=1e-6)


def test_left_of_the_line_is_positive() -> None:
    tables = tables_of(
        [np.array([[0.0, 0.0], [10.0, 0.0]])], np.array([10.0]), np.array([3.2]), np.array([-1])
    )
    _, lateral_m = project(tables, 0, np.array([5.0, 5.0, -5.0]), np.array([1.0, -1.0, 1.0]))
    assert lateral_m.tolist() == [1.0, -1.0, 1.0]
