"""Seconds per axis with nobody in control, from the event log (XGV-64)."""

from __future__ import annotations

from xgv_cosim.events import Event
from xgv_cosim.runs.vehicles import time_without_control_s


def test_seconds_with_nobody_in_control_are_counted_per_axis_xgv_64() -> None:
    events = [
        Event(0.1, "a", "speed_control", "driver", "computer"),
        Event(5.0, "a", "steering_control", "computer", "nobody"),
        Event(6.0, "a", "steering_control", "nobody", "driver"),
        Event(8.0, "a", "steering_control", "driver", "nobody"),
    ]
    assert time_without_control_s(events, 10.0) == {"speed": 0.0, "steering": 3.0}
    released = [Event(7.0, "b", "speed_control", "computer", "nobody")]
    assert time_without_control_s(released, 10.0) == {"speed": 3.0, "steering": 0.0}
    assert time_without_control_s([], 10.0) == {"speed": 0.0, "steering": 0.0}
