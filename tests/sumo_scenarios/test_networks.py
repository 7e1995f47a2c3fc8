"""The SUMO input files of the packaged scenarios."""

from __future__ import annotations

import re
import runpy
from collections import Counter
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import nobody
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Iterator

    from xgv_cosim.snapshot import Snapshot

SCENARIOS = Path(str(files("sumo_scenarios")))
INJECTED = {"xgv_2": 45.0, "xgv_6": 60.0, "xgv_10": 70.0, "xgv_14": 85.0, "xgv_18": 100.0}
"""Injected vehicle and the end of its event."""


@pytest.fixture(params=["hello", "freeway_estop"])
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def world(name: str) -> Iterator[SumoWorld]:
    world = SumoWorld.headless(SCENARIOS / name / f"{name}.sumocfg", step_s=0.1, seed=1)
    yield world
    world.close()


def first_step(world: SumoWorld) -> Snapshot:
    world.start()
    return world.step(nobody())


def test_the_network_tells_no_date_and_no_machine(name: str) -> None:
    network = (SCENARIOS / name / f"{name}.net.xml").read_text()
    assert "generated on" not in network
    assert not re.search(r'"/\w', network)


@pytest.mark.parametrize("name", ["hello"], indirect=True)
def test_hello_has_its_three_cars_from_the_first_step_on_and_room_to_drive(world: SumoWorld) -> None:
    snapshot = first_step(world)
    assert sorted(zip(snapshot.ids, snapshot.type_ids, strict=True)) == [
        ("car_0", "car"),
        ("xgv_0", "xgv"),
        ("xgv_1", "xgv"),
    ]
    for _ in range(300):
        snapshot = world.step(nobody())
        assert snapshot.collisions == ()
    assert len(snapshot.ids) == 3
    assert world.messages == ()


@pytest.mark.parametrize("name", ["freeway_estop"], indirect=True)
def test_the_freeway_is_full_from_the_first_step_on(world: SumoWorld) -> None:
    snapshot = first_step(world)
    kinds = Counter(snapshot.type_ids)
    xgvs = [index for index, kind in enumerate(snapshot.type_ids) if kind == "xgv"]
    assert len(snapshot.ids) >= 200
    assert {snapshot.ids[index] for index in xgvs} == {f"xgv_{number}" for number in range(24)}
    assert kinds["truck"] >= 15
    assert kinds["van"] >= 15
    assert len(set(snapshot.lane[xgvs].tolist())) >= 12  # of 24 lanes, 8 edges with 3 each
    lanes = Counter(world.road.lane_ids[lane].rsplit("_", 1)[1] for lane in snapshot.lane[xgvs])
    assert lanes == {"0": 8, "1": 8, "2": 8}
    assert np.ptp(snapshot.front_x_m[xgvs]) > 5000.0


@pytest.mark.parametrize("name", ["freeway_estop"], indirect=True)
def test_injected_cars_keep_a_kilometre_between_them_and_stay_in_the_net(world: SumoWorld) -> None:
    """Even if nobody stops them: each event's place is behind all that lie ahead of it."""
    snapshot = first_step(world)
    road_end_m = max(float(shape[-1, 0]) for shape in world.road.shapes)
    sumo = load_libsumo()  # by itself: a snapshot of all 270 in each of these steps costs more than SUMO does
    while sumo.simulation.getTime() < 129.9:
        sumo.simulationStep()
        assert sumo.simulation.getCollisions() == ()
        fronts = [sumo.vehicle.getPosition(vehicle)[0] for vehicle in INJECTED]
        assert all(second - first > 900.0 for first, second in pairwise(fronts))
    snapshot = world.step(nobody())
    assert max(fronts) < road_end_m - 1000.0
    assert {f"xgv_{number}" for number in range(24)} <= set(snapshot.ids)
    assert len(snapshot.ids) > 250


def test_the_generator_writes_the_files_that_are_there() -> None:
    generator = runpy.run_path(str(SCENARIOS / "freeway_estop" / "generate.py"))
    written = {**generator["network_files"](), "freeway_estop.rou.xml": generator["route_file"]()}
    for file, text in written.items():
        assert (SCENARIOS / "freeway_estop" / file).read_text() == text, file
