"""SumoRoad: columns instead of calls, checked against plain geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.worlds.sumo.road import SumoRoad, drawable

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatMatrix

BEND = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 0.0], [30.0, 40.0]])
"""70 m long as drawn, with a point twice, 140 m long in the lanes' measure."""


def road(
    *shapes: FloatMatrix, lengths_m: list[float], successors: tuple[tuple[tuple[str, int], ...], ...]
) -> SumoRoad:
    number = len(shapes)
    return SumoRoad(
        lane_ids=tuple(f"l{index}" for index in range(number)),
        shapes=tuple(drawable(shape) for shape in shapes),
        lengths_m=np.array(lengths_m),
        widths_m=np.full(number, 3.2),
        limits_mps=np.arange(10.0, 10.0 + number),
        edge_ids=tuple(f"e{index}" for index in range(number)),
        successors=successors,
    )


CHAIN = road(
    BEND,
    np.array([[30.0, 40.0], [30.0, 41.0]]),
    np.array([[30.0, 41.0], [0.0, 41.0]]),
    lengths_m=[140.0, 1.0, 30.0],
    successors=((("e1", 1),), (("e2", 2),), ()),
)


def points(lane: int, position_m: list[float], next_lane: int = -1) -> list[tuple[float, float, float]]:
    many = len(position_m)
    found = CHAIN.points_ahead(np.full(many, lane), np.array(position_m), np.full(many, next_lane))
    return list(
        zip(found.x_m.round(9).tolist(), found.y_m.round(9).tolist(), found.heading_rad.tolist(), strict=True)
    )


def test_positions_are_scaled_from_the_lanes_measure_to_the_drawing() -> None:
    assert points(0, [0.0, 20.0, 100.0, 140.0]) == [
        (0.0, 0.0, 0.0),
        (10.0, 0.0, 0.0),
        (30.0, 20.0, np.pi / 2),
        (30.0, 40.0, np.pi / 2),
    ]


def test_a_position_past_the_end_goes_on_along_the_next_lane_and_its_only_successors() -> None:
    assert points(0, [140.5, 151.0], next_lane=1) == [(30.0, 40.5, np.pi / 2), (20.0, 41.0, np.pi)]


def test_without_a_next_lane_it_goes_straight_on() -> None:
    assert points(2, [35.0]) == [(-5.0, 41.0, np.pi)]
    assert points(0, [160.0]) == [(30.0, 50.0, np.pi / 2)]


def test_before_the_lane_it_goes_straight_back() -> None:
    assert points(0, [-10.0]) == [(-5.0, 0.0, 0.0)]


def test_off_the_road_there_is_no_point() -> None:
    assert np.isnan(points(-1, [3.0])).all()
    assert CHAIN.lane_width_m(np.array([-1, 0])).tolist() == [0.0, 3.2]
    assert CHAIN.lane_limit_mps(np.array([2, -1])).tolist() == [12.0, 0.0]
    assert CHAIN.lane_length_m(np.array([2, -1])).tolist() == [30.0, 0.0]


def test_the_next_lane_is_the_one_towards_the_edge() -> None:
    assert CHAIN.next_lane(0, "e1") == 1
    assert CHAIN.next_lane(0, "elsewhere") == -1


def test_a_lane_drawn_as_one_point_still_has_a_direction() -> None:
    dot = road(np.array([[5.0, 5.0], [5.0, 5.0]]), lengths_m=[0.1], successors=((),))
    found = dot.points_ahead(np.array([0]), np.array([0.05]), np.array([-1]))
    assert np.hypot(found.x_m - 5.0, found.y_m - 5.0)[0] < 0.01


@given(
    st.lists(st.tuples(st.floats(1.0, 50.0), st.floats(-1.0, 1.0)), min_size=1, max_size=8),
    st.floats(0.5, 2.0),
    st.floats(0.0, 1.0),
)
def test_a_point_lies_where_walking_the_polyline_leads(
    legs: list[tuple[float, float]], stretch: float, share: float
) -> None:
    steps = np.array([[way_m * np.cos(heading), way_m * np.sin(heading)] for way_m, heading in legs])
    shape = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
    drawn_m = float(sum(way_m for way_m, _ in legs))
    lane = road(shape, lengths_m=[drawn_m * stretch], successors=((),))
    found = lane.points_ahead(np.array([0]), np.array([share * drawn_m * stretch]), np.array([-1]))
    walked_m, at = share * drawn_m, shape[0]
    for (way_m, _), step in zip(legs, steps, strict=True):
        part = min(walked_m / way_m, 1.0)
        at = at + part * step
        walked_m -= part * way_m
    assert found.x_m[0] == pytest.approx(at[0], abs=1e-6)
    assert found.y_m[0] == pytest.approx(at[1], abs=1e-6)
