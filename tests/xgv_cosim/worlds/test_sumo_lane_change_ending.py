"""The computer takes the wheel during a lane change of SUMO's driver: exact from the first step on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.contracts.world_contract import place
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, write_config
from tests.xgv_cosim.worlds.test_sumo_couplings import COMPUTER, DRIVER_DRIVES, WORLD, Ego
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.placing import TOLERANCE_M, TOLERANCE_RAD
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

STEP_S = 0.1
WIDTH_M = 3.2
SPEED_MPS = 10.0
BALLISTIC = ("--step-method.ballistic",)
NODES = '<node id="a" x="0" y="0"/><node id="b" x="300" y="0"/><node id="c" x="600" y="0"/>'
EDGES = (
    '<edge id="ab" from="a" to="b" numLanes="2" speed="14"/>'
    '<edge id="bc" from="b" to="c" numLanes="{lanes}" speed="14"/>'
)
EGO = car("ego", 150, 10, kind="xgv", route="ab bc")


@pytest.fixture
def changing(tmp_path: Path) -> Iterator[Callable[..., Ego]]:
    """Return a maker of cars in a lane change of SUMO's driver that has begun so many steps ago."""
    made: list[SumoWorld] = []

    def make(
        begun: int,
        kind: CouplingKind = CouplingKind.FREE,
        *options: str,
        left_hand: bool = False,
        vehicle: str = EGO,
        lanes: int = 2,
    ) -> Ego:
        hand = ("--lefthand",) if left_hand else ()
        net = plain_network(tmp_path, NODES, EDGES.format(lanes=lanes), *hand)
        config = write_config(tmp_path, vehicle, net)
        made.append(SumoWorld.headless(config, step_s=STEP_S, seed=1, options=options))
        ego = Ego(made[-1], kind)
        ego.drive(SPEED_MPS, WORLD)
        ego.libsumo.vehicle.changeLane("ego", 1, 0.1)
        for _ in range(begun):
            ego.drive(SPEED_MPS, WORLD)
        return ego

    yield make
    for world in made:
        world.close()


def errors_beside(ego: Ego, to_left_m: float, num_steps: int = 40) -> tuple[float, float]:
    """Return how far SUMO is from the plant at most, in metres and radians, on a way to the side."""
    row = ego.snapshot.index_of["ego"]
    (x_m, y_m), heading_rad = ego.front, float(ego.snapshot.heading_rad[row])
    begun_y_m, errors = y_m, []
    for step in range(1, num_steps + 1):
        y_before_m = y_m
        y_m = begun_y_m + to_left_m * 0.5 * (1.0 - math.cos(math.pi * step / num_steps))
        heading_rad = math.asin((y_m - y_before_m) / (SPEED_MPS * STEP_S))
        x_m += SPEED_MPS * STEP_S * math.cos(heading_rad)
        pose = (x_m, y_m, heading_rad)
        now = ego.world.step(place("ego", *pose, speed_mps=SPEED_MPS, travelled_m=SPEED_MPS * STEP_S))
        row, ego.snapshot = now.index_of["ego"], now
        seen_x_m, seen_y_m = ego.libsumo.vehicle.getPosition("ego")
        turned_rad = math.radians(90.0 - ego.libsumo.vehicle.getAngle("ego")) - heading_rad
        errors.append((math.hypot(seen_x_m - x_m, seen_y_m - y_m), abs(turned_rad)))
        assert (now.front_x_m[row], now.front_y_m[row]) == pytest.approx((x_m, y_m), abs=TOLERANCE_M)
        assert now.placement_error_m[row] < TOLERANCE_M
    most_m, most_rad = np.max(errors, axis=0).tolist()
    return most_m, most_rad


@pytest.mark.parametrize(("left_hand", "options"), [(False, ()), (True, BALLISTIC)])
@pytest.mark.parametrize("kind", [CouplingKind.FREE, CouplingKind.AUTO])
@pytest.mark.parametrize(("begun", "onwards_m"), [(1, 2.0), (15, -1.0), (16, -1.0), (29, 0.5)])
def test_exact_in_every_step(
    changing: Callable[..., Ego],
    begun: int,
    onwards_m: float,
    kind: CouplingKind,
    options: tuple[str, ...],
    left_hand: bool,
) -> None:
    """Whatever the plant does then, back or on, and in whichever half of the change.

    SUMO went on with its change for three seconds, put the car onto the lane's centre at its end, up to
    0.9 m aside, and 0.107 m to the other side a step later.
    """
    ego = changing(begun, kind, *options, left_hand=left_hand)
    assert ego.libsumo.vehicle.getLateralSpeed("ego") == pytest.approx(WIDTH_M / 3.0)
    error_m, error_rad = errors_beside(ego, -onwards_m if left_hand else onwards_m)
    assert error_m < (1e-6 if kind is CouplingKind.FREE else TOLERANCE_M)
    assert error_rad < TOLERANCE_RAD
    assert ego.libsumo.vehicle.getLateralSpeed("ego") == 0.0


@pytest.mark.parametrize("options", [(), BALLISTIC])
@pytest.mark.parametrize("begun", [1, 16])
@pytest.mark.parametrize(
    ("kind", "computer"), [(CouplingKind.LANE, COMPUTER), (CouplingKind.FREE, DRIVER_DRIVES)]
)
def test_where_the_world_has_a_part_in_it(
    changing: Callable[..., Ego],
    kind: CouplingKind,
    computer: tuple[bool, bool],
    begun: int,
    options: tuple[str, ...],
) -> None:
    """Lane coupling, and a driver who keeps the pedals (manual speed): across the lane it is the plant's."""
    ego = changing(begun, kind, *options)
    y_m, speeds_mps = ego.front[1], [ego.state.speed_mps]
    lane_y_m = {"ab_0": -1.5 * WIDTH_M, "ab_1": -0.5 * WIDTH_M}
    for _ in range(40):
        y_m += 0.02
        before = ego.front
        speed_mps = ego.state.speed_mps
        ego.drive(speed_mps, computer, lateral_m=y_m - lane_y_m[ego.state.lane_id])
        assert ego.front[1] == pytest.approx(y_m, abs=1e-3)
        assert ego.front[0] - before[0] == pytest.approx(speed_mps * STEP_S, abs=0.03)
        speeds_mps.append(ego.state.speed_mps)
    assert np.abs(np.diff(speeds_mps))[:10].max() < 0.2


BEHIND = car("back0", 120, 10, lane=0, route="ab bc") + car("back1", 110, 10, lane=1, route="ab bc")


@pytest.mark.parametrize(("begun", "to_lane"), [(5, 0), (5, 1), (10, 0), (10, 1), (16, 0), (20, 0), (25, 0)])
@pytest.mark.parametrize(
    ("kind", "computer"),
    [
        (CouplingKind.LANE, COMPUTER),
        (CouplingKind.FREE, DRIVER_DRIVES),
        (CouplingKind.FREE, COMPUTER),
        (CouplingKind.AUTO, COMPUTER),
    ],
)
def test_nobody_follows_the_car_in_the_lane_that_it_has_left(
    changing: Callable[..., Ego], kind: CouplingKind, computer: tuple[bool, bool], begun: int, to_lane: int
) -> None:
    """Where lane coupling or car following wrote it, SUMO kept it in both lanes to the edge's end."""
    ego = changing(begun, kind, vehicle=EGO + BEHIND)
    lane_y_m = {"ab_0": -1.5 * WIDTH_M, "ab_1": -0.5 * WIDTH_M}
    y_m, goal_m = ego.front[1], lane_y_m[f"ab_{to_lane}"]
    for _ in range(50):
        y_m += max(-0.08, min(0.08, goal_m - y_m))
        ego.drive(ego.state.speed_mps, computer, lateral_m=y_m - lane_y_m[ego.state.lane_id])
    assert ego.state.lane_id == f"ab_{to_lane}"
    leaders = [(ego.libsumo.vehicle.getLeader(f"back{lane}", 150.0) or ("",))[0] for lane in (0, 1)]
    assert leaders == ["ego" if lane == to_lane else "" for lane in (0, 1)]


@pytest.mark.parametrize("begun", [30, 31, 33, 40])
@pytest.mark.parametrize("speed_mps", [2.0, 4.0, 7.0])
def test_exact_just_after_the_driver_has_ended_his_change(
    changing: Callable[..., Ego], begun: int, speed_mps: float
) -> None:
    """SUMO's own heading of a slow car is off by up to 22 degrees then, and comes back over some 20 m."""
    slow = f'<vType id="own" maxSpeed="{speed_mps}" sigma="0" length="4.4"/>'
    slow += car("ego", 150, speed_mps, kind="own", route="ab bc")
    ego = changing(0, CouplingKind.AUTO, vehicle=slow)
    for _ in range(begun):
        ego.drive(speed_mps, WORLD)
    (x_m, y_m), speed_mps = ego.front, ego.state.speed_mps
    for _ in range(25):
        x_m += speed_mps * STEP_S
        ego.world.step(place("ego", x_m, y_m, 0.0, speed_mps=speed_mps, travelled_m=speed_mps * STEP_S))
        assert math.radians(90.0 - ego.libsumo.vehicle.getAngle("ego")) == pytest.approx(
            0.0, abs=TOLERANCE_RAD
        )


def settings(ego: Ego) -> tuple[Any, ...]:
    vehicle = ego.libsumo.vehicle
    bound = "laneChangeModel.lcMaxSpeedLatStanding"
    known = "DK2008" not in ego.libsumo.vehicletype.getParameter(vehicle.getTypeID("ego"), "model")
    return (
        vehicle.getTypeID("ego"),
        vehicle.getMaxSpeedLat("ego"),
        vehicle.getParameter("ego", bound) if known else None,
    )


OTHERS = {
    "plain": EGO,
    "bounded": '<vType id="own" laneChangeModel="LC2013" lcMaxSpeedLatStanding="0.25"'
    ' lcMaxSpeedLatFactor="0"/>' + car("ego", 150, 10, kind="own", route="ab bc"),
    "another model": '<vType id="own" laneChangeModel="DK2008"><param key="model" value="DK2008"/></vType>'
    + car("ego", 150, 10, kind="own", route="ab bc"),
}


@pytest.mark.parametrize("vehicle", OTHERS.values(), ids=OTHERS.keys())
@pytest.mark.parametrize("is_own_type", [False, True])
def test_nothing_of_it_stays_behind(changing: Callable[..., Ego], vehicle: str, is_own_type: bool) -> None:
    """From the very next step on: type, greatest sideways speed, and the lane-change model's bound of it."""
    ego = changing(5, vehicle=vehicle)
    if is_own_type:  # one that SUMO made for this vehicle when a script set something
        ego.libsumo.vehicle.setMaxSpeedLat("ego", 1.25)
    before = settings(ego)
    assert ego.libsumo.vehicle.getLateralSpeed("ego") > 0.0
    for _ in range(3):
        errors_beside(ego, 0.1, 1)
        assert settings(ego) == before
        types = ego.libsumo.vehicletype
        assert max(types.getMaxSpeedLat(name) for name in types.getIDList()) < 10.0  # nor in a ghost's type
    assert ego.libsumo.vehicle.getLateralSpeed("ego") == 0.0


def test_a_change_by_the_drivers_own_wish_ends_as_fast(changing: Callable[..., Ego]) -> None:
    """SUMO bounds the speed sideways of changes that are not urgent, here to 0.5 m/s."""
    slow = '<vType id="slow" maxSpeed="2"/>' + car("slow", 200, 2, kind="slow", route="ab bc")
    ego = changing(0, vehicle=OTHERS["bounded"] + slow)
    ego.libsumo.vehicle.changeLane("ego", 0, 0.0)  # nobody asks him to
    for _ in range(60):
        ego.drive(SPEED_MPS, WORLD)
        if ego.libsumo.vehicle.getLateralSpeed("ego") != 0.0:
            break
    assert ego.libsumo.vehicle.getLateralSpeed("ego") == pytest.approx(0.5)
    error_m, _ = errors_beside(ego, 0.1, 2)
    assert error_m < 1e-6
    assert ego.libsumo.vehicle.getLateralSpeed("ego") == 0.0


@pytest.mark.parametrize("lanes", [1, 2])
@pytest.mark.parametrize("begun", range(2, 30, 6))
def test_over_the_end_of_the_edge(changing: Callable[..., Ego], begun: int, lanes: int) -> None:
    """Also where the road has one lane fewer after it."""
    vehicle = car("ego", 268, 10, kind="xgv", route="ab bc")
    ego = changing(begun, vehicle=vehicle, lanes=lanes)
    error_m, _ = errors_beside(ego, -0.5, 20)
    assert error_m < TOLERANCE_M


def test_one_who_arrives_in_that_step(changing: Callable[..., Ego]) -> None:
    ego = changing(5, vehicle=car("ego", 275, 10, kind="xgv", route="ab"))
    arrived: tuple[str, ...] = ()
    for _ in range(20):
        if "ego" not in ego.snapshot.index_of:
            break
        x_m, y_m = ego.front
        ego.snapshot = ego.world.step(place("ego", x_m + 1.0, y_m, 0.0, speed_mps=10.0, travelled_m=1.0))
        arrived += ego.snapshot.arrived
    assert arrived == ("ego",)
