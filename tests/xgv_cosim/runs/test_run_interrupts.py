"""Ctrl-C during a run and during a replay."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path

import xgv_cosim
from tests.xgv_cosim.runs.commands import COMMAND
from xgv_cosim.recording import REPORT, RESULT, TRAJECTORY, read_trajectory


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
    options = ["--set", "duration_s=250", "--set", "expect=[]"]
    code, _, errors = interrupted("run", "hello", "--out", "out", *options, cwd=tmp_path)
    assert code == 130, errors
    assert "s simulated" in errors
    data = json.loads((tmp_path / "out" / RESULT).read_text())
    assert data["status"] == "interrupted"
    assert 0 < data["num_steps"] < 2_500
    assert read_trajectory(tmp_path / "out" / TRAJECTORY).num_rows > 0
    assert (tmp_path / "out" / REPORT).stat().st_size > 10_000


def test_an_interrupted_replay_gives_no_verdict_and_exit_code_130(tmp_path: Path) -> None:
    xgv_cosim.run(
        "hello", out=tmp_path / "out", set=["duration_s=3", "expect=[]", "injections=[]"], report=False
    )
    recorded = json.loads((tmp_path / "out" / RESULT).read_text())
    (tmp_path / "out" / RESULT).write_text(json.dumps(recorded | {"num_steps": 2_500}))  # long enough
    code, out, errors = interrupted("replay", "out", cwd=tmp_path)
    assert code == 130, errors
    assert out == ""
