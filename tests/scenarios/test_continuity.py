"""No car jumps: position and heading of every bound car stay continuous through every hand-over."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import xgv_cosim
from xgv_cosim.recording import TRAJECTORY, read_trajectory


@pytest.mark.slow
def test_no_bound_car_of_the_freeway_jumps(tmp_path: Path) -> None:
    """Point 1.10: also where SUMO's driver has the car and changes lanes, and where he gives it back."""
    xgv_cosim.run("freeway_estop", seed=7, out=tmp_path / "out", report=False)
    track = read_trajectory(tmp_path / "out" / TRAJECTORY)
    bound = [name for name, rows in track.rows_of.items() if track.bound[rows].any()]
    assert len(bound) == 24
    for name in bound:
        rows = track.rows_of[name]
        x, y, heading, speed = (track[column][rows] for column in ("x", "y", "heading", "measured_speed"))
        east, north = np.diff(x), np.diff(y)
        sideways = np.abs(-np.sin(heading[:-1]) * east + np.cos(heading[:-1]) * north)
        along = np.cos(heading[:-1]) * east + np.sin(heading[:-1]) * north
        turned = np.abs(np.remainder(np.diff(heading) + np.pi, 2.0 * np.pi) - np.pi)
        assert sideways.max() < 0.2, name
        assert np.abs(along - 0.05 * (speed[1:] + speed[:-1])).max() < 0.3, name
        assert turned.max() < 0.05, name
