"""Ballistic integration: SUMO moves vehicles by the mean of old and new speed; couplings stay exact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import xgv_cosim
from tests.xgv_cosim.worlds.sumo_traffic import STEADY, car, network, write_config
from tests.xgv_cosim.worlds.test_sumo_couplings import DRIVER_STEERS, EGO, STEP_S, WORLD, Ego
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.integration import TELLING_M, Integration
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.placing import TOLERANCE_M
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from types import ModuleType

    from tests.xgv_cosim.worlds.conftest import NewWorld

BALLISTIC = ("--step-method.ballistic",)
ACTION_STEPS = ("--default.action-step-length", "0.5")
EULER = (*ACTION_STEPS, "--step-method.ballistic", "false")
FALLS = np.arange(12.0, 4.0, -0.8), np.arange(4.0, 12.0, 0.3), np.arange(12.0, 0.0, -0.8)
SPEEDS_MPS = np.concatenate([*FALLS, [0.0, 0.0], np.arange(0.5, 12.1, 0.5)])
"""Down harder than any driver, up, to a stop that is within a step, and up again."""


def drive(
    ego: Ego, computer: tuple[bool, bool] = (True, True)
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Drive through ``SPEEDS_MPS``; return how far SUMO's own place is from the plant's after each step."""
    vehicle, off_m = ego.libsumo.vehicle, []
    before_mps = ego.state.speed_mps
    for speed_mps in SPEEDS_MPS:
        stops_within = speed_mps == 0.0 and before_mps > 0.0
        way_m = before_mps**2 / 16.0 if stops_within else 0.5 * (before_mps + speed_mps) * STEP_S
        at_m = vehicle.getLanePosition("ego") + way_m
        ego.drive(float(speed_mps), computer, lateral_m=0.2, travelled_m=float(way_m))
        off_m.append(vehicle.getLanePosition("ego") - at_m)
        assert ego.state.position_m == pytest.approx(vehicle.getLanePosition("ego"), abs=TOLERANCE_M)
        assert vehicle.getSpeed("ego") == pytest.approx(speed_mps, abs=0.01)
        before_mps = speed_mps
    return np.abs(off_m)


@pytest.mark.parametrize("options", [(), BALLISTIC, ACTION_STEPS])
@pytest.mark.parametrize("kind", list(CouplingKind))
def test_every_coupling_is_exact_whatever_the_options(
    sumo: NewWorld, kind: CouplingKind, options: tuple[str, ...]
) -> None:
    ego = Ego(sumo(EGO, options=options), kind)
    for _ in range(10):
        ego.drive(12.0)
    assert drive(ego).max() <= 1e-6


@pytest.mark.parametrize("options", [(), BALLISTIC])
def test_the_computer_brakes_and_the_driver_steers(sumo: NewWorld, options: tuple[str, ...]) -> None:
    ego = Ego(sumo(EGO, options=options), CouplingKind.AUTO)
    ego.drive(12.0, DRIVER_STEERS)
    assert drive(ego, DRIVER_STEERS).max() <= 1e-6


def test_types_with_an_action_step_are_known_from_the_start(tmp_path: Path) -> None:
    """SUMO integrates everybody ballistically because of one type."""
    slow = f'<vType id="slow" length="4.4" actionStepLength="0.5" {STEADY}/>'
    config = write_config(tmp_path, slow + EGO, network("hello"))
    ego = Ego(SumoWorld.headless(config, step_s=STEP_S, seed=1), CouplingKind.LANE)
    try:
        assert drive(ego).max() <= 1e-6
    finally:
        ego.world.close()


@pytest.mark.parametrize("kind", [CouplingKind.AUTO, CouplingKind.LANE])
def test_what_no_option_tells_is_learnt(sumo: NewWorld, kind: CouplingKind) -> None:
    """Euler is asked for, which SUMO does not tell."""
    ego = Ego(sumo(EGO, options=EULER), kind)
    for _ in range(10):
        ego.drive(12.0)
    off_m = drive(ego)
    assert off_m.max() <= TOLERANCE_M
    assert np.flatnonzero(off_m > 1e-6).tolist() in ([], [1])  # the first step in which it brakes


@pytest.mark.parametrize("kind", [CouplingKind.AUTO, CouplingKind.LANE])
def test_a_script_changes_it_under_way(sumo: NewWorld, kind: CouplingKind) -> None:
    other = car("other", 600, 10)
    ego = Ego(sumo(EGO, other), kind)
    for _ in range(10):
        ego.drive(12.0)
    assert drive(ego).max() <= 1e-6
    ego.libsumo.vehicle.setActionStepLength("other", 0.5)
    off_m = drive(ego)
    assert off_m.max() <= TOLERANCE_M
    assert np.flatnonzero(off_m > 1e-6).tolist() == [1]  # the first step in which it brakes


def test_hand_overs_are_bumpless(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO, options=BALLISTIC), CouplingKind.AUTO)
    for _ in range(10):
        ego.drive(10.0, lateral_m=0.5)
    states = [ego.state, *(ego.drive(0.0, WORLD) for _ in range(20))]
    states += [ego.drive(states[-1].speed_mps) for _ in range(10)]
    speeds = np.array([state.speed_mps for state in states])
    along = np.diff([state.position_m for state in states])
    assert np.abs(np.diff(speeds)).max() <= 0.26 + 1e-9
    np.testing.assert_allclose(along, 0.5 * (speeds[1:] + speeds[:-1]) * STEP_S, atol=1e-6)
    assert np.abs(np.diff([state.lateral_m for state in states])).max() <= 0.05 + 1e-9
    assert speeds[-1] > 10.0


def test_it_is_not_learnt_from_who_is_elsewhere_for_another_reason() -> None:
    integration = Integration(STEP_S)
    for further_m in (0.0, 0.5 * TELLING_M, -2.0 * TELLING_M, 1.0):
        integration.learn(np.array([further_m]), np.array([2.0 * TELLING_M]))
    integration.learn(np.zeros(0), np.zeros(0))
    assert not integration.is_ballistic
    integration.learn(np.array([2.0 * TELLING_M]), np.array([2.0 * TELLING_M]))
    assert integration.is_ballistic


@pytest.fixture
def libsumo() -> Iterator[ModuleType]:
    module = load_libsumo()
    yield module
    if module.isLoaded():
        module.close()


@pytest.mark.filterwarnings("ignore::xgv_cosim.script_warnings.SumoOptionsWarning")
def test_under_attach(tmp_path: Path, libsumo: ModuleType) -> None:
    """The reference stack brakes for a car that stands; SUMO has it where the plant has it."""
    stops = '<stop lane="road_0" endPos="380" duration="99"/>'
    config = write_config(tmp_path, car("front", 300, 6, extra=stops) + EGO, network("hello"))
    libsumo.start(["sumo", "-c", str(config), "--step-length", "0.1", "--no-step-log", *BALLISTIC])
    plugin = xgv_cosim.attach(libsumo)
    try:
        plugin.bind("ego")
        mirrored = 0
        for _ in range(250):
            libsumo.simulationStep()
            snapshot = plugin.snapshot
            row = snapshot.index_of.get("ego")
            if row is not None:
                assert snapshot.placement_error_m[row] <= 1e-6
                mirrored += snapshot.in_lane_frame[row]
        assert mirrored > 150
        assert libsumo.vehicle.getSpeed("ego") == 0.0
    finally:
        plugin.detach()
