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


def test_a_crossing_counts_near_the_place() -> None:
    levels = Levels((EAST, np.array([[90.0, -60.0], [90.0, 60.0]])), lambda _: 0.0)
    assert not levels.are_apart(NAMES, (0, 1), 30.0, 0.0)
    assert levels.are_apart(NAMES, (0, 1), 85.0, 0.0)


BEGINS_HERE = np.array([[50.0, 2.0], [50.0, 60.0]])


@pytest.mark.parametrize(
    ("before", "apart"),
    [
        pytest.param([[50.0, -60.0], [50.0, 2.0]], True, id="it has crossed the other"),
        pytest.param([[50.0, -60.0], [50.0, -2.0]], True, id="it has, but for a gap at the junction"),
        pytest.param([[-9.0, 2.0], [45.0, 2.0], [50.0, 2.0]], False, id="it has come along beside the other"),
        pytest.param(None, False, id="its road begins there"),
    ],
)
def test_where_a_lane_begins_the_lane_before_it_tells(before: list[list[float]] | None, apart: bool) -> None:
    """Not a line straight back from its beginning, on which no road is."""
    if before is None:
        levels = Levels((EAST, BEGINS_HERE), lambda _: 0.0, ((), ()))
    else:
        levels = Levels((EAST, BEGINS_HERE, np.array(before)), lambda _: 0.0, ((), (), (1,)))
    assert levels.are_apart(NAMES, (0, 1), 50.0, 3.0) is apart
    assert levels.are_apart(NAMES, (1, 0), 50.0, 3.0) is apart
    backwards = tuple(shape[::-1].copy() for shape in levels.shapes_m)
    onward = ((), (2,), ()) if before is not None else ((), ())
    assert Levels(backwards, lambda _: 0.0, onward).are_apart(NAMES, (0, 1), 50.0, 3.0) is apart


def test_a_lane_before_that_crosses_the_other_in_a_junction_tells_nothing() -> None:
    """Two roads from one junction: it is on one level there, whatever the two do behind it."""
    before = np.array([[50.0, -60.0], [50.0, 2.0]])
    places = (frozenset("pq"), frozenset("rs"), frozenset("pr"))
    assert not Levels((EAST, BEGINS_HERE, before), lambda _: 0.0, ((), (), (1,)), places).are_apart(
        NAMES, (0, 1), 50.0, 3.0
    )


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


def contacts_of(
    folder: Path,
    nodes: str,
    edges: str,
    other: str,
    at_m: tuple[float, float],
    *,
    depart_m: float = 100,
    heading_rad: float = 0.0,
) -> set[str]:
    """Return whom the bound car touches that stands at a place beside its lane ``e1_0``."""
    net = plain_network(folder, nodes, edges)
    vehicles = car("ego", depart_m, 0, kind="xgv", route="e1") + car("other", 30, 10, route=other)
    world = SumoWorld.headless(write_config(folder, vehicles, net), step_s=0.1, seed=1)
    world.start()
    world.step(nobody())
    world.bind("ego", CouplingKind.FREE)
    touched: set[str] = set()
    try:
        for _ in range(250):
            snapshot = world.step(place("ego", *at_m, heading_rad, speed_mps=0.0, travelled_m=0.0))
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


def test_a_car_at_the_beginning_of_its_road_is_touched_by_who_drives_past_it(tmp_path: Path) -> None:
    """The road leads away at a right angle; behind its beginning there is none that could cross the other."""
    nodes = '<node id="a" x="150" y="1"/><node id="b" x="150" y="200"/>'
    nodes += '<node id="p" x="0" y="0"/><node id="q" x="300" y="0"/>'
    edges = FORTH + '<edge id="past" from="p" to="q" numLanes="1" speed="14"/>'
    north = contacts_of(tmp_path, nodes, edges, "past", (151.6, 3.4), depart_m=5, heading_rad=np.pi / 2)
    assert north == {"ego", "other"}


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
