"""The reference stack on networks that nobody here made: a motorway, a town, a quarter of the cars bound."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
import sumo
import sumo_rl

from xgv_cosim import simulate
from xgv_cosim.simulation import Simulation
from xgv_cosim.snapshot import Snapshot

A10KW = Path(sumo.__file__).parent / "tools" / "game" / "A10KW.sumocfg"
COLOGNE8 = Path(sumo_rl.__file__).parent / "nets" / "RESCO" / "cologne8" / "cologne8.sumocfg"
COMMAND = [sys.executable, "-c", "from xgv_cosim.cli import main; main()"]
NARROWER_THAN_ITS_CIRCLE = frozenset({"135663_411_0", "146391_416_0"})
"""Cars of cologne8 whose route turns round within a street of two lanes: no car can without reversing."""


class Watch:
    """What must not happen, collected over a run."""

    def __init__(self, run: Simulation) -> None:
        self._run = run
        self.off_road: Counter[str] = Counter()
        """Steps that each car was off the road."""
        self.ran_red: set[str] = set()
        self.contacts: set[tuple[str, str]] = set()
        self.bound: set[str] = set()
        self.routes: dict[str, tuple[str, ...]] = {}
        """Of each bound car the route with which it was bound."""
        self.lost_ways: set[str] = set()
        self.last_edges: dict[str, str] = {}
        """Where each bound car was last, junctions apart."""
        self.vanished: set[str] = set()
        self._there: set[str] = set()
        """Who was bound after the step before."""
        self.teleported: set[str] = set()
        self._waits: dict[str, tuple[str, str]] = {}
        """Of each car before a signal its lane and the signal's colour."""

    def look(self, snapshot: Snapshot) -> None:
        self.vanished |= self._there - set(snapshot.ids) - set(snapshot.arrived)
        self._there = set(self._run.vehicle_ids)
        names = [name for name in self._run.vehicle_ids if name in snapshot.index_of]
        self.bound.update(names)
        self.teleported.update(snapshot.teleported)
        around, road = self._run.world.surroundings(names), self._run.world.road
        for name in names:
            route = self._run.world.traveller(name).edges
            whole = self.routes.setdefault(name, route)
            lane = int(snapshot.lane[snapshot.index_of[name]])
            if lane >= 0 and not road.edge_ids[lane].startswith(":"):
                self.last_edges[name] = road.edge_ids[lane]
            # SUMO may drop edges that lie behind, no others
            if route != whole[-len(route) :] or (route != whole and self.last_edges[name] not in route):
                self.lost_ways.add(name)
        for name, signal in zip(names, around.signals, strict=True):
            lane = int(snapshot.lane[snapshot.index_of[name]])
            if lane < 0:
                self.off_road[name] += 1
                continue
            lane_id = road.lane_ids[lane]
            waited_on, colour = self._waits.pop(name, ("", ""))
            if colour == "red" and waited_on != lane_id and lane_id.startswith(":"):
                self.ran_red.add(name)
            if signal is not None and signal.line_m < 10.0 and not lane_id.startswith(":"):
                self._waits[name] = lane_id, signal.colour
        self.contacts.update((contact.collider, contact.victim) for contact in snapshot.collisions)

    def assert_nobody_is_lost(self) -> None:
        """No bound car has vanished, lost its way or been teleported; whoever is gone has arrived."""
        assert self.vanished == set()
        assert self.lost_ways == set()
        assert self.teleported & self.bound == set()
        gone = [event for event in self._run.state.journal.events if event.kind == "released"]
        assert {event.reasons for event in gone} == {("arrived",)}
        ends = {event.vehicle: self.last_edges[event.vehicle] for event in gone}
        assert ends == {name: self.routes[name][-1] for name in ends}


def watched(config: Path, seconds: float) -> tuple[Watch, Simulation]:
    with simulate(config, bind=["share=0.25"], set=[f"duration_s={seconds}"]) as run:
        watch = Watch(run)
        while run.now_s < seconds:
            watch.look(run.step())
        return watch, run


@pytest.mark.slow
def test_300_seconds_of_a_motorway_and_its_ramps() -> None:
    watch, run = watched(A10KW, 300.0)
    assert len(watch.bound) > 200
    # Two ramps cross on an edge of 7.8 m: who has to change lanes there leaves its end aslant for 0.3 s.
    assert max(watch.off_road.values(), default=0) <= 5
    assert watch.ran_red == set()
    watch.assert_nobody_is_lost()
    assert len(run.state.released) > 50
    assert len([pair for pair in watch.contacts if set(pair) & watch.bound]) <= 2


@pytest.mark.slow
def test_300_seconds_of_a_town() -> None:
    watch, run = watched(COLOGNE8, 300.0)
    assert len(watch.bound) > 30
    assert {name for name, steps in watch.off_road.items() if steps > 5} <= NARROWER_THAN_ITS_CIRCLE
    assert watch.ran_red == set()
    watch.assert_nobody_is_lost()
    assert len(run.state.released) > 15
    touched = [pair for pair in watch.contacts if set(pair) & (watch.bound - NARROWER_THAN_ITS_CIRCLE)]
    assert len(touched) <= 1


@pytest.mark.slow
def test_the_town_from_the_command_line(tmp_path: Path) -> None:
    """No scenario file; the times count from 25200 s, and every contact stands in the result."""
    folder = tmp_path / "run"
    arguments = [
        "--bind",
        "share=0.25",
        "--inject",
        "*@31.5 estop_pause duration_s=5",
        "--set",
        "duration_s=300",
    ]
    ran = subprocess.run(
        [*COMMAND, "run", str(COLOGNE8), *arguments, "--out", str(folder), "--quiet"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    result = json.loads((folder / "result.json").read_text())
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    paused = [event for event in events if event["kind"] == "injection" and event["to"] == "estop_pause"]
    assert len(paused) >= 5
    assert {event["t_s"] for event in paused} == {31.5}
    told = {frozenset((event["vehicle"], event["to"])) for event in events if event["kind"] == "collision"}
    assert {frozenset((row["collider"], row["victim"])) for row in result["collisions"]} == told
    assert [row for row in result["teleports"] if row["bound"]] == []
