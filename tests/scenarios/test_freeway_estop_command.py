"""The whole example as a newcomer runs it, from the command line, and again as a replay."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

COMMAND = [sys.executable, "-c", "from xgv_cosim.cli import main; main()"]


def xgv_cosim(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_freeway_estop_is_as_expected_and_replays_in_a_new_process(tmp_path: Path, seed: int) -> None:
    folder = tmp_path / "run"
    ran = xgv_cosim("run", "freeway_estop", "--seed", str(seed), "--out", str(folder), "--quiet")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert result["seed"] == seed
    assert result["collisions"] == []
    assert len(result["vehicles"]) >= 20
    for name in ("events.jsonl", "trajectory.parquet", "scenario.lock.yaml", "report.html"):
        assert (folder / name).stat().st_size > 0

    replayed = xgv_cosim("replay", str(folder), "--json")
    assert replayed.returncode == 0, replayed.stderr
    report = json.loads(replayed.stdout)
    assert report["identical"] is True
    assert report["replayed_hash"] == result["trace_hash"]
