"""The same scenario and seed give the same trace: twenty times, in new processes, under load (slow)."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPEATS = 20
ONE_RUN = """
import sys, xgv_cosim
from pathlib import Path
result = xgv_cosim.run("urban_grid", seed=int(sys.argv[2]), set=sys.argv[3:], out=sys.argv[1], report=False)
print(result.trace_hash)
"""
SHORT = [
    "duration_s=25",
    "expect=[]",
    "injections=[{at_s: 12.34, vehicles: xgv_0, kind: estop_pause}, {at_s: 15, vehicles: '*', kind: link}]",
    "safestop.loss_share=0.2",
]
BURNER = "while True: pass"


def trace_hash(folder: Path, seed: int) -> str:
    command = [sys.executable, "-c", ONE_RUN, str(folder), str(seed), *SHORT]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=300, cwd=folder.parent, env=os.environ
    )
    return done.stdout.split()[-1]


@pytest.mark.slow
def test_twenty_runs_in_new_processes_leave_one_trace(tmp_path: Path) -> None:
    """Every second run while another process keeps a core busy; another seed leaves another trace."""
    hashes = []
    for number in range(REPEATS):
        burner = subprocess.Popen([sys.executable, "-c", BURNER]) if number % 2 else None
        try:
            hashes.append(trace_hash(tmp_path / str(number), seed=3))
        finally:
            if burner is not None:
                burner.kill()
                burner.wait()
    assert len(set(hashes)) == 1
    assert trace_hash(tmp_path / "other", seed=4) != hashes[0]
