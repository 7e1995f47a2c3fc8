"""No small fault in the mode rules passes their tests, but for listed ones.

The mode rules are the modes and their tables, component control, the drivers' control and status, the
SafeStop's radio, errors, re-arming, and what keeps devices, controller and columns of a car in step.

``survivors.toml`` lists the faults that no test can or need see, each with its reason. A new survivor fails,
and so does a listed one that is killed or no longer exists: too long a list hides faults.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from tests.mutation.mutants import Mutant
from tests.mutation.running import mutants_of_module, survivors

ACCEPTED: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_name("survivors.toml").read_text(encoding="utf-8")
)
"""Reason by fault, by module."""

_XGV = "tests/xgv_cosim/vehicles/xgv"
_MODE_TESTS = [f"{_XGV}/test_xgv_{what}.py" for what in ("modes", "mode_defaults", "axes")]
_RADIO_TESTS = [f"{_XGV}/test_xgv_safestop{what}.py" for what in ("_frames", "")]
_DRIVER_TESTS = [f"{_XGV}/test_xgv_{what}.py" for what in ("drivers", "control")]
_STEP_TESTS = ["tests/xgv_cosim/simulation/test_safety_steps.py"]
TESTS_OF = {
    "jaus.component": [f"tests/jaus/test_component_{what}.py" for what in ("tables", "begins", "machine")],
    "xgv_cosim.vehicles.xgv.modes": _MODE_TESTS,
    "xgv_cosim.vehicles.xgv.tables": _MODE_TESTS,
    "xgv_cosim.vehicles.xgv.rearm": [f"{_XGV}/test_xgv_{what}.py" for what in ("rearm", "devices")],
    "xgv_cosim.vehicles.xgv.faults": [f"{_XGV}/test_xgv_faults.py"],
    "xgv_cosim.vehicles.transmitter": _RADIO_TESTS,
    "xgv_cosim.vehicles.xgv.safestop": _RADIO_TESTS,
    "xgv_cosim.vehicles.xgv.drivers": _DRIVER_TESTS,
    "xgv_cosim.vehicles.xgv.status": _DRIVER_TESTS,
    "xgv_cosim.vehicles.xgv.silence": _DRIVER_TESTS,
    "xgv_cosim.simulation.safety": _STEP_TESTS,
    "xgv_cosim.simulation.commanding": _STEP_TESTS,
}
"""Modules under test, and what has to find their faults, quickest first."""

PART_OF = {"xgv_cosim.simulation.commanding": ("meet_deadlines()", "next_deadline_s()")}
"""Of these modules only the faults of some functions: the rest is no mode rule."""


def mutants_under_test(module: str) -> tuple[str, list[Mutant]]:
    path, mutants = mutants_of_module(module)
    parts = PART_OF.get(module)
    return path, [mutant for mutant in mutants if parts is None or mutant.name.startswith(parts)]


@pytest.mark.slow
@pytest.mark.parametrize("module", TESTS_OF)
def test_only_the_listed_faults_survive(module: str, tmp_path: Path) -> None:
    path, mutants = mutants_under_test(module)
    assert len(mutants) > 10
    alive, accepted = survivors(module, path, mutants, TESTS_OF[module], tmp_path), set(ACCEPTED[module])
    new = sorted(alive - accepted)
    gone = sorted(accepted - alive)
    assert not new, f"{module}: faults that no test sees:\n" + "\n".join(new)
    assert not gone, f"{module}: listed as surviving, but killed or gone:\n" + "\n".join(gone)


def test_each_listed_survivor_has_a_reason() -> None:
    assert set(ACCEPTED) == set(TESTS_OF)
    for faults in ACCEPTED.values():
        assert [fault for fault, reason in faults.items() if len(reason) < 20] == []


@pytest.mark.parametrize("module", TESTS_OF)
def test_each_listed_survivor_is_a_fault_that_can_be_planted(module: str) -> None:
    """Quick, so that a change of the code shows at once that the list has to follow."""
    _, mutants = mutants_under_test(module)
    assert set(ACCEPTED[module]) <= {mutant.name for mutant in mutants}
