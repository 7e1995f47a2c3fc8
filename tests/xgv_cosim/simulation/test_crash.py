"""After a contact on real SUMO traffic: who stays, what goes on, when the run ends, what is measured."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.simulation.conftest import Opener
from xgv_cosim.metrics import Watch
from xgv_cosim.runs.running import run_scenario
from xgv_cosim.scenario.loading import load_scenario, override
from xgv_cosim.worlds.sumo.libraries import load_libsumo

if TYPE_CHECKING:
    from xgv_cosim.events import Event


def blind(vehicle_id: str, speed_mps: float = 16.0) -> None:
    """Let one of SUMO's drivers drive on whatever is ahead."""
    vehicle = load_libsumo().vehicle
    vehicle.setSpeedMode(vehicle_id, 0)
    vehicle.setLaneChangeMode(vehicle_id, 0)
    vehicle.setSpeed(vehicle_id, speed_mps)


def events(simulation: xgv_cosim.Simulation, *kinds: str) -> list[Event]:
    return [event for event in simulation.state.journal.events if event.kind in kinds]


def until_contact(simulation: xgv_cosim.Simulation) -> None:
    """``xgv_0`` makes an emergency stop; ``car_0`` behind it does not see that."""
    simulation.run_until(5.0)
    simulation.vehicle("xgv_0").estop("stop")
    simulation.step()
    blind("car_0")
    for _ in range(100):
        simulation.step()
        if simulation.snapshot.collisions:
            return
    raise AssertionError("they never touch")


def place_of(simulation: xgv_cosim.Simulation, name: str) -> tuple[float, float, float]:
    row, now = simulation.snapshot.index_of[name], simulation.snapshot
    return float(now.front_x_m[row]), float(now.front_y_m[row]), float(now.heading_rad[row])


def test_both_stay_where_they_touched_and_the_computer_goes_on(open_hello: Opener) -> None:
    """Issue 3.2: speed 0 at once; modes, reports and messages as ever; also after the driver has it."""
    simulation = open_hello()
    until_contact(simulation)
    (first, second) = events(simulation, "crashed")
    assert {(first.vehicle, first.after), (second.vehicle, second.after)} == {
        ("xgv_0", "car_0"),
        ("car_0", "xgv_0"),
    }
    assert first.t_s == second.t_s == simulation.now_s
    car = simulation.vehicle("xgv_0")
    assert car.speed_mps == 0.0
    at = {name: place_of(simulation, name) for name in ("xgv_0", "car_0")}
    contact_s = simulation.now_s
    simulation.run_until(contact_s + 2.0)
    assert car.mode == "estop_disable"
    car.estop("run")
    simulation.run_until(contact_s + 8.0)
    assert car.mode == "drive_by_wire"  # its computer goes on, and would drive
    car.override()
    simulation.run_until(contact_s + 14.0)
    assert car.mode == "manual_override"  # nor does the driver move it
    for name, place in at.items():
        assert place_of(simulation, name) == pytest.approx(place, abs=1e-9)
        assert simulation.snapshot.speed_mps[simulation.snapshot.index_of[name]] == 0.0
    assert car.speed_mps == car.accel_mps2 == 0.0
    assert len(events(simulation, "crashed")) == 2
    assert len(events(simulation, "collision")) == 1


def test_a_crashed_vehicle_that_is_released_stays_too(open_hello: Opener) -> None:
    simulation = open_hello()
    until_contact(simulation)
    place = place_of(simulation, "xgv_0")
    simulation.release("xgv_0")
    simulation.run_until(simulation.now_s + 5.0)
    assert "xgv_0" not in simulation.vehicle_ids
    assert place_of(simulation, "xgv_0") == pytest.approx(place, abs=1e-9)


def test_those_behind_stop_behind_the_wreck(open_hello: Opener) -> None:
    simulation = open_hello()
    until_contact(simulation)
    load_libsumo().vehicle.changeLane("xgv_1", 0, 1.0)
    simulation.run_until(simulation.now_s + 20.0)
    assert len(simulation.snapshot.collisions) == 1
    assert {event.vehicle for event in events(simulation, "crashed")} == {"xgv_0", "car_0"}


def test_pass_lets_them_drive_on_through_each_other(open_hello: Opener) -> None:
    simulation = open_hello("world.contact=pass")
    until_contact(simulation)
    simulation.run_until(simulation.now_s + 10.0)
    now = simulation.snapshot
    assert events(simulation, "crashed") == []
    assert now.speed_mps[now.index_of["car_0"]] > 10.0


def test_the_gap_of_the_two_ends_with_the_contact() -> None:
    """No gap below 0, and what the pair does afterwards is not measured."""
    watch = Watch(("xgv_0",))
    chosen = ["injections=[]", "expect=[]", "world.contact=pass"]
    with xgv_cosim.simulate("hello", set=chosen, observers=(watch,)) as simulation:
        until_contact(simulation)
        contact_s = simulation.now_s
        simulation.run_until(contact_s + 3.0)
    lows = watch.gap_lows["xgv_0"]
    assert lows.behind_m.min() == 0.0
    assert lows.t_s[lows.behind_m == 0.0][0] == pytest.approx(contact_s)
    series = watch.series()["xgv_0"]
    after = series.t_s > contact_s + 1e-6
    assert (series.follower_gap_m[~after] >= 0.0).all()
    assert np.isinf(series.follower_gap_m[after][0])


def test_end_ends_the_run_with_the_contact(tmp_path: Path) -> None:
    """``world.contact: end``: the run's outcome says so, and what had to hold later was not reached."""
    scenario = override(
        load_scenario("hello"),
        [
            "world.contact=end",
            "expect=[{no_collision: true, always: true}, {vehicle: xgv_0, standstill: true, by_s: 19}]",
            "injections=[{at_s: 5, vehicles: xgv_0, kind: estop_disable}]",
        ],
    )
    result = run_scenario(
        scenario, tmp_path / "run", progress=lambda now_s, _: blind("car_0") if 5.0 < now_s < 5.2 else None
    )
    data = json.loads((tmp_path / "run" / "result.json").read_text())
    (contact,) = data["collisions"]
    who, when = f"{contact['collider']} and {contact['victim']}", f"{contact['t_s']:g} s"
    assert data["ended_by"] == f"contact of {who} at {when}"
    assert data["simulated_s"] == pytest.approx(contact["t_s"]) != data["duration_s"]
    assert [row["status"] for row in result.data["expectations"]] == ["failed", "not_reached"]
    assert not any(row["exercised"] for row in data["assumptions"] if row["rule"] == "contact")
