"""Bodies inside a junction or off the road that reach into a vehicle's way, by geometry alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.xgv_cosim.recording.conftest import _snapshot as make_snapshot
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.surroundings import PREVIEW_M
from xgv_cosim.worlds.sumo.blockers import bodies_in_the_way

ROAD, JUNCTION, BRIDGE, FURTHER, NEXT_JUNCTION = 0, 1, 2, 3, 4
INSIDE = np.array([False, True, True, False, True])
PLACES = (frozenset("AB"), frozenset("B"), frozenset("C"), frozenset("BD"), frozenset("D"))


def scene(
    x_m: float, y_m: float, heading_rad: float, *, lane: int = JUNCTION, speed_mps: float = 0.0
) -> Snapshot:
    """Return ``own`` at the origin heading east, and ``other`` with its front bumper at a place."""
    return replace(
        make_snapshot(
            "own",
            "other",
            front_x_m=np.array([0.0, x_m]),
            front_y_m=np.array([0.0, y_m]),
            heading_rad=np.array([0.0, heading_rad]),
            speed_mps=np.array([10.0, speed_mps]),
            length_m=np.array([4.5, 4.5]),
            width_m=np.array([1.8, 1.8]),
        ),
        lane=np.array([ROAD, lane]),
        lane_position_m=np.array([50.0, 50.0]),
    )


def ahead(
    snapshot: Snapshot, curvature_per_m: float = 0.0, over_lines: tuple[int, ...] = ()
) -> tuple[float, float]:
    turned = PREVIEW_M * curvature_per_m
    x_m = PREVIEW_M if not curvature_per_m else np.sin(turned) / curvature_per_m
    y_m = 0.0 * PREVIEW_M if not curvature_per_m else (1.0 - np.cos(turned)) / curvature_per_m
    gap_m, speed_mps = bodies_in_the_way(
        snapshot,
        np.array([0]),
        x_m[None, :],
        y_m[None, :],
        np.array([[ROAD, FURTHER]]),
        np.array(over_lines, np.int64),
        INSIDE,
        PLACES,
    )
    return float(gap_m[0]), float(speed_mps[0])


@pytest.mark.parametrize(
    ("place", "gap_m"),
    [
        ((20.0, 0.0, 0.0), 15.5),  # ahead, the same way: its rear bumper
        ((20.0, 0.0, np.pi), 20.0),  # towards us: its front bumper
        ((20.0, 2.25, np.pi / 2), 19.1),  # across the way: its side
        ((20.0, 1.9, 0.0), 15.5),  # beside, but its body reaches in
        ((20.0, 2.2, 0.0), np.inf),  # beside, clear of the own width and 0.25 m
        ((-1.0, 0.0, 0.0), np.inf),  # behind
        ((46.0, 0.0, np.pi), np.inf),  # out of sight
    ],
)
def test_where_a_body_first_reaches_into_the_way(place: tuple[float, float, float], gap_m: float) -> None:
    assert ahead(scene(*place))[0] == pytest.approx(gap_m, abs=0.01)


def test_its_speed_counts_along_the_way_and_never_against_it() -> None:
    assert ahead(scene(20.0, 0.0, 0.0, speed_mps=6.0))[1] == pytest.approx(6.0)
    assert ahead(scene(20.0, 2.25, np.pi / 2, speed_mps=6.0))[1] == pytest.approx(0.0, abs=1e-9)
    assert ahead(scene(20.0, 0.0, np.pi, speed_mps=6.0))[1] == 0.0


def test_a_tail_that_waits_to_turn_stands_in_the_way_of_who_goes_straight_on() -> None:
    """As in scenario urban_grid: the front is 0.6 m beside the line and turned 8°, the tail is on it."""
    gap_m, speed_mps = ahead(scene(12.0, 0.6, 0.14))
    assert 7.0 < gap_m < 8.0
    assert speed_mps == 0.0


def test_the_way_is_followed_round_a_bend() -> None:
    """A quarter circle to the left of 20 m: a body on it is in the way, one straight ahead is not."""
    on_it = scene(20.0 * np.sin(1.0), 20.0 * (1.0 - np.cos(1.0)), 1.0 + np.pi)
    assert ahead(on_it, 0.05)[0] == pytest.approx(20.0, abs=0.3)
    assert ahead(scene(30.0, 0.0, 0.0), 0.05)[0] == np.inf


def test_who_drives_on_a_lane_of_the_road_is_left_to_sumo() -> None:
    assert ahead(scene(20.0, 0.0, 0.0, lane=ROAD))[0] == np.inf


def test_who_is_over_a_line_of_the_road_is_in_the_way_as_far_as_the_body_reaches_in() -> None:
    """A car that SUMO has turned in its lane change, with its front still in the lane beside."""
    turned = scene(20.0, 2.6, 0.2, lane=ROAD, speed_mps=3.0)
    gap_m, speed_mps = ahead(turned, over_lines=(1,))
    corner_x_m = 20.0 - 4.5 * np.cos(0.2) + 0.9 * np.sin(0.2)
    corner_y_m = 2.6 - 4.5 * np.sin(0.2) - 0.9 * np.cos(0.2)
    assert gap_m == pytest.approx(corner_x_m - (0.9 + 0.25 - corner_y_m) * np.tan(0.2), abs=0.01)
    assert speed_mps == pytest.approx(3.0 * np.cos(0.2))
    assert ahead(scene(20.0, 2.2, 0.0, lane=ROAD), over_lines=(1,))[0] == np.inf
    assert ahead(scene(-1.0, 1.0, 0.0, lane=ROAD), over_lines=(1,))[0] == np.inf


def test_who_is_off_the_road_counts_and_who_is_on_a_bridge_does_not() -> None:
    assert ahead(scene(20.0, 0.0, 0.0, lane=-1))[0] == pytest.approx(15.5)
    assert ahead(scene(20.0, 0.0, 0.0, lane=BRIDGE))[0] == np.inf


def test_the_junction_beyond_a_short_edge_belongs_to_the_way() -> None:
    assert ahead(scene(30.0, 0.0, 0.0, lane=NEXT_JUNCTION))[0] == pytest.approx(25.5)


@pytest.mark.parametrize("length_m", [4.5, 7.1, 12.0, 16.5])
@pytest.mark.parametrize("share", np.linspace(0.02, 0.98, 25).tolist())
def test_a_body_across_the_way_is_seen_wherever_it_crosses(length_m: float, share: float) -> None:
    """Also a bus whose corners are far from the lane."""
    across = scene(20.0, share * length_m, np.pi / 2)
    across = replace(across, length_m=np.array([4.5, length_m]), width_m=np.array([1.8, 2.5]))
    assert ahead(across)[0] == pytest.approx(18.75, abs=0.01)


def test_a_wide_body_that_comes_head_on_is_seen_between_its_corners() -> None:
    wide = replace(scene(20.0, 0.0, np.pi), width_m=np.array([1.8, 2.55]))
    assert ahead(wide)[0] == pytest.approx(20.0)


def test_nobody_looks_or_nobody_is_there() -> None:
    nothing = np.zeros((0, PREVIEW_M.size))
    gap_m, speed_mps = bodies_in_the_way(
        scene(20.0, 0.0, 0.0),
        np.zeros(0, np.int64),
        nothing,
        nothing,
        np.zeros((0, 2), np.int64),
        np.zeros(0, np.int64),
        INSIDE,
        PLACES,
    )
    assert gap_m.size == speed_mps.size == 0
