"""A whole run on real traffic: its folder, its replay, and what stays when it ends badly."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import xgv_cosim
from xgv_cosim.errors import ScenarioError, WorldConfigurationError
from xgv_cosim.recording import EVENTS, LOCK, REPORT, RESULT, ROAD, TRACE, TRAJECTORY, read_trajectory
from xgv_cosim.runs.replay import replay

COMMAND = [sys.executable, "-m", "xgv_cosim"]


def call(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, cwd=cwd, check=False)


@pytest.fixture(scope="module")
def hello(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "hello"
    result = xgv_cosim.run("hello", seed=3, out=folder)
    assert result.status == "ok"
    return folder


def test_the_folder_holds_what_the_documentation_names(hello: Path) -> None:
    present = {entry.name for entry in hello.iterdir()}
    assert present == {RESULT, EVENTS, TRACE, TRAJECTORY, ROAD, LOCK, REPORT}


def test_the_result_tells_what_happened(hello: Path) -> None:
    data = json.loads((hello / RESULT).read_text())
    assert data["schema"] == "xgv-cosim/result/1"
    assert (data["scenario"], data["seed"], data["status"]) == ("hello", 3, "ok")
    assert {"xgv-cosim", "libsumo", "ruckig", "python"} <= set(data["versions"])
    assert len(data["trace_hash"]) == 64
    assert data["real_time_factor"] > 0.0
    assert data["collisions"] == []
    paused = data["vehicles"]["xgv_0"]
    (injection,) = paused["injections"]
    assert injection.pop("metrics").items() <= paused["metrics"].items()
    assert injection == {"kind": "estop_pause", "code": None, "at_s": 5.0, "end_s": 17.0}
    assert paused["metrics"]["stopping_distance_ratio"] == pytest.approx(1.0, abs=0.05)
    assert [mode["safety_mode"] for mode in paused["modes"]][-3:] == [
        "drive_by_wire",
        "estop_pause",
        "drive_by_wire",
    ]
    exercised = {row["rule"] for row in data["assumptions"] if row["exercised"]}
    assert "XGV-36" in exercised
    assert all(
        {"rule", "key", "value", "evidence", "text", "exercised"} <= set(row) for row in data["assumptions"]
    )


def test_events_are_rows_in_time_order(hello: Path) -> None:
    rows = [json.loads(line) for line in (hello / EVENTS).read_text().splitlines()]
    assert all(set(row) == {"t_s", "vehicle", "kind", "from", "to", "reasons"} for row in rows)
    assert [row["t_s"] for row in rows] == sorted(row["t_s"] for row in rows)
    assert {
        "t_s": 5.0,
        "vehicle": "xgv_0",
        "kind": "injection",
        "from": "",
        "to": "estop_pause",
        "reasons": [],
    } in rows


def test_the_trajectory_keeps_commanded_and_measured_apart(hello: Path) -> None:
    """G8: while paused the commanded speed stays what the stack asked, the measured one is zero."""
    trajectory = read_trajectory(hello / TRAJECTORY)
    rows = trajectory.rows_of["xgv_0"]
    standing = trajectory["measured_speed"][rows] == 0.0
    assert standing.sum() > 20
    assert (trajectory["commanded_speed"][rows][standing] >= 0.0).all()
    moving = trajectory["measured_speed"][rows] > 5.0
    assert (trajectory["commanded_speed"][rows][moving] != trajectory["measured_speed"][rows][moving]).any()
    assert {"commanded_curvature", "measured_curvature"} <= set(trajectory.values)


def test_replay_is_identical_in_a_new_process(hello: Path) -> None:
    done = call("replay", str(hello), "--json", cwd=hello)
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)
    assert row["identical"] is True
    assert row["replayed_hash"] == json.loads((hello / RESULT).read_text())["trace_hash"]


def test_replay_names_the_first_step_that_differs(hello: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    xgv_cosim.run("hello", seed=3, out=other, report=False)  # the seed of the record
    (other / LOCK).write_text((hello / LOCK).read_text().replace("at_s: 5.0", "at_s: 6.0"))
    outcome = replay(other)
    assert not outcome.identical
    assert outcome.difference is not None
    assert outcome.difference.t_s == pytest.approx(5.1)  # paused at 5.0 in the record, not in the replay
    assert outcome.changed_inputs == ()


def test_an_expectation_that_fails_is_exit_code_1(tmp_path: Path) -> None:
    wanted = "expect=[{vehicle: xgv_0, mode: estop_disable, by_s: 2.0}]"
    done = call(
        "run",
        "hello",
        "--out",
        "out",
        "--set",
        "duration_s=4",
        "--set",
        "injections=[]",
        "--set",
        wanted,
        cwd=tmp_path,
    )
    assert done.returncode == 1, done.stderr
    assert "estop_disable" in done.stdout
    assert json.loads((tmp_path / "out" / RESULT).read_text())["status"] == "failed"


def test_an_injection_into_an_unknown_vehicle_is_a_warning_and_the_run_goes_on(tmp_path: Path) -> None:
    wanted = "injections=[{at_s: 2, vehicles: xgv_00, kind: door}]"
    options = ["--set", "duration_s=4", "--set", "expect=[]", "--set", wanted]
    done = call("run", "hello", "--out", "out", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "out" / RESULT).read_text())
    assert (data["status"], data["num_steps"]) == ("ok", 40)
    why = "the world knows no vehicle of this name now; did you mean 'xgv_0'?"
    assert data["warnings"] == [f"xgv_00: injection door at 2 s did not act ({why})"]
    assert data["warnings"][0] in " ".join(done.stdout.split())


def test_a_missing_sumo_file_is_named_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"no file 'nowhere.sumocfg'"):
        xgv_cosim.run("hello", out=tmp_path / "out", set=["world.sumo.config=nowhere.sumocfg"])
    assert not (tmp_path / "out").exists()


def test_a_configuration_that_sumo_refuses_is_exit_code_2_with_its_words(tmp_path: Path) -> None:
    assert call("init", "mine", cwd=tmp_path).returncode == 0
    network = next((tmp_path / "mine").glob("*.net.xml"))
    network.write_text("<net></net>")
    done = call("run", "mine", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "SUMO" in done.stderr
    assert "Traceback" not in done.stderr
    with pytest.raises(WorldConfigurationError):
        xgv_cosim.run(tmp_path / "mine", out=tmp_path / "again")
    data = json.loads((tmp_path / "again" / RESULT).read_text())
    assert (data["status"], data["warnings"]) == ("error", [])  # that nobody was bound is not the trouble


def interrupted(*arguments: str, cwd: Path) -> tuple[int, str, str]:
    """Send Ctrl-C to a command once it says on stderr that it simulates; return how it ended."""
    child = subprocess.Popen(
        [*COMMAND, *arguments], cwd=cwd, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with child:
        try:
            assert child.stderr is not None
            said = ""
            for line in child.stderr:  # ends with the child, if it says nothing of the kind
                said += line
                if "s simulated" in line:
                    break
            child.send_signal(signal.SIGINT)
            out, errors = child.communicate(timeout=120)
        finally:
            child.kill()
    return child.returncode, out, said + errors


def test_an_interrupt_leaves_a_readable_partial_folder_and_exit_code_130(tmp_path: Path) -> None:
    options = ["--set", "duration_s=2000", "--set", "expect=[]"]
    code, _, errors = interrupted("run", "hello", "--out", "out", *options, cwd=tmp_path)
    assert code == 130, errors
    assert "s simulated" in errors
    data = json.loads((tmp_path / "out" / RESULT).read_text())
    assert data["status"] == "interrupted"
    assert 0 < data["num_steps"] < 20_000
    assert read_trajectory(tmp_path / "out" / TRAJECTORY).num_rows > 0
    assert (tmp_path / "out" / REPORT).stat().st_size > 10_000


def test_an_interrupted_replay_gives_no_verdict_and_exit_code_130(tmp_path: Path) -> None:
    xgv_cosim.run("hello", out=tmp_path / "out", set=["duration_s=20", "expect=[]"], report=False)
    recorded = json.loads((tmp_path / "out" / RESULT).read_text())
    (tmp_path / "out" / RESULT).write_text(json.dumps(recorded | {"num_steps": 20_000}))  # long enough
    code, out, errors = interrupted("replay", "out", cwd=tmp_path)
    assert code == 130, errors
    assert out == ""


def test_the_table_is_plain_lines_without_a_terminal(tmp_path: Path) -> None:
    done = call("run", "hello", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith("vehicle: xgv_0; injected: estop_pause 5 s to 17 s; modes and reasons: ")
    assert "SafeStop pause relay" in first
    assert "\x1b" not in done.stdout
    quiet = call("run", "hello", "--quiet", "--out", "quiet", cwd=tmp_path)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")


def test_a_fault_of_the_caller_is_raised_again_after_everything_was_written(tmp_path: Path) -> None:
    def careless(now_s: float, duration_s: float) -> None:
        if now_s > 1.0:
            raise ZeroDivisionError("division by zero")

    with pytest.raises(ZeroDivisionError):
        xgv_cosim.run("hello", out=tmp_path / "out", progress=careless)
    data = json.loads((tmp_path / "out" / RESULT).read_text())
    assert (data["status"], data["error"]) == ("error", "ZeroDivisionError: division by zero")
    assert read_trajectory(tmp_path / "out" / TRAJECTORY).num_rows > 0
