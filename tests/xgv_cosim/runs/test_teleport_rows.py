from __future__ import annotations

import json
from pathlib import Path

import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.events import Event
from xgv_cosim.runs.running import run_scenario
from xgv_cosim.runs.teleports import teleport_rows
from xgv_cosim.scenario.loading import load_scenario, override
from xgv_cosim.worlds.sumo.libraries import load_libsumo

MESSAGES = (
    "Warning: Teleporting vehicle 'b'; waited too long (yield), lane='l_0', time=71.00.",
    "Warning: Vehicle 'a' performs emergency braking on lane 'l_0'.",
    "Warning: Teleporting vehicle 'a'; waited too long (jam), lane='l_0', time=80.00.",
    "Warning: Teleporting vehicle 'a'; waited too long (wrong lane), lane='l_1', time=90.00.",
)


def test_each_teleport_tells_who_where_and_why() -> None:
    events = [
        Event(10.0, "a", "teleport", "bound", "", ("lane l_0 at 3.0 m, 0.0 m/s",)),
        Event(11.0, "c", "teleport", "", "", ("edge k",)),
        Event(20.0, "a", "teleport", "", "", ("edge l",)),
        Event(20.0, "a", "collision"),
    ]
    first, second, third = teleport_rows(events, MESSAGES)
    assert first == {
        "t_s": 10.0,
        "vehicle": "a",
        "bound": True,
        "place": "lane l_0 at 3.0 m, 0.0 m/s",
        "why": "waited too long (jam)",
    }
    assert (second["vehicle"], second["place"], second["why"]) == ("c", "edge k", None)
    assert (third["place"], third["why"]) == ("lane l_1", "waited too long (wrong lane)")


def test_a_run_tells_of_sumos_teleports(tmp_path: Path) -> None:
    """Issue 3.4: a car of SUMO's own that stands too long, in a run with bound ones."""
    scenario = override(
        load_scenario("hello"),
        [
            "injections=[]",
            "expect=[]",
            "bind=[{vehicles: xgv_1}]",
            "duration_s=20",
            "world.sumo.options=[--time-to-teleport, '8']",
        ],
    )

    def stop(now_s: float, _: float) -> None:
        if 2.0 <= now_s < 2.05:
            vehicle = load_libsumo().vehicle
            vehicle.setSpeedMode("xgv_0", 0)
            vehicle.setSpeed("xgv_0", 0.0)

    run_scenario(scenario, tmp_path / "run", progress=stop)
    data = json.loads((tmp_path / "run" / "result.json").read_text())
    (row,) = data["teleports"]
    assert (row["vehicle"], row["bound"], row["why"]) == ("xgv_0", False, "waited too long (jam)")
    assert row["place"] == "lane road_0"
    assert 10.0 <= row["t_s"] < 12.0


@pytest.mark.parametrize("looks", [False, True])
def test_where_a_teleport_began_does_not_depend_on_who_looks(tmp_path: Path, looks: bool) -> None:
    """SUMO's own cars are read only where somebody asks; SUMO has a teleported one on its next edge."""
    places_m = {"w": 0, "m": 200, "e": 400}
    nodes = "".join(f'<node id="{name}" x="{x_m}" y="0"/>' for name, x_m in places_m.items())
    edges = '<edge id="wm" from="w" to="m" numLanes="2"/><edge id="me" from="m" to="e" numLanes="2"/>'
    vehicles = car("ego", 20, 0, route="wm me") + car("own", 60, 0, route="wm me", lane=1)
    vehicles += car("last", 60, 0, route="me")
    config = write_config(tmp_path, vehicles, plain_network(tmp_path, nodes, edges))
    options = "world.sumo.options=[--time-to-teleport, '3']"
    with xgv_cosim.simulate(config, bind=["ego"], set=["duration_s=20", options]) as run:
        vehicle = load_libsumo().vehicle
        while run.now_s < 10.0:
            run.step()
            if looks:
                run.snapshot.read_all()
            if run.now_s == pytest.approx(1.0):
                for name in ("own", "last"):
                    vehicle.setSpeed(name, 0.0)
        told = [event for event in run.state.journal.events if event.kind == "teleport"]
    assert [(event.vehicle, event.reasons) for event in told][:2] == [
        ("own", ("edge wm",)),
        ("last", ("the last edge of its route",)),
    ]
