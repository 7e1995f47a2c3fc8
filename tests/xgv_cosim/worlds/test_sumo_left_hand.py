"""Left-hand networks: SUMO counts offsets across lanes the other way; the left lane is the outer one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from tests.xgv_cosim.worlds.test_sumo_couplings import DRIVER_DRIVES, DRIVER_STEERS, WORLD, Ego
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.handedness import is_left_hand
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.placing import TOLERANCE_M, TOLERANCE_RAD
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

STEP_S = 0.1
WIDTH_M = 3.2
OUTER_Y_M, INNER_Y_M, ONCOMING_Y_M = 1.5 * WIDTH_M, 0.5 * WIDTH_M, -0.5 * WIDTH_M
"""Of a road along the x axis, driven eastwards on the left: its outer lane is lane 0."""

NODES = "".join(
    f'<node id="{name}" x="{x}" y="{y}"/>'
    for name, x, y in (("a", 0, 0), ("b", 300, 0), ("c", 600, 0), ("d", 300, -300))
)
EDGES = "".join(
    f'<edge id="{ends}" from="{ends[0]}" to="{ends[1]}" numLanes="2" speed="14" {shape}/>'
    for ends, shape in (
        ("ab", ""),
        ("ba", ""),
        ("bc", 'shape="300,0 400,0 450,15 500,60 600,60"'),
        ("bd", ""),
        ("db", ""),
    )
)


@pytest.fixture
def world(tmp_path: Path) -> Iterator[Callable[..., SumoWorld]]:
    """Return a maker of worlds: ``world(vehicles)``; they are closed at the end."""
    made: list[SumoWorld] = []

    def make(*vehicles: str) -> SumoWorld:
        net = plain_network(tmp_path, NODES, EDGES, "--lefthand")
        config = write_config(tmp_path, "".join(vehicles), net)
        made.append(SumoWorld.headless(config, step_s=STEP_S, seed=1))
        return made[-1]

    yield make
    for one in made:
        one.close()


def ego_at(position_m: float, *, lane: int = 0, route: str = "ab bc", speed_mps: float = 10.0) -> str:
    return car("ego", position_m, speed_mps, lane=lane, route=route, kind="xgv")


def sumos_y_m() -> float:
    """Return where SUMO itself has the car across a road along the x axis."""
    return float(load_libsumo().vehicle.getPosition("ego")[1])


@pytest.mark.parametrize("kind", list(CouplingKind))
def test_every_coupling_has_the_car_where_the_plant_has_it(
    world: Callable[..., SumoWorld], kind: CouplingKind
) -> None:
    """From side to side of its lane, over a junction and through bends."""
    ego = Ego(world(ego_at(200.0)), kind)
    errors_m, errors_rad, mirrored, lanes = [], [], 0, set()
    for step in range(300):
        lanes.add(ego.drive(10.0, lateral_m=0.6 * math.sin(0.05 * step)).lane_id)
        row = ego.snapshot.index_of["ego"]
        errors_m.append(ego.snapshot.placement_error_m[row])
        errors_rad.append(ego.snapshot.placement_error_rad[row])
        mirrored += ego.snapshot.in_lane_frame[row]
    assert {"ab_0", "bc_0"} < lanes
    assert max(errors_m[:90]) <= 1e-6
    if kind is not CouplingKind.LANE:
        assert max(errors_m) <= TOLERANCE_M
        assert max(errors_rad) <= TOLERANCE_RAD
    assert max(errors_m) <= 0.1
    assert mirrored > 150 or kind is CouplingKind.FREE


@pytest.mark.parametrize("before_m", [1.2, 1.7, 2.2])
def test_a_car_placed_freely_into_a_junction_is_mirrored_there_when_that_is_exact(
    world: Callable[..., SumoWorld], before_m: float
) -> None:
    """SUMO takes the rear, which is on the lane before, for one on the other side: 12° askew."""
    ego = Ego(world(ego_at(-before_m, speed_mps=5.0)), CouplingKind.AUTO)
    mirrored = []
    for _ in range(30):
        ego.drive(5.0, lateral_m=0.5)
        row = ego.snapshot.index_of["ego"]
        assert ego.snapshot.placement_error_rad[row] <= TOLERANCE_RAD
        mirrored.append(bool(ego.snapshot.in_lane_frame[row]))
    assert mirrored == sorted(mirrored)
    assert mirrored[-1]


@pytest.mark.parametrize("left_m", [0.6, -0.6])
@pytest.mark.parametrize("kind", list(CouplingKind))
def test_the_driver_takes_the_car_over_where_it_is(
    world: Callable[..., SumoWorld], kind: CouplingKind, left_m: float
) -> None:
    """SUMO has no driver's car on the other side of its lane, though it has the placed one there."""
    ego = Ego(world(ego_at(50.0)), kind)
    for _ in range(10):
        ego.drive(10.0, lateral_m=left_m)
    seen = [sumos_y_m()]
    for computer in (WORLD, DRIVER_STEERS):
        for _ in range(8):
            ego.drive(10.0, computer)
            seen.append(sumos_y_m())
    assert seen[0] == pytest.approx(OUTER_Y_M + left_m, abs=1e-6)
    assert np.abs(np.diff(seen)).max() <= 0.05 + 1e-6
    assert seen[-1] == pytest.approx(OUTER_Y_M, abs=1e-6)


def test_the_driver_has_the_speed_and_the_plant_the_place_across_the_lane(
    world: Callable[..., SumoWorld],
) -> None:
    ego = Ego(world(ego_at(50.0)), CouplingKind.AUTO)
    ego.drive(10.0)
    for _ in range(10):
        ego.drive(10.0, DRIVER_DRIVES, lateral_m=0.5)
    assert sumos_y_m() == pytest.approx(OUTER_Y_M + 0.5, abs=1e-6)


@pytest.mark.parametrize("kind", list(CouplingKind))
@pytest.mark.parametrize("begun_s", [0.1, 1.0])
def test_the_wheel_is_taken_in_the_middle_of_the_drivers_lane_change(
    world: Callable[..., SumoWorld], kind: CouplingKind, begun_s: float
) -> None:
    ego = Ego(world(ego_at(50.0)), kind)
    ego.drive(10.0, WORLD)
    ego.libsumo.vehicle.changeLane("ego", 1, 0.1)
    for _ in range(round(begun_s / 0.1)):
        ego.drive(10.0, WORLD)
    before_m = sumos_y_m()
    assert before_m < OUTER_Y_M  # to the right
    seen, y_m = [before_m], before_m
    for _ in range(40):
        y_m = max(y_m - 0.12, INNER_Y_M)
        lane_m = OUTER_Y_M if ego.state.lane_id == "ab_0" else INNER_Y_M
        ego.drive(10.0, lateral_m=y_m - lane_m)
        seen.append(sumos_y_m())
    assert np.abs(np.diff(seen) + 0.12)[:10].max() < 0.011
    assert ego.state.lane_id == "ab_1"
    assert seen[-1] == pytest.approx(INNER_Y_M, abs=1e-6)


@pytest.mark.parametrize("kind", [CouplingKind.AUTO, CouplingKind.FREE])
def test_the_plant_changes_to_the_lane_on_the_right(
    world: Callable[..., SumoWorld], kind: CouplingKind
) -> None:
    ego = Ego(world(ego_at(50.0)), kind)
    y_m = OUTER_Y_M
    for _ in range(100):
        y_m = max(y_m - 0.05, INNER_Y_M)
        lane_m = OUTER_Y_M if ego.state.lane_id == "ab_0" else INNER_Y_M
        ego.drive(10.0, lateral_m=y_m - lane_m)
        assert sumos_y_m() == pytest.approx(y_m, abs=1e-6)
    assert ego.state.lane_id == "ab_1"
    assert ego.snapshot.in_lane_frame[ego.snapshot.index_of["ego"]] == (kind is CouplingKind.AUTO)


def test_a_stack_sees_who_is_left_and_who_is_right(world: Callable[..., SumoWorld]) -> None:
    """And to which side its route makes it change lanes: to the right, for a turn from the inner lane."""
    others = car("left", 130, 10, route="ab bc") + car("right", 150, 10, lane=1, route="ab bd")
    outer, inner = ego_at(100.0, route="ab bd"), car("middle", 70, 10, lane=1, route="ab bd", kind="xgv")
    sumo = world(others, outer, inner)
    sumo.start()
    sumo.step(nobody())
    for name in ("ego", "middle"):
        sumo.bind(name, CouplingKind.AUTO)
    around = sumo.surroundings(("ego", "middle"))
    assert around.lane_changes.tolist() == [-1, 0]
    assert around.right.offset_m[0] == pytest.approx(-WIDTH_M)
    assert around.right.leader_gap_m[0] == pytest.approx(150.0 - 100.0 - 5.2, abs=0.1)
    assert around.right.follower_gap_m[0] == pytest.approx(100.0 - 70.0 - 4.4, abs=0.1)
    assert math.isnan(around.left.offset_m[0])
    assert around.left.offset_m[1] == pytest.approx(WIDTH_M)
    assert around.left.leader_gap_m[1] == pytest.approx(100.0 - 70.0 - 4.4, abs=0.1)
    assert math.isnan(around.right.offset_m[1])


@pytest.mark.parametrize(("allowed", "side"), [("changeLeft", 1), ("changeRight", -1)])
def test_a_stack_may_change_to_where_the_network_lets_it(tmp_path: Path, allowed: str, side: int) -> None:
    lane = f'<lane index="1" {allowed}="bus"/>'
    edge = f'<edge id="ab" from="a" to="b" numLanes="3" speed="14">{lane}</edge>'
    net = plain_network(tmp_path, NODES, edge, "--lefthand")
    sumo = SumoWorld.headless(
        write_config(tmp_path, ego_at(100.0, lane=1, route="ab"), net), step_s=0.1, seed=1
    )
    try:
        sumo.start()
        sumo.step(nobody())
        sumo.bind("ego", CouplingKind.AUTO)
        around = sumo.surroundings(("ego",))
        offsets_m = {1: around.left.offset_m[0], -1: around.right.offset_m[0]}
        assert math.isnan(offsets_m[side])
        assert offsets_m[-side] == pytest.approx(-side * WIDTH_M)
    finally:
        sumo.close()


@pytest.mark.parametrize(
    ("y_m", "lane", "stops", "drives_by"),
    [
        (INNER_Y_M - 1.5, 1, "oncoming", "beside"),
        (ONCOMING_Y_M, 1, "oncoming", "beside"),
        (OUTER_Y_M - 1.3, 0, "beside", "oncoming"),
    ],
)
def test_drivers_stop_before_a_car_that_reaches_into_their_lane(
    world: Callable[..., SumoWorld], y_m: float, lane: int, stops: str, drives_by: str
) -> None:
    """Over the middle of the road to its right, wholly in the oncoming lane, over the line between lanes."""
    oncoming = car("oncoming", 30, 12, lane=1, route="ba")
    beside = car("beside", 30, 12, lane=1 - lane, route="ab bd" if lane == 0 else "ab bc")
    sumo = world(ego_at(150.0, lane=lane, speed_mps=0.0), oncoming, beside)
    sumo.start()
    snapshot = sumo.step(nobody())
    load_libsumo().vehicle.setLaneChangeMode("beside", 0)
    sumo.bind("ego", CouplingKind.FREE)
    for _ in range(200):
        snapshot = sumo.step(place("ego", 150.0, y_m, 0.0, speed_mps=0.0, travelled_m=0.0))
        assert snapshot.collisions == ()
    row = snapshot.index_of[stops]
    assert snapshot.speed_mps[row] == pytest.approx(0.0, abs=0.05)
    gap_m = snapshot.front_x_m[row] - 150.0 if stops == "oncoming" else 150.0 - 4.4 - snapshot.front_x_m[row]
    assert 1.0 < gap_m < 3.0
    assert drives_by not in snapshot.index_of or snapshot.speed_mps[snapshot.index_of[drives_by]] > 10.0


def test_nobody_waits_for_a_car_that_is_not_in_his_lane(tmp_path: Path) -> None:
    """SUMO has who comes onto the middle lane of three, placed freely, in the lane to his right as well."""
    edge = '<edge id="ab" from="a" to="b" numLanes="3" speed="14"/>'
    net = plain_network(tmp_path, NODES, edge, "--lefthand")
    behind = car("behind", 70, 5, lane=2, route="ab")
    config = write_config(tmp_path, ego_at(100.0, route="ab", speed_mps=5.0) + behind, net)
    ego = Ego(SumoWorld.headless(config, step_s=STEP_S, seed=1), CouplingKind.FREE)
    try:
        ego.libsumo.vehicle.setLaneChangeMode("behind", 0)
        for step in range(150):
            y_m = max(2.5 * WIDTH_M - 0.08 * step, 1.5 * WIDTH_M)
            lane_m = (2.5 if ego.state.lane_id == "ab_0" else 1.5) * WIDTH_M
            ego.drive(5.0, lateral_m=y_m - lane_m)
        assert ego.state.lane_id == "ab_1"
        assert ego.snapshot.front_x_m[ego.snapshot.index_of["behind"]] > ego.front[0] + 20.0
    finally:
        ego.world.close()


@pytest.mark.parametrize("options", [(), ("--lefthand",)])
def test_the_lanes_tell_where_the_file_cannot_be_read(tmp_path: Path, options: tuple[str, ...]) -> None:
    """SUMO may run on another machine."""
    net = plain_network(tmp_path, NODES, EDGES, *options)
    sumo = SumoWorld.headless(write_config(tmp_path, ego_at(100.0), net), step_s=0.1, seed=1)
    try:
        sumo.start()
        road, engine = sumo.road, load_libsumo()
        shapes = dict(zip(road.lane_ids, road.shapes, strict=True))
        assert road.leftwards == (-1 if options else 1)
        net.unlink()
        assert is_left_hand(engine, shapes) == bool(options)
    finally:
        sumo.close()
