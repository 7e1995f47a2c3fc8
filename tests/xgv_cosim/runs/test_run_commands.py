"""Runs and replays by command, in processes of their own: exit codes, what they say, what they leave."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import xgv_cosim
from tests.xgv_cosim.runs.commands import call
from xgv_cosim.errors import WorldConfigurationError
from xgv_cosim.recording import RESULT


def test_replay_is_identical_in_a_new_process(tmp_path: Path) -> None:
    paused = "injections=[{at_s: 2, vehicles: xgv_0, kind: estop_pause}]"
    options = ["duration_s=5", "expect=[]", paused]
    recorded = xgv_cosim.run("hello", seed=3, out=tmp_path / "out", set=options, report=False)
    done = call("replay", "out", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)
    assert row["identical"] is True
    assert row["replayed_hash"] == recorded.trace_hash


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


def test_the_table_is_plain_lines_without_a_terminal(tmp_path: Path) -> None:
    paused = "injections=[{at_s: 1.5, vehicles: xgv_0, kind: estop_pause, duration_s: 1}]"
    options = ["--set", "duration_s=4", "--set", "expect=[]", "--set", paused]
    done = call("run", "hello", *options, "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first = done.stdout.splitlines()[0]
    assert first.startswith("vehicle: xgv_0; injected: estop_pause 1.5 s to 2.5 s; modes and reasons: ")
    assert "SafeStop pause relay" in first
    assert "\x1b" not in done.stdout
    quiet = call("run", "hello", *options, "--quiet", "--out", "quiet", cwd=tmp_path)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
