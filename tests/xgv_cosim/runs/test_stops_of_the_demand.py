"""SUMO's ``<stop>``s of bound vehicles: nobody keeps them, and everybody is told."""

from __future__ import annotations

import json
from pathlib import Path

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.events import Event
from xgv_cosim.recording import EVENTS, TRAJECTORY, read_trajectory
from xgv_cosim.runs.warnings import warnings_of
from xgv_cosim.scenario.loading import load_scenario

STOPS = '<stop lane="road_0" endPos="300" duration="5"/><stop lane="road_0" endPos="900" duration="5"/>'
TOLD = ["stop on lane road_0 at 300.0 m", "stop on lane road_0 at 900.0 m"]


def test_stops_of_a_bound_vehicle_are_told_once_and_not_kept(tmp_path: Path) -> None:
    vehicles = car("bus", 200, 12, extra=STOPS) + car("taxi", 150, 12, lane=1)
    vehicles += car("other", 250, 12, extra='<stop lane="road_0" endPos="500" duration="5"/>')
    config = write_config(tmp_path, vehicles, network("hello"))
    out = tmp_path / "out"
    result = xgv_cosim.run(config, bind=["bus,taxi"], set=["duration_s=12"], out=out, report=False)
    rows = [json.loads(line) for line in (out / EVENTS).read_text().splitlines()]
    told = [(row["vehicle"], row["reasons"]) for row in rows if row["kind"] == "stops_ignored"]
    assert told == [("bus", TOLD)]
    line = "bus: the computer does not keep the stops that SUMO's demand has for it"
    assert result.data["warnings"] == [f"{line} ({'; '.join(TOLD)})"]
    track = read_trajectory(out / TRAJECTORY)
    assert track["measured_speed"][track.rows_of["bus"]][5:].min() > 5.0


def test_a_vehicle_that_is_bound_twice_is_warned_of_once() -> None:
    events = [Event(0.0, "a", "bound")]
    events += [Event(t_s, "a", "stops_ignored", reasons=(f"stop at bs_{t_s:g}",)) for t_s in (0.0, 9.0)]
    events.append(Event(9.0, "b", "stops_ignored", reasons=("stop at bs_9",)))
    told = [line.partition(":")[0] for line in warnings_of(load_scenario("hello"), events)]
    assert told == ["a", "b"]
