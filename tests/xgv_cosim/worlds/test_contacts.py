"""Contacts found from oriented boxes: the geometry against shapely, the merging, and real SUMO."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from tests.contracts.world_contract import ahead, nobody, place
from tests.xgv_cosim.recording.conftest import _snapshot as make_snapshot
from tests.xgv_cosim.simulation.bare_world import StraightRoad
from tests.xgv_cosim.worlds.sumo_traffic import car
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.snapshot import Collision
from xgv_cosim.worlds.boxes import TOLERANCE_M, Boxes, boxes_of, near_pairs, overlap, touching
from xgv_cosim.worlds.contacts import OVERLAP, Contacts

if TYPE_CHECKING:
    from tests.xgv_cosim.worlds.conftest import NewWorld

Box = tuple[float, float, float, float, float]
coordinate = st.floats(-8.0, 8.0)
boxes = st.tuples(coordinate, coordinate, st.floats(-7.0, 7.0), st.floats(0.5, 9.0), st.floats(0.5, 3.0))


def polygon(box: Box, smaller_m: float = 0.0) -> Polygon:
    x, y, heading, half_length, half_width = box
    half_length, half_width = half_length - smaller_m, half_width - smaller_m
    forward = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-forward[1], forward[0]])
    centre = np.array([x, y])
    signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    return Polygon([centre + a * half_length * forward + b * half_width * left for a, b in signs])


def overlaps(a: Box, b: Box) -> bool:
    rows = np.array([a, b])
    found = overlap(rows[:, :2], rows[:, 2], rows[:, 3:], np.array([0]), np.array([1]))
    return bool(found[0])


@given(a=boxes, b=boxes)
def test_boxes_overlap_as_polygons_intersect(a: Box, b: Box) -> None:
    """Exact up to the tolerance: what overlaps intersects, what does not is disjoint when made smaller."""
    assert overlaps(a, b) == overlaps(b, a)
    if overlaps(a, b):
        assert polygon(a).intersects(polygon(b))
    else:
        assert not polygon(a, 1.01 * TOLERANCE_M).intersects(polygon(b, 1.01 * TOLERANCE_M))


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ((4.0, 0.0, 0.0, 2.0, 1.0), False),  # bumper to bumper
        ((3.98, 0.0, 0.0, 2.0, 1.0), True),
        ((0.0, 2.0, 0.0, 2.0, 1.0), False),  # side by side
        ((0.0, 1.98, 0.0, 2.0, 1.0), True),
        ((2.7, 1.7, 0.785398, 2.0, 1.0), True),  # corner into the side
        ((3.2, 2.2, 0.785398, 1.0, 1.0), False),  # near the corner only: circles would overlap
        ((0.0, 0.0, 1.57, 0.5, 0.5), True),  # one inside the other
    ],
)
def test_cases_made_by_hand(other: Box, expected: bool) -> None:
    assert overlaps((0.0, 0.0, 0.0, 2.0, 1.0), other) is expected


@given(
    st.lists(st.tuples(st.floats(-60, 60), st.floats(-60, 60), st.floats(1, 10)), min_size=1, max_size=30),
    st.randoms(use_true_random=False),
)
def test_near_pairs_are_all_whose_circles_overlap_each_once(rows, random) -> None:
    x_m, y_m, reach_m = np.array(rows).T
    subjects = np.array(sorted(random.sample(range(len(rows)), random.randint(0, len(rows)))), np.int64)
    one, other = near_pairs(x_m, y_m, reach_m, subjects)
    found = [tuple(sorted(pair)) for pair in zip(one.tolist(), other.tolist(), strict=True)]
    assert len(found) == len(set(found))
    expected = {
        (i, j)
        for i in range(len(rows))
        for j in range(i + 1, len(rows))
        if {i, j} & set(subjects.tolist())
        and np.hypot(x_m[i] - x_m[j], y_m[i] - y_m[j]) < reach_m[i] + reach_m[j]
    }
    assert set(found) == expected


@settings(deadline=None)  # the first call compiles
@given(
    st.lists(boxes, min_size=1, max_size=40),
    st.randoms(use_true_random=False),
    st.booleans(),
)
def test_the_compiled_sweep_finds_the_pairs_that_the_readable_columns_find(rows, random, upright) -> None:
    x_m, y_m, heading_rad, half_length_m, half_width_m = np.array(rows).T.copy()
    x_m, y_m = (x_m, 4.0 * y_m) if upright else (4.0 * x_m, y_m)
    bodies = Boxes(x_m, y_m, heading_rad, 2.0 * half_length_m, 2.0 * half_width_m)
    subjects = np.array(sorted(random.sample(range(len(rows)), random.randint(0, len(rows)))), np.int64)
    centre_m, headings, half_m = bodies.placed()
    one, other = near_pairs(centre_m[:, 0], centre_m[:, 1], np.hypot(*half_m.T), subjects)
    expected = np.sort(np.stack([one, other], axis=1)[overlap(centre_m, headings, half_m, one, other)])
    assert touching(bodies, subjects).tolist() == sorted(expected.tolist())


def two(gap_m: float, *reported: Collision, speeds_mps: tuple[float, float] = (5.0, 9.0)) -> object:
    """``a`` ahead of ``b`` by a gap, bumper to bumper, both heading east."""
    return make_snapshot(
        "a",
        "b",
        front_x_m=np.array([100.0, 95.5 - gap_m]),
        front_y_m=np.zeros(2),
        heading_rad=np.zeros(2),
        speed_mps=np.array(speeds_mps),
        collisions=reported,
    )


def test_who_moves_towards_the_other_collides_and_keeps_that_role() -> None:
    contacts = Contacts(("lane",))
    assert contacts.merged(two(0.5), ("a",)) == ()
    (first,) = contacts.merged(two(-0.5), ("a",))
    assert (first.collider, first.victim, first.kind, first.lane_id) == ("b", "a", OVERLAP, "lane")
    (second,) = contacts.merged(two(-0.6, speeds_mps=(0.0, -3.0)), ("a",))
    assert (second.collider, second.victim) == ("b", "a")
    (engines,) = contacts.merged(two(-0.6, Collision("a", "b", "frontal", "lane", 1.0)), ("a",))
    assert (engines.collider, engines.victim, engines.kind) == ("b", "a", "frontal")


def test_a_road_that_leads_over_another_is_no_contact() -> None:
    """Lanes without a junction in common cross on the map only; off the road anything may be touched."""
    j1, j2, j3, j4 = (frozenset({name}) for name in ("1", "2", "3", "4"))
    apart = Contacts(("over", "under"), (j1 | j2, j3 | j4))
    joined = Contacts(("in", "out"), (j1 | j2, j2 | j3))
    on_two_lanes = replace(two(-0.5), lane=np.array([0, 1]))
    assert apart.merged(on_two_lanes, ("a",)) == ()
    assert len(joined.merged(on_two_lanes, ("a",))) == 1
    assert len(apart.merged(replace(on_two_lanes, lane=np.array([-1, 1])), ("a",))) == 1


def test_a_car_that_the_engine_turns_too_far_counts_as_it_would_stand() -> None:
    """SUMO's car that changes lanes at a standstill is turned by 37°: its tail reaches into the next lane."""
    askew = make_snapshot(
        "bound",
        "native",
        front_x_m=np.array([102.0, 104.0]),
        front_y_m=np.array([0.0, -2.9]),
        heading_rad=np.array([0.0, -0.65]),
    )
    assert len(Contacts(("lane",)).merged(askew, ("bound",))) == 1
    judged = Contacts(("lane",), road=StraightRoad())
    assert judged.merged(askew, ("bound",)) == ()
    assert len(judged.merged(askew, ("bound", "native"))) == 1  # a bound car stands as its model says
    nearer = replace(askew, front_y_m=np.array([0.0, -2.2]))
    assert len(judged.merged(nearer, ("bound",))) == 1


def test_what_the_engine_reports_comes_once_and_others_contacts_stay() -> None:
    reported = (Collision("b", "a", "collision", "lane", 95.0), Collision("a", "b", "junction", "lane", 95.0))
    contacts = Contacts(("lane",))
    assert contacts.merged(two(-0.5, *reported), ("a", "b")) == reported[:1]
    assert contacts.merged(two(-0.5), ()) == ()  # two vehicles of the engine's own: its business
    elsewhere = Collision("y", "z", "collision", "lane", 3.0)
    assert contacts.merged(two(0.5, elsewhere), ("a",)) == (elsewhere,)


def test_a_car_driven_sideways_into_another_touches_it_in_sumo(sumo: NewWorld) -> None:
    """Two lanes: SUMO reports nothing; the contact is one, from the step in which the sides meet."""
    world = sumo(car("ego", 300, 10, kind="xgv"), car("beside", 300, 10, lane=1, kind="xgv"))
    world.start()
    snapshot = world.step(nobody())
    for name in ("ego", "beside"):
        world.bind(name, CouplingKind.FREE)
    touched_at_m, contacts = None, set()
    for step in range(38):  # until the fronts are in the same lane, where SUMO sees it too
        both = [ahead(snapshot, name, 10.0, 0.1) for name in ("ego", "beside")]
        row = snapshot.index_of["ego"]
        heading = float(snapshot.heading_rad[row])
        both[0] = place(
            "ego",
            float(both[0].front_x_m[0] - 0.04 * np.sin(heading)),
            float(both[0].front_y_m[0] + 0.04 * np.cos(heading)),
            heading,
            speed_mps=10.0,
            travelled_m=1.0,
        )
        placement = type(both[0])(
            both[0].ids + both[1].ids,
            *(np.concatenate(pair) for pair in zip(both[0][1:], both[1][1:], strict=True)),
        )
        snapshot = world.step(placement)
        assert len(snapshot.collisions) <= 1
        contacts |= {(contact.collider, contact.victim, contact.kind) for contact in snapshot.collisions}
        if contacts and touched_at_m is None:
            touched_at_m = 0.04 * (step + 1)
    assert touched_at_m == pytest.approx(3.2 - 1.8, abs=0.06)
    assert len(contacts) == 1
    assert next(iter(contacts))[2] == OVERLAP


def test_ordinary_traffic_has_no_contacts(sumo: NewWorld) -> None:
    vehicles = [car(f"c{n}", 30 + 25 * n, 10, lane=n % 2, kind="xgv") for n in range(12)]
    world = sumo(*vehicles)
    world.start()
    snapshot = world.step(nobody())
    for name in snapshot.ids:
        world.bind(name, CouplingKind.FREE)
        world.release(name)
    world.bind("c3", CouplingKind.FREE)
    for _ in range(100):
        snapshot = world.step(ahead(snapshot, "c3", 8.0, 0.1))
        assert snapshot.collisions == ()


@pytest.mark.parametrize("seed", range(4))
def test_whoever_is_looked_at_seldom_is_never_missed(seed: int) -> None:
    """Random traffic at up to 60 m/s, cars that come and go: the same contacts as when all are looked at."""
    draw = np.random.default_rng(seed)
    names = tuple(f"v{number}" for number in range(40))
    x_m, y_m = draw.uniform(0.0, 400.0, 40), draw.uniform(0.0, 30.0, 40)
    heading_rad, speed_mps = draw.uniform(-np.pi, np.pi, 40), draw.uniform(0.0, 60.0, 40)
    contacts, found = Contacts(("lane",)), 0
    for step in range(300):
        there = (np.arange(40) + step // 40) % 7 > 0
        x_m += 0.1 * speed_mps * np.cos(heading_rad)
        y_m += 0.1 * speed_mps * np.sin(heading_rad)
        heading_rad = np.where((x_m < 0.0) | (x_m > 400.0), np.pi - heading_rad, heading_rad)
        heading_rad = np.where((y_m < 0.0) | (y_m > 30.0), -heading_rad, heading_rad)
        x_m, y_m = np.clip(x_m, 0.0, 400.0), np.clip(y_m, 0.0, 30.0)
        here = np.flatnonzero(there)
        columns = {"front_x_m": x_m, "front_y_m": y_m, "heading_rad": heading_rad, "speed_mps": speed_mps}
        sizes = {"length_m": np.full(40, 4.5), "width_m": np.full(40, 1.8)}
        ids = tuple(names[number] for number in here)
        snapshot = make_snapshot(
            *ids, time_s=round(0.1 * step, 3), **{name: c[here] for name, c in (columns | sizes).items()}
        )
        bound = [name for name in ("v1", "v2", "v3") if name in ids]
        subjects = np.sort(snapshot.rows_of(bound))
        watched = set(contacts._touching(snapshot, subjects))
        centre_m, headings, half_m = boxes_of(snapshot, np.arange(len(ids))).placed()
        one, other = near_pairs(centre_m[:, 0], centre_m[:, 1], np.hypot(*half_m.T), subjects)
        overlapping = overlap(centre_m, headings, half_m, one, other)
        everybody = set(zip(one[overlapping].tolist(), other[overlapping].tolist(), strict=True))
        assert {frozenset(pair) for pair in watched} == {frozenset(pair) for pair in everybody}
        found += len(watched)
    assert found > 20
