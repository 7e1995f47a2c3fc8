"""Bridges and carriageways side by side: who touches whom on lanes without a junction in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.levels import Levels
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

NAMES = ("one", "other")
EAST = np.array([[0.0, 0.0], [50.0, 0.0], [100.0, 0.0]])


@pytest.mark.parametrize(
    ("angle_deg", "apart"),
    [(0.0, False), (15.0, False), (25.0, True), (90.0, True), (155.0, True), (180.0, False)],
)
def test_on_the_flat_only_lanes_that_cross_are_apart(angle_deg: float, apart: bool) -> None:
    angle = np.radians(angle_deg)
    direction = np.array([np.cos(angle), np.sin(angle)])
    other = np.array([[50.0, 1.0] - 60.0 * direction, [50.0, 1.0] + 60.0 * direction])
    levels = Levels((EAST, other), lambda _: 0.0)
    assert levels.are_apart(NAMES, (0, 1), 50.0, 0.5) is apart
    assert levels.are_apart(NAMES, (1, 0), 50.0, 0.5) is apart


def test_a_crossing_counts_near_the_place_and_just_past_the_end_of_a_lane() -> None:
    up = np.array([[90.0, -60.0], [90.0, 60.0]])
    from_here = np.array([[50.0, 2.0], [50.0, 60.0]])  # the lane before it has crossed the other
    levels = Levels((EAST, up, from_here), lambda _: 0.0)
    assert not levels.are_apart(NAMES, (0, 1), 30.0, 0.0)
    assert levels.are_apart(NAMES, (0, 1), 85.0, 0.0)
    assert levels.are_apart(NAMES, (0, 2), 50.0, 3.0)


@pytest.mark.parametrize(
    ("heights_m", "apart"),
    [((0.0, 2.0), False), ((0.0, 3.0), True), ((-3.0, 0.0), True), ((5.0, 5.0), False)],
)
def test_heights_decide_where_there_are_any(heights_m: tuple[float, float], apart: bool) -> None:
    """Along a ramp beside a road, and where lanes cross on one level."""
    beside, across = EAST + np.array([0.0, 2.0]), np.array([[50.0, -20.0], [50.0, 20.0]])
    levels = Levels((EAST, beside, across), dict(zip(NAMES, heights_m, strict=True)).__getitem__)
    assert levels.are_apart(NAMES, (0, 1), 50.0, 1.0) is apart
    assert levels.are_apart(NAMES, (0, 2), 50.0, 1.0) is apart


def contacts_of(folder: Path, nodes: str, edges: str, other: str, at_m: tuple[float, float]) -> set[str]:
    """Return whom the bound car touches that stands at a place beside its lane ``e1_0``."""
    net = plain_network(folder, nodes, edges)
    vehicles = car("ego", 100, 0, kind="xgv", route="e1") + car("other", 30, 10, route=other)
    world = SumoWorld.headless(write_config(folder, vehicles, net), step_s=0.1, seed=1)
    world.start()
    world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    touched: set[str] = set()
    try:
        for _ in range(250):
            snapshot = world.step(place("ego", *at_m, 0.0, speed_mps=0.0, travelled_m=0.0))
            touched |= {name for c in snapshot.collisions for name in (c.collider, c.victim)}
            if "other" not in snapshot.ids:
                return touched
    finally:
        world.close()
    raise AssertionError("the other car has not driven through")


ROAD = '<node id="a" x="0" y="0"/><node id="b" x="300" y="0"/>'
FORTH = '<edge id="e1" from="a" to="b" numLanes="1" speed="14"/>'


def test_a_car_that_hangs_over_into_the_other_carriageway_is_touched(tmp_path: Path) -> None:
    """The carriageways have no junction in common; the car's body lies across the lane of the other."""
    nodes = ROAD + '<node id="p" x="300" y="0.5"/><node id="q" x="0" y="0.5"/>'
    edges = FORTH + '<edge id="r1" from="p" to="q" numLanes="1" speed="14"/>'
    assert contacts_of(tmp_path, nodes, edges, "r1", (150.0, 0.6)) == {"ego", "other"}
    assert contacts_of(tmp_path, nodes, edges, "r1", (150.0, -1.6)) == set()


@pytest.mark.parametrize(("height_m", "expected"), [(0.0, set()), (6.0, set()), (1.0, {"ego", "other"})])
def test_a_road_over_the_bound_car_is_touched_only_if_it_is_too_low(
    tmp_path: Path, height_m: float, expected: set[str]
) -> None:
    """Flat, a crossing without a junction is a bridge; with heights, these decide."""
    nodes = (
        ROAD + f'<node id="c" x="150" y="-100" z="{height_m}"/><node id="d" x="150" y="100" z="{height_m}"/>'
    )
    edges = FORTH + '<edge id="over" from="c" to="d" numLanes="1" speed="14"/>'
    assert contacts_of(tmp_path, nodes, edges, "over", (152.0, -1.6)) == expected
