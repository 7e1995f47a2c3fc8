"""Writing and reading trajectories loads no library that they do not need."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

WRITES_AND_READS = """
import sys
from pathlib import Path
from xgv_cosim.recording import read_trajectory
from xgv_cosim.recording.buffer import TrajectoryBuffer
from xgv_cosim.recording.trajectory import trajectory_file
path = Path(sys.argv[1])
path.write_bytes(trajectory_file(TrajectoryBuffer(), ("a",), {0: "drive_by_wire"}))
assert read_trajectory(path).num_rows == 0
print("pyarrow" in sys.modules, "pandas" in sys.modules)
"""


@pytest.mark.skipif(importlib.util.find_spec("pandas") is None, reason="pandas is not here to be loaded")
def test_trajectories_do_without_pandas(tmp_path: Path) -> None:
    """pyarrow imports it wherever it is installed, when it is given arrays: half a second of every run."""
    command = [sys.executable, "-c", WRITES_AND_READS, str(tmp_path / "trajectory.parquet")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "False"]
