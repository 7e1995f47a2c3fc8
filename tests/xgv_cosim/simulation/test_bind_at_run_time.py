"""Bind and release while the simulation runs, from Python and from a scenario, in real SUMO traffic."""

from __future__ import annotations

import random

import numpy as np
import pytest

import xgv_cosim
from xgv_cosim.errors import ScenarioError, UnknownVehicleError
from xgv_cosim.scenario.building import ScenarioSimulation
from xgv_cosim.simulation.exchange import front_distance_m

NOBODY = ["bind=[]", "injections=[]", "expect=[]"]


def kinds(run: ScenarioSimulation, name: str, *wanted: str) -> list[tuple[float, str]]:
    return [(e.t_s, e.kind) for e in run.state.journal.events if e.vehicle == name and e.kind in wanted]


def assert_each_row_is_its_vehicle(run: ScenarioSimulation) -> None:
    """Every bound id has one slot, and the slot's front bumper is where SUMO has that vehicle."""
    fleet, snapshot = run.fleet, run.snapshot
    assert [name for name in fleet.ids if name is not None] == list(run.vehicle_ids)
    assert {vehicle.vehicle_id: vehicle.slot for vehicle in run.state.vehicles} == {
        name: slot for slot, name in fleet
    }
    motion = fleet.motion
    x_m = motion.x_m + front_distance_m(fleet.parameters) * np.cos(motion.heading_rad)
    y_m = motion.y_m + front_distance_m(fleet.parameters) * np.sin(motion.heading_rad)
    for slot, name in fleet:
        row = snapshot.index_of[name]
        assert x_m[slot] == pytest.approx(snapshot.front_x_m[row], abs=0.06), name
        assert y_m[slot] == pytest.approx(snapshot.front_y_m[row], abs=0.06), name


def test_bind_release_and_bind_again_while_it_moves() -> None:
    with xgv_cosim.simulate("hello", set=NOBODY) as run:
        run.run_until(3.0)
        assert run.bind("xgv_0", driver="none", coupling="lane") == ("xgv_0",)
        run.run_until(6.0)
        assert run.vehicle("xgv_0").mode == "drive_by_wire"
        run.release("xgv_0")
        assert run.vehicle_ids == ()
        driven_m = run.snapshot.front_x_m[run.snapshot.index_of["xgv_0"]]
        run.run_until(8.0)
        assert run.snapshot.front_x_m[run.snapshot.index_of["xgv_0"]] > driven_m + 15.0
        assert run.bind("*") == ("car_0", "xgv_0", "xgv_1")
        run.run_until(10.0)
        assert {run.vehicle(name).mode for name in run.vehicle_ids} == {"drive_by_wire"}
        assert_each_row_is_its_vehicle(run)
    assert kinds(run, "xgv_0", "bound", "released") == [(3.0, "bound"), (6.0, "released"), (8.0, "bound")]


def test_ids_and_slots_are_never_confused() -> None:
    """40 random acts on 24 cars; slots are reused, so a mixed-up row would stand a long way off."""
    rng = random.Random(3)
    with xgv_cosim.simulate("freeway_estop", set=NOBODY) as run:
        run.run_until(1.0)
        names = [f"xgv_{number}" for number in range(24)]
        for _ in range(40):
            chosen = rng.sample(names, rng.randint(1, 6))
            bound = [name for name in chosen if name in run.vehicle_ids]
            for name in bound:
                run.release(name)
            free = [name for name in chosen if name not in bound]
            if free:
                assert run.bind(*free) == tuple(free)
            run.step()
            assert_each_row_is_its_vehicle(run)
        assert run.fleet.num_slots <= 32  # capacity doubles only when none is free
        assert len(run.snapshot.collisions) == 0


def test_a_scenario_binds_from_a_time_until_a_time() -> None:
    rows = ["bind.0.from_s=2.05", "bind.0.until_s=4", "injections=[]", "expect=[]"]
    with xgv_cosim.simulate("hello", set=rows) as run:
        run.run_until(2.0)
        assert run.vehicle_ids == ()
        run.run_until(2.1)
        assert run.vehicle_ids == ("xgv_0", "xgv_1")
        run.run_until(4.0)
        assert run.vehicle_ids == ()
        run.run_until(6.0)
    assert kinds(run, "xgv_0", "bound", "released") == [(2.1, "bound"), (4.0, "released")]


def test_vehicles_are_chosen_by_their_route_and_by_an_edge_that_it_passes() -> None:
    rows = ["bind.0.vehicles={route: from_e6}", "injections=[]", "expect=[]"]
    with xgv_cosim.simulate("freeway_estop", set=rows) as run:
        run.step()
        assert run.vehicle_ids == ()  # nobody starts so far on
        assert run.bind("xgv_23") == ("xgv_23",)
    rows = ["bind.0.vehicles={route: 'from_e[45]', via: e5, type: xgv}", "injections=[]", "expect=[]"]
    with xgv_cosim.simulate("freeway_estop", set=rows) as run:
        run.step()
        lanes = [run.world.road.lane_ids[lane] for lane in run.snapshot.lane.tolist()]
        later = {
            name
            for name, lane in zip(run.snapshot.ids, lanes, strict=True)
            if name.startswith("xgv") and lane[:2] in {"e4", "e5"}
        }
        assert later
        assert set(run.vehicle_ids) == later


def test_who_departs_after_the_end_is_not_bound() -> None:
    rows = ["bind.0.vehicles=inflow_*", "bind.0.until_s=1.5", "injections=[]", "expect=[]"]
    with xgv_cosim.simulate("freeway_estop", set=rows) as run:
        run.run_until(8.0)
        assert any(name.startswith("inflow_") for name in run.snapshot.ids)
        assert run.vehicle_ids == ()


def test_what_cannot_be_bound_says_why() -> None:
    with xgv_cosim.simulate("hello") as run:
        run.run_until(1.0)
        with pytest.raises(ScenarioError, match="the world has no vehicle 'nobody' at 1 s; bind it later"):
            run.bind("nobody")
        with pytest.raises(ScenarioError, match="'xgv_0' is bound already; release it first"):
            run.bind("xgv_0")
        with pytest.raises(ScenarioError, match=r"no unbound vehicle matches bus_\* at 1 s"):
            run.bind("bus_*")
        with pytest.raises(ScenarioError) as raised:
            run.bind("car_0", couplng="lane")
        assert raised.value.problems == ("bind.0.couplng: unknown key (did you mean 'coupling'?)",)
        with pytest.raises(UnknownVehicleError, match="no bound vehicle 'car_0'"):
            run.release("car_0")
        run.run_until(2.0)  # and the run goes on as before
        assert run.vehicle_ids == ("xgv_0", "xgv_1")


def test_an_end_that_lies_before_the_begin_is_a_mistake() -> None:
    with pytest.raises(ScenarioError) as raised:
        xgv_cosim.simulate("hello", set=["bind.0.from_s=5", "bind.0.until_s=5"])
    assert "until_s 5 is not after from_s 5" in raised.value.problems[0]
