"""Rows of ``result.json`` from made-up events."""

from __future__ import annotations

import numpy as np
import pytest

from tests.xgv_cosim.metrics.test_stop_metrics import braking_series
from xgv_cosim.events import Event
from xgv_cosim.runs.vehicles import injections_of, vehicle_rows


def injection(t_s: float, before: str, after: str, *reasons: str, vehicle: str = "a") -> Event:
    return Event(t_s, vehicle, "injection", before, after, reasons)


def test_overlapping_errors_end_each_by_its_code() -> None:
    rows = injections_of(
        [
            injection(1.0, "", "error", "code 9109"),
            injection(2.0, "", "error", "code 9110"),
            injection(3.0, "error", "", "code 9109"),
            injection(4.0, "", "door"),
            injection(5.0, "error", "", "code 9110"),
        ]
    )
    assert [tuple(row.values()) for row in rows] == [
        ("error", 9109, 1.0, 3.0),
        ("error", 9110, 2.0, 5.0),
        ("door", None, 4.0, None),
    ]


def test_each_injection_carries_its_own_metrics() -> None:
    series = braking_series(20.0, 2.5, 5.0)
    again = braking_series(10.0, 5.0, 25.0)
    second = series.t_s >= 20.0
    both = series._replace(
        **{
            name: np.where(second, getattr(again, name), getattr(series, name))
            for name in ("speed_mps", "accel_mps2", "distance_m", "demanded_decel_mps2")
        }
    )
    events = [
        Event(0.0, "a", "bound"),
        injection(5.0, "", "estop_pause"),
        injection(14.0, "estop_pause", ""),
        injection(25.0, "", "estop_disable"),
        Event(0.0, "b", "bound"),
        Event(0.0, "a", "safety_mode", after="drive_by_wire"),
        Event(0.0, "b", "safety_mode", after="drive_by_wire"),
    ]
    rows = vehicle_rows({"a": both}, events, (), 40.0)
    first, last = (row["metrics"] for row in rows["a"]["injections"])
    assert first["ideal_stopping_distance_m"] == pytest.approx(80.0)
    assert last["ideal_stopping_distance_m"] == pytest.approx(10.0)
    assert first.items() <= rows["a"]["metrics"].items()
    assert rows["b"]["injected"] is False
