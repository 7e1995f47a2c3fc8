from __future__ import annotations

import json
from pathlib import Path

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
        Event(11.0, "c", "teleport", "", "", ("off the road, 0.0 m/s",)),
        Event(20.0, "a", "teleport", "", "", ("lane l_1 at 5.0 m, 0.0 m/s",)),
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
    assert (second["vehicle"], second["why"]) == ("c", None)
    assert third["why"] == "waited too long (wrong lane)"


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
    assert row["place"].startswith("lane road_0 at ")
    assert 10.0 <= row["t_s"] < 12.0
