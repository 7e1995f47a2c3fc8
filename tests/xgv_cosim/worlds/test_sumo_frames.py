"""SUMO's degrees clockwise from north and the internal radians counter-clockwise from east."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.worlds.sumo.frames import angle_to_sumo, headings_from_sumo


@pytest.mark.parametrize(
    ("angle_deg", "heading_rad"), [(0, math.pi / 2), (90, 0), (180, -math.pi / 2), (270, math.pi)]
)
def test_compass_points(angle_deg: float, heading_rad: float) -> None:
    assert headings_from_sumo(np.array([angle_deg]))[0] == pytest.approx(heading_rad)
    assert angle_to_sumo(heading_rad) == pytest.approx(angle_deg)


@given(st.floats(-50.0, 50.0))
def test_there_and_back(heading_rad: float) -> None:
    angle_deg = angle_to_sumo(heading_rad)
    back = float(headings_from_sumo(np.array([angle_deg]))[0])
    assert 0.0 <= angle_deg < 360.0
    assert -math.pi <= back <= math.pi
    assert math.cos(back) == pytest.approx(math.cos(heading_rad), abs=1e-12)
    assert math.sin(back) == pytest.approx(math.sin(heading_rad), abs=1e-12)
