"""SUMO plans for bound cars as for ones that stop at red lights, and holds none that does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import ahead, nobody, stay
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.couplings import NO_SPEED_CHECKS, PLANS_TO_STOP_AT_RED
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from xgv_cosim.columns import BoolColumn
    from xgv_cosim.snapshot import Snapshot

STEP_S = 0.1
COMPUTER, DRIVER_STEERS = (True, True), (True, False)


ARMS = {"w": (-200, 0), "e": (200, 0), "s": (0, -200), "n": (0, 200)}


def signalled_crossing(folder: Path, *ways: str) -> Path:
    """Return a network of one-lane streets from or to a light in the middle, each named by its two ends."""
    nodes = '<node id="c" x="0" y="0" type="traffic_light"/>' + "".join(
        f'<node id="{name}" x="{x}" y="{y}" type="priority"/>'
        for name, (x, y) in ARMS.items()
        if any(name in way for way in ways)
    )
    edges = "".join(
        f'<edge id="{way}" from="{way[0]}" to="{way[1]}" numLanes="1" speed="13.89"/>' for way in ways
    )
    return plain_network(folder, nodes, edges)


@pytest.fixture
def crossing(tmp_path: Path) -> Iterator[Callable[..., SumoWorld]]:
    """Return a maker of worlds with a crossing whose light is red for ``ego``, who comes from the west."""
    net = signalled_crossing(tmp_path, "wc", "ce", "sc", "cn")
    made: list[SumoWorld] = []

    def make(coupling: CouplingKind, *options: str) -> SumoWorld:
        ego = car("ego", 150, 10, route="wc ce", kind="xgv")
        world = SumoWorld.headless(write_config(tmp_path, ego, net), step_s=STEP_S, seed=1, options=options)
        made.append(world)
        world.start()
        world.step(nobody())
        world.bind("ego", coupling)
        lights = load_libsumo().trafficlight
        (name,) = lights.getIDList()
        lights.setRedYellowGreenState(name, "r" * len(lights.getRedYellowGreenState(name)))
        return world

    yield make
    for world in made:
        world.close()


def left_m(world: SumoWorld, snapshot: Snapshot) -> float:
    """Return how far it is to the end of the lane."""
    row = snapshot.index_of["ego"]
    lane = int(snapshot.lane[row])
    return float(world.road.lengths_m[lane] - snapshot.lane_position_m[row])


def axes(computer: tuple[bool, bool]) -> dict[str, BoolColumn]:
    """Return the columns of a placement that say who has which axis."""
    return {"computer_speed": np.array([computer[0]]), "computer_steering": np.array([computer[1]])}


@pytest.mark.parametrize("options", [(), ("--step-method.ballistic", "true")], ids=["euler", "ballistic"])
@pytest.mark.parametrize("computer", [COMPUTER, DRIVER_STEERS], ids=["computer", "driver steers"])
@pytest.mark.parametrize("coupling", list(CouplingKind))
@pytest.mark.parametrize("speed_mps", [0.7, 12.0, 33.0])
def test_a_car_that_runs_a_red_light_is_not_held_at_the_line(
    crossing: Callable[..., SumoWorld],
    speed_mps: float,
    coupling: CouplingKind,
    computer: tuple[bool, bool],
    options: tuple[str, ...],
) -> None:
    world = crossing(coupling, *options)
    vehicle = load_libsumo().vehicle
    snapshot = world.step(stay(world._snapshot, "ego"))
    while left_m(world, snapshot) > 8.0:  # quickly there, first of all
        snapshot = world.step(ahead(snapshot, "ego", 25.0, STEP_S)._replace(**axes(computer)))
    modes = set()
    for _ in range(round(25.0 / (speed_mps * STEP_S))):
        row = snapshot.index_of["ego"]
        before_m = float(snapshot.front_x_m[row])
        asked = ahead(snapshot, "ego", speed_mps, STEP_S)._replace(**axes(computer))
        snapshot = world.step(asked)
        row = snapshot.index_of["ego"]
        assert snapshot.front_x_m[row] - before_m == pytest.approx(speed_mps * STEP_S, abs=1e-6)
        assert snapshot.placement_error_m[row] <= 1e-6
        assert vehicle.getPosition("ego")[0] == pytest.approx(float(snapshot.front_x_m[row]), abs=1e-6)
        if not options:  # ballistic, a mean speed and one at the end have to agree, which these do not
            assert vehicle.getSpeed("ego") == pytest.approx(speed_mps, abs=0.01)
        modes.add(vehicle.getSpeedMode("ego"))
    assert snapshot.front_x_m[snapshot.index_of["ego"]] > 0.0
    assert modes >= {NO_SPEED_CHECKS}
    assert not [line for line in world.messages if "emergency stop" in line]


@pytest.mark.parametrize("coupling", list(CouplingKind))
def test_sumo_plans_no_farther_than_the_red_light_for_who_waits_there(
    crossing: Callable[..., SumoWorld], coupling: CouplingKind
) -> None:
    world = crossing(coupling)
    vehicle = load_libsumo().vehicle
    snapshot = world.step(stay(world._snapshot, "ego"))
    while (away_m := left_m(world, snapshot)) > 0.1:
        assert vehicle.getSpeedMode("ego") == NO_SPEED_CHECKS  # others see it coming
        snapshot = world.step(ahead(snapshot, "ego", min(10.0, max(0.5, away_m)), STEP_S))
    for _ in range(3):
        snapshot = world.step(stay(snapshot, "ego"))
    assert vehicle.getSpeedMode("ego") == PLANS_TO_STOP_AT_RED
    snapshot = world.step(ahead(snapshot, "ego", 1.5, STEP_S))
    assert vehicle.getSpeedMode("ego") == NO_SPEED_CHECKS
    for _ in range(3):
        snapshot = world.step(stay(snapshot, "ego"))
    assert vehicle.getSpeedMode("ego") == PLANS_TO_STOP_AT_RED
    world.release("ego")
    assert vehicle.getSpeedMode("ego") == 31


@pytest.mark.parametrize(("own", "others"), [("y", "g"), ("y", "y"), ("r", "g")])
def test_who_turns_across_yields_to_a_car_that_passes_the_light(
    tmp_path: Path, own: str, others: str
) -> None:
    """The light changes 40 m before the line; the car goes on, as a stack or a driver may."""
    net = signalled_crossing(tmp_path, "wc", "ce", "ec", "cw", "cs")
    cars = car("ego", 100, 12, route="wc ce", kind="xgv") + car("turns", 135, 8, route="ec cs")
    world = SumoWorld.headless(write_config(tmp_path, cars, net), step_s=STEP_S, seed=1)
    world.start()
    snapshot = world.step(nobody())
    world.bind("ego", CouplingKind.AUTO)
    lights, vehicle = load_libsumo().trafficlight, load_libsumo().vehicle
    (name,) = lights.getIDList()
    links = [link[0][:2] for link in lights.getControlledLinks(name)]
    letters = {("wc_0", "ce_0"): "G", ("ec_0", "cs_0"): "g"}
    slowest_mps = 99.0
    while (front_m := float(snapshot.front_x_m[snapshot.index_of["ego"]])) < 10.0:
        if front_m > -40.0:
            letters = {("wc_0", "ce_0"): own, ("ec_0", "cs_0"): others}
        lights.setRedYellowGreenState(name, "".join(letters.get(link, "r") for link in links))
        snapshot = world.step(ahead(snapshot, "ego", 12.0, STEP_S))
        assert snapshot.collisions == ()
        slowest_mps = min(slowest_mps, vehicle.getSpeed("turns"))
    world.close()
    assert slowest_mps < 0.1
