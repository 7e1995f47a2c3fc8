"""Whose body reaches into the lane beside: against shapely, and in lane changes of SUMO's own drivers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon, affinity, box

from tests.contracts.world_contract import nobody
from tests.xgv_cosim.recording.conftest import _snapshot as make_snapshot
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.over_lines import OVER_M, bodies_over_lines
from xgv_cosim.worlds.sumo.road import SumoRoad
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

WIDTH_M, LENGTH_M, ROAD_M = 3.2, 5.0, 400.0
CENTRES_M = (0.0, 3.2, 6.4)
"""Of three lanes to the east, the one at the kerb first."""
KERB, MIDDLE, INNER = 0, 1, 2


def road(leftwards: int = 1) -> SumoRoad:
    """Return three lanes of one edge, and one inside a junction."""
    heights_m = (*CENTRES_M[::leftwards], 3.2)
    begins_m = (0.0, 0.0, 0.0, ROAD_M)
    return SumoRoad(
        lane_ids=("e_0", "e_1", "e_2", ":j_0_0"),
        shapes=tuple(
            np.array([[begin, y], [begin + ROAD_M, y]]) for begin, y in zip(begins_m, heights_m, strict=True)
        ),
        lengths_m=np.full(4, ROAD_M),
        widths_m=np.full(4, WIDTH_M),
        limits_mps=np.full(4, 30.0),
        edge_ids=("e", "e", "e", ":j_0"),
        successors=((),) * 4,
        leftwards=leftwards,
    )


def over(x_m: float, y_m: float, heading_rad: float, lane: int, the_road: SumoRoad) -> list[int]:
    snapshot = make_snapshot(
        "other",
        front_x_m=np.array([x_m]),
        front_y_m=np.array([y_m]),
        heading_rad=np.array([heading_rad]),
        lane=np.array([lane]),
        lane_position_m=np.array([x_m]),
        length_m=np.array([LENGTH_M]),
    )
    found = bodies_over_lines(the_road, snapshot)
    assert found.rows.tolist() == [0] * len(found.lane)
    assert found.position_m.tolist() == [x_m] * len(found.lane)
    return found.lane.tolist()


@given(
    st.sampled_from([KERB, MIDDLE, INNER]),
    st.floats(-0.5 * WIDTH_M, 0.5 * WIDTH_M),
    st.floats(-0.6, 0.6),
)
def test_the_lanes_that_shapely_finds_under_a_body(lane: int, left_m: float, heading_rad: float) -> None:
    y_m = CENTRES_M[lane] + left_m
    body: Polygon = box(200.0 - LENGTH_M, y_m - 0.9, 200.0, y_m + 0.9)
    body = affinity.rotate(body, heading_rad, origin=(200.0, y_m), use_radians=True)
    expected = []
    for beside in (lane + 1, lane - 1):
        if 0 <= beside < len(CENTRES_M):
            surface = box(0.0, CENTRES_M[beside] - 0.5 * WIDTH_M, ROAD_M, CENTRES_M[beside] + 0.5 * WIDTH_M)
            _, low_m, _, high_m = body.bounds
            at_line_m = min(high_m, surface.bounds[3]) - max(low_m, surface.bounds[1])
            if math.isclose(at_line_m, OVER_M, abs_tol=1e-9):
                return
            if body.intersects(surface) and at_line_m > OVER_M:
                expected.append(beside)
    assert over(200.0, y_m, heading_rad, lane, road()) == expected


def test_left_is_left_where_lanes_are_counted_from_the_other_side() -> None:
    assert over(200.0, CENTRES_M[MIDDLE] + 1.2, 0.0, MIDDLE, road(leftwards=-1)) == [0]
    assert over(200.0, CENTRES_M[MIDDLE] - 1.2, 0.0, MIDDLE, road(leftwards=-1)) == [2]


@pytest.mark.parametrize("to_left", [1.0, -1.0])
@pytest.mark.parametrize("radius_m", [80.0, 150.0])
def test_a_long_vehicle_in_the_middle_of_its_lane_on_a_bend(radius_m: float, to_left: float) -> None:
    """Its rear is beside the tangent at its front, but in its lane."""
    angle = np.linspace(0.0, 1.4, 141)
    shapes = []
    for centre_m in CENTRES_M:
        across_m = radius_m - to_left * (centre_m - CENTRES_M[MIDDLE])
        shapes.append(
            np.column_stack([across_m * np.sin(angle), to_left * (radius_m - across_m * np.cos(angle))])
        )
    bend = replace(
        road(),
        lane_ids=("e_0", "e_1", "e_2"),
        shapes=tuple(shapes),
        lengths_m=np.full(3, 1.4 * radius_m),
        widths_m=np.full(3, WIDTH_M),
        limits_mps=np.full(3, 30.0),
        edge_ids=("e",) * 3,
        successors=((),) * 3,
    )
    length_m, at_rad = 16.5, 0.7
    rear_rad = at_rad - 2.0 * math.asin(0.5 * length_m / radius_m)
    (front_x, rear_x), (front_y, rear_y) = (
        [radius_m * math.sin(a) for a in (at_rad, rear_rad)],
        [to_left * radius_m * (1.0 - math.cos(a)) for a in (at_rad, rear_rad)],
    )
    lorry = make_snapshot(
        "lorry",
        front_x_m=np.array([front_x]),
        front_y_m=np.array([front_y]),
        heading_rad=np.array([math.atan2(front_y - rear_y, front_x - rear_x)]),
        lane=np.array([MIDDLE]),
        lane_position_m=np.array([radius_m * at_rad]),
        length_m=np.array([length_m]),
        width_m=np.array([2.55]),
    )
    assert bodies_over_lines(bend, lorry).lane.tolist() == []


def test_nobody_off_the_road_or_inside_a_junction() -> None:
    assert over(200.0, 1.5, 0.0, -1, road()) == []
    assert over(500.0, 4.7, 0.0, 3, road()) == []


@pytest.mark.parametrize("own_lane", [0, 2])
def test_who_comes_from_the_other_side_is_seen_before_his_front_has_crossed_the_line(
    tmp_path: Path, own_lane: int
) -> None:
    """Both pull into the middle lane, where SUMO has nobody until the middle of a bumper is in."""
    nodes = '<node id="a" x="0" y="0"/><node id="b" x="600" y="0"/>'
    net = plain_network(tmp_path, nodes, '<edge id="ab" from="a" to="b" numLanes="3" speed="30"/>')
    vehicles = car("ego", 100, 10, lane=own_lane, route="ab", kind="xgv")
    vehicles += car("other", 92, 10, lane=2 - own_lane, route="ab")
    world = SumoWorld.headless(write_config(tmp_path, vehicles, net), step_s=0.1, seed=1)
    try:
        world.start()
        world.step(nobody())
        world.bind("ego", CouplingKind.AUTO)
        load_libsumo().vehicle.changeLane("other", 1, 100.0)
        seen_from_m, crossed_from = [], None
        for step in range(40):
            now = world.step(nobody())
            around = world.surroundings(["ego"])
            beside = around.left if own_lane == 0 else around.right
            if np.isfinite(beside.follower_gap_m[0]):
                away_m = float(now.front_y_m[now.index_of["other"]] + 1.5 * WIDTH_M)
                seen_from_m.append((step, abs(away_m), float(beside.follower_gap_m[0])))
            if crossed_from is None and world.road.lane_ids[now.lane[now.index_of["other"]]] == "ab_1":
                crossed_from = step
        first_step, away_m, gap_m = seen_from_m[0]
        assert crossed_from is not None
        assert first_step <= crossed_from - 6
        # front 0.9 m from the line; the body that SUMO turns about it reaches over a little earlier
        assert away_m == pytest.approx(WIDTH_M - 0.7, abs=0.35)
        assert gap_m == pytest.approx(8.0 - 4.4, abs=1.0)
        assert len(seen_from_m) == 40 - first_step
    finally:
        world.close()
