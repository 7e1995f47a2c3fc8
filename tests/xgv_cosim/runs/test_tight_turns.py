"""Routes that turn more tightly than the car: told once for each binding, and in one line of the result."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.events import Event
from xgv_cosim.recording import EVENTS
from xgv_cosim.runs.warnings import warnings_of
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.worlds.sumo.turns import tightest_radius_m


def test_turning_round_is_told_of_the_route_that_lies_ahead(tmp_path: Path) -> None:
    """The car turns round at the end of a road, and right and left at a crossing that is wide enough."""
    places = {"w": (0, 0), "m": (150, 0), "e": (300, 0), "n": (150, 150)}
    nodes = "".join(f'<node id="{name}" x="{x}" y="{y}" radius="12"/>' for name, (x, y) in places.items())
    ways = ("wm", "mw", "me", "em", "mn", "nm")
    edges = "".join(f'<edge id="{way}" from="{way[0]}" to="{way[1]}" numLanes="1"/>' for way in ways)
    net = plain_network(tmp_path, nodes, edges, no_turnarounds=False)
    vehicles = car("round", 100, 0, route="wm me em mw") + car("turns", 60, 0, route="wm mn")
    vehicles += car("back", 10, 0, route="em mn nm mw")
    out = tmp_path / "out"
    rows = ["duration_s=1", "bind=[{vehicles: ['*']}]"]
    result = xgv_cosim.run(write_config(tmp_path, vehicles, net), set=rows, out=out, report=False)
    events = [json.loads(line) for line in (out / EVENTS).read_text().splitlines()]
    told = {row["vehicle"]: row for row in events if row["kind"] == "turns_too_tight"}
    assert set(told) == {"round", "back"}
    (where,) = told["round"]["reasons"]
    assert where.startswith("from me to em on lane :e_")
    assert 0.5 < float(where.split()[-2]) < 4.0
    assert told["back"]["reasons"][0].startswith("from mn to nm on lane :n_")
    assert told["back"]["to"] == "4.2 m"
    (line,) = [line for line in result.data["warnings"] if "turns on" in line]
    assert line.startswith("back, round: the route turns on less than the 4.2 m that the rear axle needs")
    assert where in line


def test_who_is_bound_on_his_way_is_told_of_what_is_ahead_only(tmp_path: Path) -> None:
    nodes = '<node id="w" x="0" y="0"/><node id="e" x="60" y="0"/>'
    edges = '<edge id="we" from="w" to="e"/><edge id="ew" from="e" to="w"/>'
    net = plain_network(tmp_path, nodes, edges, no_turnarounds=False)
    config = write_config(tmp_path, car("ego", 40, 5, route="we ew"), net)
    with xgv_cosim.simulate(config, set=["duration_s=60"]) as run:
        run.run_until(1.0)
        run.bind("ego", driver="world", stack="none")
        while run.world.road.edge_ids[int(run.snapshot.lane[0])] != "ew":
            run.step()
        run.release("ego")
        run.bind("ego")
        told = [event.t_s for event in run.state.journal.events if event.kind == "turns_too_tight"]
    assert told == [1.0]


@pytest.mark.parametrize("radius_m", [1.6, 4.0, 12.0])
@pytest.mark.parametrize("turned_rad", [1.2, 0.5 * np.pi, np.pi])
def test_the_radius_of_a_drawn_circle_is_found(radius_m: float, turned_rad: float) -> None:
    at_rad = np.linspace(0.0, turned_rad, 9)
    circle = radius_m * np.stack([np.sin(at_rad), 1.0 - np.cos(at_rad)], axis=1)
    onward = circle[-1] + 30.0 * np.array([np.cos(turned_rad), np.sin(turned_rad)])
    line = np.concatenate([[[-20.0, 0.0]], circle, [onward]])
    assert tightest_radius_m(line) == pytest.approx(radius_m, rel=0.01)
    assert tightest_radius_m(line[:2]) == np.inf


def test_many_cars_and_turns_make_one_line() -> None:
    events = [Event(1.0, "a", "bound")]
    for number in range(9):
        turns = (f"from a to b{number} on lane :n_0: 1.6 m", "from x to y on lane :n_1: 2.0 m")
        events.append(Event(1.0, f"car_{number}", "turns_too_tight", "", "4.2 m", turns))
    (line,) = [line for line in warnings_of(load_scenario("hello"), events) if "turns on" in line]
    assert line.startswith("car_0, car_1, car_2, car_3, car_4, and 4 more: the route turns on less than")
    assert line.count("from x to y") == 1
    assert line.endswith("from a to b3 on lane :n_0: 1.6 m; and 5 more)")
