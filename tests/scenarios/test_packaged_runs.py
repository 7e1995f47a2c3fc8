"""Every packaged scenario from the command line: as expected, nobody lost (slow)."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import sumo_scenarios

COMMAND = [sys.executable, "-c", "from xgv_cosim.cli import main; main()"]
NAMES = [info.name for info in sumo_scenarios.list_scenarios() if info.name != "freeway_estop"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_packaged_scenario_is_as_expected(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "run"
    ran = subprocess.run(
        [*COMMAND, "run", name, "--out", str(folder), "--quiet"], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert len(result["expectations"]) >= 5
    assert result["collisions"] == []
    assert result["teleports"] == []
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert {tuple(event["reasons"]) for event in events if event["kind"] == "released"} <= {("arrived",)}
    if name == "curve":
        (left,) = [event for event in events if event["to"] == "off_road"]
        assert left["vehicle"] == "xgv_2"  # disabled with nobody aboard
