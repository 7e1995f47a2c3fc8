from __future__ import annotations

import math

import numpy as np
import pytest

from tests.xgv_cosim.recording.conftest import _snapshot as make_snapshot
from xgv_cosim.metrics.placements import Placements


def test_each_vehicle_keeps_its_worst_step_and_its_share_of_mirrored_steps() -> None:
    placements = Placements()
    first = make_snapshot(
        "a",
        "other",
        "b",
        placement_error_m=np.array([0.01, 9.0, 0.0]),
        placement_error_rad=np.array([0.0, 9.0, 0.02]),
        in_lane_frame=np.array([True, False, False]),
    )
    placements.note(first, ("b", "a"), np.array([2, 0]))
    second = make_snapshot("a", placement_error_m=np.array([0.004]), in_lane_frame=np.array([False]))
    placements.note(second, ("a",), np.array([0]))
    rows = placements.rows()
    assert set(rows) == {"a", "b"}
    assert (rows["a"].placement_error_m, rows["a"].share_in_lane_frame) == (0.01, 0.5)
    assert rows["b"].placement_error_deg == pytest.approx(math.degrees(0.02))
    assert rows["b"].share_in_lane_frame == 0.0
