"""Which vehicles a selector means."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xgv_cosim.scenario.model import BindSection, VehicleQuery
from xgv_cosim.scenario.selection import binding_of, draw, matches
from xgv_cosim.traveller import Traveller

if TYPE_CHECKING:
    import random

FLEET = [Traveller(f"veh_{number}", "xgv" if number % 2 else "car") for number in range(2000)]


def select(selector, vehicles, seed):
    return tuple(who.vehicle_id for who in vehicles if matches(selector, who, seed))


@pytest.mark.parametrize(
    ("selector", "vehicle_id", "type_id", "expected"),
    [
        ("xgv_1", "xgv_1", "t", True),
        ("xgv_1", "xgv_10", "t", False),
        ("xgv_*", "xgv_10", "t", True),
        ("XGV_*", "xgv_10", "t", False),
        ("xgv_?", "xgv_10", "t", False),
        (("a", "b*"), "bc", "t", True),
        (("a", "b*"), "c", "t", False),
        (VehicleQuery(type="xgv"), "a", "xgv", True),
        (VehicleQuery(type="xgv*"), "a", "xgv_red", True),
        (VehicleQuery(type="xgv"), "xgv", "car", False),
        (VehicleQuery(share=1.0), "a", "t", True),
    ],
)
def test_ids_patterns_lists_and_types(selector, vehicle_id, type_id, expected):
    assert matches(selector, Traveller(vehicle_id, type_id), seed=1) is expected


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        (VehicleQuery(route="north"), True),
        (VehicleQuery(route="nor*"), True),
        (VehicleQuery(route="south"), False),
        (VehicleQuery(via="e2"), True),
        (VehicleQuery(via="e"), False),
        (VehicleQuery(via="e9"), False),
        (VehicleQuery(route="north", via="e3", type="car"), True),
        (VehicleQuery(route="north", via="e3", type="bus"), False),
        (VehicleQuery(via="e1", share=1.0), True),
    ],
)
def test_routes_by_name_and_by_an_edge_they_pass(query, expected):
    assert matches(query, Traveller("a", "car", "north", ("e1", "e2", "e3")), seed=1) is expected


@given(share=st.floats(0.02, 1.0), seed=st.integers(0, 2**31 - 1))
@settings(max_examples=30, deadline=None)
def test_a_share_takes_about_that_share(share, seed):
    chosen = select(VehicleQuery(share=share, seed=seed), FLEET, seed=0)
    spread = (share * (1 - share) / len(FLEET)) ** 0.5
    assert abs(len(chosen) / len(FLEET) - share) <= 6 * spread


@given(seed=st.integers(0, 1000), order=st.randoms(use_true_random=False), keep=st.integers(1, 200))
@settings(max_examples=30, deadline=None)
def test_a_share_depends_neither_on_order_nor_on_the_other_vehicles(seed, order: random.Random, keep):
    query = VehicleQuery(share=0.3, seed=seed)
    fleet = FLEET[:200]
    whole = set(select(query, fleet, seed=0))
    some = order.sample(fleet, keep)
    assert set(select(query, some, seed=99)) == whole & {who.vehicle_id for who in some}


@given(seed=st.integers(0, 1000), smaller=st.floats(0.01, 0.5), larger=st.floats(0.5, 1.0))
@settings(max_examples=30, deadline=None)
def test_a_larger_share_only_adds_vehicles(seed, smaller, larger):
    fleet = FLEET[:200]
    few = set(select(VehicleQuery(share=smaller, seed=seed), fleet, seed=0))
    assert few <= set(select(VehicleQuery(share=larger, seed=seed), fleet, seed=0))


def test_a_share_without_seed_follows_the_scenario_and_one_with_seed_does_not():
    free, pinned = VehicleQuery(share=0.3), VehicleQuery(share=0.3, seed=7)
    assert select(free, FLEET, seed=1) != select(free, FLEET, seed=2)
    assert select(free, FLEET, seed=7) == select(pinned, FLEET, seed=1) == select(pinned, FLEET, seed=2)


def test_draws_are_the_same_on_every_machine():
    """Recorded once; a change would silently change every scenario that binds by share."""
    assert draw("veh_0", 1) == pytest.approx(DRAW_VEH_0_SEED_1, abs=0)
    assert draw("veh_0", 1) != draw("veh_0", 2)
    assert draw("veh_0", 1) != draw("veh_1", 1)


def test_type_and_share_must_both_hold():
    chosen = select(VehicleQuery(type="xgv", share=0.5, seed=3), FLEET, seed=0)
    everyone = select(VehicleQuery(share=0.5, seed=3), FLEET, seed=0)
    types = {who.vehicle_id: who.type_id for who in FLEET}
    assert chosen == tuple(name for name in everyone if types[name] == "xgv")


def test_the_first_row_that_matches_counts():
    first = BindSection(vehicles="xgv_0", driver="none")
    second = BindSection(vehicles="xgv_*")
    assert binding_of((first, second), Traveller("xgv_0", "t"), 1) is first
    assert binding_of((first, second), Traveller("xgv_1", "t"), 1) is second
    assert binding_of((first, second), Traveller("car", "t"), 1) is None


DRAW_VEH_0_SEED_1 = 0.5849666581285541
