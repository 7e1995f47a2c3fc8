"""The cache of machine code, end to end: a copy of the sources, one edited callee, fresh processes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import jaus
import xgv_cosim

ROLLS = """
import numpy as np
from xgv_cosim import kernel
from xgv_cosim.fleet_columns import Reference, idle_motion, idle_setpoints
from xgv_cosim.parameters import VehicleParameters, parameter_columns
motion = idle_motion(1)
motion.speed_mps[:] = 10.0
reference = Reference(*(np.zeros(1) for _ in Reference._fields))
after, _ = kernel.advance(motion, reference, idle_setpoints(1), parameter_columns(VehicleParameters(), 1), 1)
print(float(after.x_m[0]), sum(kernel._advance_compiled.stats.cache_hits.values()), xgv_cosim_file())
"""


@pytest.mark.slow
def test_machine_code_is_made_anew_when_a_called_module_was_edited(tmp_path: Path) -> None:
    """``kernel/loop.py`` calls ``plant/pose.py``, which numba's own cache does not see."""
    for package in (jaus, xgv_cosim):
        source = Path(package.__file__).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    callee = tmp_path / "xgv_cosim" / "plant" / "pose.py"
    text = callee.read_text(encoding="utf-8")

    def roll() -> tuple[float, int]:
        env = os.environ | {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
        code = "import xgv_cosim\ndef xgv_cosim_file():\n    return xgv_cosim.__file__\n" + ROLLS
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True)
        x_m, hits, file = done.stdout.split()
        assert Path(file).is_relative_to(tmp_path)
        return float(x_m), int(hits)

    first, hits = roll()
    assert hits == 0
    assert 0.05 < first < 0.15
    assert roll() == (first, 1)
    edited = text.replace("return x_m + chord_m * ", "return x_m + 2.0 * chord_m * ")
    assert edited != text
    callee.write_text(edited, encoding="utf-8")
    second, hits = roll()
    assert hits == 0
    assert second == pytest.approx(2.0 * first)
    callee.write_text(text, encoding="utf-8")
    assert roll() == (first, 1)
