"""What SUMO's driver wants after a hand-over: eased, safe, and undone to the last bit."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import xgv_cosim
from tests.contracts.world_contract import nobody
from tests.xgv_cosim.worlds.sumo_networks import plain_network
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from tests.xgv_cosim.worlds.test_sumo_couplings import COMPUTER, DRIVER_DRIVES, EGO, WORLD, Ego
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.vehicles.xgv.assumptions import ledger
from xgv_cosim.vehicles.xgv.settings import XgvSettings
from xgv_cosim.worlds.sumo.couplings import EASING_RATE_MPS
from xgv_cosim.worlds.sumo.handover import (
    HEADING_EASE_S,
    JERK_MPS3,
    QUICKENS_FOR_S,
    QUICKENS_MPS2,
    SLOWS_MPS2,
)
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from types import ModuleType

    from tests.xgv_cosim.worlds.conftest import NewWorld

LIMIT_MPS = 13.89  # of the road of hello
FAST_MPS = 17.0


def settings(ego: Ego) -> tuple[Any, ...]:
    """Return all that an easing may touch."""
    vehicle = ego.libsumo.vehicle
    return (
        vehicle.getSpeedFactor("ego"),
        vehicle.getMaxSpeed("ego"),
        vehicle.getTypeID("ego"),
        vehicle.getSpeedMode("ego"),
        vehicle.getAllowedSpeed("ego"),
    )


def driven(sumo: NewWorld, *others: str, speed_mps: float = FAST_MPS, vehicle: str = EGO) -> Ego:
    """Return a car that the computer drives at this speed."""
    ego = Ego(sumo(*others, vehicle), CouplingKind.FREE)
    for _ in range(3):
        ego.drive(speed_mps)
    return ego


def speeds_under(ego: Ego, num_steps: int, computer: tuple[bool, bool] = WORLD) -> np.ndarray[Any, Any]:
    """Return the speed before and after each of the steps."""
    return np.array([ego.state.speed_mps, *(ego.drive(0.0, computer).speed_mps for _ in range(num_steps))])


def undone() -> tuple[Any, ...]:
    """Return the settings of a car that no computer has had."""
    return (1.0, 200.0 / 3.6, "xgv", 31, pytest.approx(LIMIT_MPS))


@pytest.mark.parametrize("computer", [WORLD, DRIVER_DRIVES])
def test_a_driver_who_wants_less_slows_down_gently_and_nothing_stays_behind(
    sumo: NewWorld, computer: tuple[bool, bool]
) -> None:
    """Not at 4.5 m/s², and he ends at his own wish with all his settings, to the last bit."""
    ego = driven(sumo)
    speeds = speeds_under(ego, 80, computer)
    assert np.diff(speeds).min() == pytest.approx(-SLOWS_MPS2 * 0.1, abs=1e-6)
    assert speeds[0] == FAST_MPS
    assert speeds[-1] == pytest.approx(LIMIT_MPS, abs=1e-6)
    assert settings(ego) == undone()


def test_it_begins_with_the_plants_acceleration(sumo: NewWorld) -> None:
    """Who was being accelerated is not braked in the very next step."""
    ego = driven(sumo)
    for speed_mps in (17.04, 17.08, 17.12):
        ego.drive(speed_mps)
    steps = np.diff(speeds_under(ego, 12))
    assert steps[0] == pytest.approx(0.03, abs=0.005)
    assert np.diff(steps).min() >= -0.0101  # a jerk of 1 m/s³
    assert steps[-1] == pytest.approx(-SLOWS_MPS2 * 0.1, abs=1e-6)


def test_a_driver_who_wants_more_accelerates_gently_first(sumo: NewWorld) -> None:
    steps = np.diff(speeds_under(driven(sumo, speed_mps=8.0), 15))
    assert steps[:10] == pytest.approx(QUICKENS_MPS2 * 0.1, abs=1e-6)
    assert steps.max() <= 0.26 + 1e-9


def test_the_computer_takes_over_in_the_middle_of_it_and_gives_back_again(sumo: NewWorld) -> None:
    ego = driven(sumo)
    for _ in range(2):
        speeds_under(ego, 5)
        assert ego.libsumo.vehicle.getSpeedFactor("ego") > 1.0
        ego.drive(FAST_MPS, COMPUTER)
        assert settings(ego)[:3] == undone()[:3]
    speeds_under(ego, 80)
    assert settings(ego) == undone()


def test_released_bound_again_and_released_in_the_middle_of_it(sumo: NewWorld) -> None:
    ego = driven(sumo)
    for _ in range(2):
        ego.world.release("ego")
        for _ in range(5):
            ego.snapshot = ego.world.step(nobody())
        assert ego.libsumo.vehicle.getSpeedFactor("ego") > 1.0
        ego.world.bind("ego", CouplingKind.AUTO)
        ego.drive(FAST_MPS)
        assert settings(ego)[:3] == undone()[:3]
    ego.world.release("ego")
    speeds = []
    for _ in range(80):
        ego.snapshot = ego.world.step(nobody())
        speeds.append(ego.state.speed_mps)
    assert np.diff(speeds).min() > -0.061
    assert settings(ego) == undone()


def test_one_who_arrives_in_the_middle_of_it(sumo: NewWorld) -> None:
    ego = driven(sumo, vehicle=car("ego", 1100, 10, kind="xgv"))
    ego.world.release("ego")
    arrived: tuple[str, ...] = ()
    for _ in range(100):
        ego.snapshot = ego.world.step(nobody())
        arrived += ego.snapshot.arrived
    assert arrived == ("ego",)


def test_a_factor_that_a_script_sets_meanwhile_stays(sumo: NewWorld) -> None:
    ego = driven(sumo)
    speeds_under(ego, 5)
    ego.libsumo.vehicle.setSpeedFactor("ego", 0.7)
    speeds_under(ego, 60)
    assert ego.libsumo.vehicle.getSpeedFactor("ego") == 0.7
    assert ego.state.speed_mps == pytest.approx(0.7 * LIMIT_MPS, abs=1e-6)


def test_a_speed_that_a_script_sets_after_the_release_is_its_own(sumo: NewWorld) -> None:
    ego = driven(sumo, speed_mps=8.0)
    ego.world.release("ego")
    ego.libsumo.vehicle.setSpeed("ego", 6.0)
    for _ in range(40):
        ego.snapshot = ego.world.step(nobody())
    assert ego.state.speed_mps == pytest.approx(6.0)


def test_a_leader_is_obeyed_whatever_the_easing(sumo: NewWorld) -> None:
    """The exception: safety first. Who is handed over 25 m behind a car at 8 m/s brakes as he must."""
    ego = Ego(sumo(car("front", 240, 8), EGO), CouplingKind.FREE)
    ego.libsumo.vehicle.setMaxSpeed("front", 8.0)
    for _ in range(12):
        ego.drive(16.0)
    speeds = []
    for _ in range(100):
        speeds.append(ego.drive(0.0, WORLD).speed_mps)
        assert ego.snapshot.collisions == ()
    assert np.diff(speeds).min() < -0.2
    assert speeds[-1] == pytest.approx(8.0, abs=0.3)
    assert ego.libsumo.vehicle.getSpeedFactor("ego") == 1.0


def test_above_the_greatest_speed_of_the_type(tmp_path: Path) -> None:
    """SUMO would brake with the emergency deceleration; the vehicle gets its type back in the end."""
    slow = '<vType id="slow" length="4.4" sigma="0" speedDev="0" maxSpeed="11"/>'
    config = write_config(tmp_path, slow + car("ego", 100, 10, kind="slow"), network("hello"))
    world = SumoWorld.headless(config, step_s=0.1, seed=1)
    try:
        ego = Ego(world, CouplingKind.FREE)
        for _ in range(3):
            ego.drive(13.0)
        speeds = speeds_under(ego, 60)
        assert np.diff(speeds).min() == pytest.approx(-SLOWS_MPS2 * 0.1, abs=1e-6)
        assert speeds[-1] == pytest.approx(11.0, abs=1e-6)
        assert settings(ego)[:4] == (1.0, 11.0, "slow", 31)
        assert world.messages == ()
    finally:
        world.close()


def test_a_lower_limit_ahead_is_met_as_without_the_easing(tmp_path: Path) -> None:
    """SUMO looks ahead with the raised factor; the next lane is entered at his own wish all the same."""
    net = plain_network(
        tmp_path,
        '<node id="a" x="0" y="0"/><node id="b" x="600" y="0"/><node id="c" x="900" y="0"/>',
        '<edge id="road" from="a" to="b" numLanes="1" speed="15"/>'
        '<edge id="on" from="b" to="c" numLanes="1" speed="8"/>',
    )
    config = write_config(tmp_path, car("ego", 100, 10, kind="xgv", route="road on"), net)
    world = SumoWorld.headless(config, step_s=0.1, seed=1)
    try:
        ego = Ego(world, CouplingKind.FREE)
        while ego.state.position_m < 540.0:
            ego.drive(22.0)
        while ego.state.lane_id != "on_0":
            ego.drive(0.0, WORLD)
        assert ego.state.speed_mps < 8.1
        assert ego.libsumo.vehicle.getSpeedFactor("ego") == 1.0
        assert world.messages == ()
    finally:
        world.close()


@pytest.fixture
def libsumo() -> Iterator[ModuleType]:
    module = load_libsumo()
    yield module
    if module.isLoaded():
        module.close()


@pytest.mark.filterwarnings("ignore::xgv_cosim.script_warnings.SumoOptionsWarning")
@pytest.mark.parametrize("detached", [False, True])
def test_under_attach(tmp_path: Path, libsumo: ModuleType, detached: bool) -> None:
    """Point 3.3: released gently, also if the plugin is detached before that has ended."""
    config = write_config(tmp_path, EGO, network("hello"))
    libsumo.start(["sumo", "-c", str(config), "--step-length", "0.1", "--no-step-log"])
    plugin = xgv_cosim.attach(libsumo)
    try:
        plugin.bind("ego")
        libsumo.simulationStep(8.0)
        libsumo.vehicle.setSpeedFactor("ego", 0.6)  # and the reference stack drives at the limit
        before = libsumo.vehicle.getSpeed("ego")
        assert before > 0.7 * LIMIT_MPS
        plugin.release("ego")
        steps = []
        for _ in range(5):
            libsumo.simulationStep()
            steps.append(libsumo.vehicle.getSpeed("ego") - before)
            before = libsumo.vehicle.getSpeed("ego")
        assert max(map(abs, steps)) < 0.2
        assert libsumo.vehicle.getSpeedFactor("ego") > 0.6
        if detached:
            plugin.detach()
            for _ in range(5):
                libsumo.simulationStep()
                assert abs(libsumo.vehicle.getSpeed("ego") - before) < 0.2
                before = libsumo.vehicle.getSpeed("ego")
        libsumo.simulationStep(25.0)
        assert libsumo.vehicle.getSpeedFactor("ego") == 0.6
        assert sys.modules["libsumo"].vehicle.getTypeID("ego") == "xgv"
    finally:
        plugin.detach()


@pytest.mark.parametrize("kind", list(CouplingKind))
@pytest.mark.parametrize("begun_s", [0.1, 1.0])
def test_the_wheel_is_taken_in_the_middle_of_the_drivers_lane_change(
    sumo: NewWorld, kind: CouplingKind, begun_s: float
) -> None:
    """SUMO crashed where the car was then placed in the other lane before SUMO had it there."""
    ego = Ego(sumo(EGO), kind)
    ego.drive(10.0, WORLD)
    ego.libsumo.vehicle.changeLane("ego", 1, 0.1)
    for _ in range(round(begun_s / 0.1)):
        ego.drive(10.0, WORLD)
    middle_m = 0.5 * 3.2  # between the lanes
    y_m = ego.front[1]
    seen = []
    left_m = ego.state.lateral_m
    assert left_m > 0.0
    for _ in range(40):
        left_m += 0.12
        lane_m = 0.0 if ego.state.lane_id == "road_0" else 2.0 * middle_m
        ego.drive(10.0, lateral_m=min(left_m, 2.0 * middle_m) - lane_m)
        seen.append(ego.front[1] - y_m)
    assert np.abs(np.diff(seen) - 0.12)[:10].max() < 0.011
    assert ego.state.lane_id == "road_1"
    assert ego.state.lateral_m == pytest.approx(0.0, abs=1e-6)


def test_the_ledger_says_how_gently() -> None:
    """XGV-64: the row in the ledger of assumptions carries the values in use."""
    rows = [row.text for row in ledger(XgvSettings()) if row.text.startswith("The world's driver wants")]
    assert len(rows) == 1
    for words in (
        f"at {SLOWS_MPS2:g} m/s², with a jerk of {JERK_MPS3:g} m/s³",
        f"at {QUICKENS_MPS2:g} m/s² for {QUICKENS_FOR_S:g} s",
        f"at {EASING_RATE_MPS:g} m/s",
        f"1/e in {HEADING_EASE_S:g} s",
    ):
        assert words in rows[0]
