"""A whole run on real traffic: its folder, its replay, and what stays when it ends badly."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import xgv_cosim
from xgv_cosim.errors import ScenarioError
from xgv_cosim.recording import EVENTS, LOCK, REPORT, RESULT, ROAD, TRACE, TRAJECTORY, read_trajectory
from xgv_cosim.runs.replay import replay


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


def test_replay_names_the_first_step_that_differs(hello: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(hello, other)
    lock = (other / LOCK).read_text()
    (other / LOCK).write_text(lock.replace("at_s: 5.0", "at_s: 6.0"))
    outcome = replay(other)
    assert not outcome.identical
    assert outcome.difference is not None
    assert outcome.difference.t_s == pytest.approx(5.1)  # paused at 5.0 in the record, not in the replay
    assert outcome.changed_inputs == ()


def test_a_missing_sumo_file_is_named_before_anything_is_made(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"no file 'nowhere.sumocfg'"):
        xgv_cosim.run("hello", out=tmp_path / "out", set=["world.sumo.config=nowhere.sumocfg"])
    assert not (tmp_path / "out").exists()


def test_a_fault_of_the_caller_is_raised_again_after_everything_was_written(tmp_path: Path) -> None:
    def careless(now_s: float, duration_s: float) -> None:
        if now_s > 1.0:
            raise ZeroDivisionError("division by zero")

    with pytest.raises(ZeroDivisionError):
        xgv_cosim.run("hello", out=tmp_path / "out", progress=careless)
    data = json.loads((tmp_path / "out" / RESULT).read_text())
    assert (data["status"], data["error"]) == ("error", "ZeroDivisionError: division by zero")
    assert read_trajectory(tmp_path / "out" / TRAJECTORY).num_rows > 0
