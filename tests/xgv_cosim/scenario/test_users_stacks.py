"""Stacks named in a scenario: the user's own class, what is wrong with it, and a run in which it fails."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from xgv_cosim import ScenarioError, simulate
from xgv_cosim.events import Event
from xgv_cosim.scenario.loading import examine_scenario

HELLO = Path(__file__).parents[3] / "sumo_scenarios" / "hello"
EXAMPLE = Path(__file__).parents[3] / "examples" / "my_stack.py"


class Events:
    """An observer that keeps the events."""

    def __init__(self) -> None:
        self.kept: list[Event] = []

    def record_event(self, event: Event) -> None:
        self.kept.append(event)

    def record_step(self, *_: object) -> None:
        """Nothing to keep."""

    def of(self, kind: str) -> list[Event]:
        return [event for event in self.kept if event.kind == kind]


def scenario(folder: Path, stack: str, module: str | None = None, extra: str = "") -> Path:
    """Write a scenario whose first car is driven by a stack, and return its file."""
    for file in (*HELLO.glob("*.xml"), *HELLO.glob("*.sumocfg")):
        shutil.copy(file, folder)
    if module is not None:
        (folder / f"{stack.partition(':')[0]}.py").write_text(module)
    file = folder / "s.yaml"
    file.write_text(
        "schema: xgv-cosim/scenario/1\nname: mine\nduration_s: 20\n"
        "world: {sumo: {config: hello.sumocfg}}\nbind:\n"
        f'  - {{vehicles: xgv_0, stack: "{stack}"{extra}}}\n  - {{vehicles: "xgv_*"}}\n'
    )
    return file


def test_the_example_drives_at_its_speed(tmp_path: Path) -> None:
    file = scenario(tmp_path, "my_stack:MyStack", EXAMPLE.read_text(), ", stack_options: {speed_mps: 8.0}")
    seen = Events()
    with simulate(file, observers=[seen]) as run:
        run.run_until(20.0)
        motion, slot = run.fleet.motion, run.fleet.slot_of("xgv_0")
        assert motion.speed_mps[slot] == pytest.approx(8.0, abs=0.1)
        row = run.snapshot.index_of["xgv_0"]
        assert run.snapshot.lane[row] >= 0
    assert not seen.of("stack_failed")


RAISES = """
class Mine:
    def __init__(self, vehicle_id):
        self.vehicle_id, self.calls = vehicle_id, 0
    def act(self, seen):
        self.calls += 1
        raise RuntimeError(f"{self.vehicle_id} call {self.calls}")
"""
NONSENSE = """
from xgv_cosim.commands import MotionProfile
class Mine:
    def __init__(self): self.calls = 0
    def act(self, seen):
        self.calls += 1
        kind = self.calls % 3
        nan = float("nan")
        return ["go"] if kind == 1 else None if kind == 0 else [MotionProfile(nan, 1.0, 0.0, 0.1, 0.4)]
"""
STILLBORN = "class Mine:\n    def __init__(self): raise OSError('no model')\n    def act(self, seen): ...\n"
FORGETS = """
import my_parent_of_stacks
class Mine(my_parent_of_stacks.Parent):
    def act(self, seen):
        return super().act(seen) if seen.time_s < 6.0 else 1 / 0
"""


@pytest.mark.parametrize(
    ("module", "expected"),
    [
        (RAISES, ["RuntimeError: xgv_0 call 1"]),
        (
            NONSENSE,
            [
                "act returned a list with str",
                "CommandError: MotionProfile.speed_mps: got nan",
                "act returned NoneType",
            ],
        ),
        (STILLBORN, ["OSError: no model"]),
    ],
)
def test_a_stack_that_fails_is_told_once_per_kind_and_the_run_goes_on(
    tmp_path: Path, module: str, expected: list[str]
) -> None:
    seen = Events()
    with simulate(scenario(tmp_path, "broken:Mine", module), observers=[seen]) as run:
        run.run_until(5.0)
        assert "xgv_0" in run.vehicle_ids
    failed = seen.of("stack_failed")
    assert len(failed) == len(expected)
    for event, text in zip(failed, expected, strict=True):
        assert event.vehicle == "xgv_0"
        assert text in event.reasons[0]


def test_a_stack_that_begins_to_fail_leaves_its_car_to_the_command_timeout_xgv_43(tmp_path: Path) -> None:
    """XGV-43: the last command has ended 0.4 s after it; then the car is paused and stands."""
    (tmp_path / "my_parent_of_stacks.py").write_text(EXAMPLE.read_text().replace("MyStack", "Parent"))
    seen = Events()
    with simulate(scenario(tmp_path, "late:Mine", FORGETS), observers=[seen]) as run:
        run.run_until(20.0)
        slot = run.fleet.slot_of("xgv_0")
        assert run.fleet.motion.speed_mps[slot] == pytest.approx(0.0, abs=1e-6)
    (failed,) = seen.of("stack_failed")
    assert "ZeroDivisionError" in failed.reasons[0]
    assert "late.py:5" in failed.reasons[0]
    left = [e.t_s for e in seen.of("safety_mode") if e.vehicle == "xgv_0" and e.before == "drive_by_wire"]
    assert left
    assert 6.0 <= left[0] <= 6.7


@pytest.mark.parametrize(
    ("stack", "module", "extra", "expected"),
    [
        ("absent:Mine", None, "", "there is no module 'absent'"),
        ("broken:Mine", "import nothing_of_that_name", "", "module 'broken' needs 'nothing_of_that_name'"),
        ("broken:Mine", "1 / 0", "", "module 'broken' cannot be imported: ZeroDivisionError"),
        ("broken:Mine", "class Mime:\n    def act(self, seen): ...", "", "(did you mean 'Mime'?)"),
        ("broken:Mine", "class Mine: ...", "", "has no method act(self, observation); write one"),
        ("broken:Mine", "Mine = 7", "", "broken:Mine is int, expected a class"),
        ("broken:Mine", STILLBORN, ", stack_options: {speed: 1}", "unexpected keyword argument 'speed'"),
        ("refrence", None, "", "(did you mean 'reference'?)"),
        ("reference", None, ", stack_options: {speed: 1}", "stack_options go with a class of your own"),
    ],
)
def test_a_stack_that_cannot_be_had_is_a_mistake_of_the_scenario(
    tmp_path: Path, stack: str, module: str | None, extra: str, expected: str
) -> None:
    file = scenario(tmp_path, stack, module, extra)
    problems = [str(problem) for problem in examine_scenario(file).problems]
    assert any(expected in problem and "s.yaml:6:" in problem for problem in problems), problems
    with pytest.raises(ScenarioError):
        simulate(file)


def test_two_folders_may_have_modules_of_the_same_name(tmp_path: Path) -> None:
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        text = f"class Mine:\n    def act(self, seen): raise ValueError({name!r})\n"
        seen = Events()
        with simulate(scenario(folder, "same:Mine", text), observers=[seen]) as run:
            run.step()
            run.step()
        assert name in seen.of("stack_failed")[0].reasons[0]
