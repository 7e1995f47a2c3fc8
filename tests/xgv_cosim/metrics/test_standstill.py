"""Standstill: its two thresholds, and the end of a run."""

from __future__ import annotations

import numpy as np
import pytest

from xgv_cosim.metrics.standstill import first_standstill_s

T_S = np.round(np.arange(1, 201) * 0.1, 9)


def speeds(*stops: tuple[float, float], slow_mps: float = 0.05) -> np.ndarray:
    slow = np.zeros(T_S.shape, bool)
    for first, last in stops:
        slow |= np.abs(T_S - (first + last) / 2.0) <= (last - first) / 2.0 + 1e-9
    return np.where(slow, slow_mps, 5.0)


@pytest.mark.parametrize(("held_s", "found"), [(0.3, None), (0.4, None), (0.5, 10.0), (0.6, 10.0)])
def test_it_is_held_for_half_a_second_and_no_less(held_s, found) -> None:
    """0.4 s is not enough, at the end of the run neither; 0.5 s is."""
    assert first_standstill_s(T_S, speeds((10.0, 10.0 + held_s)), 5.0, 20.0) == found
    at_end = first_standstill_s(T_S, speeds((20.0 - held_s, 20.0)), 5.0, 20.0)
    assert at_end == (None if found is None else pytest.approx(20.0 - held_s))


@pytest.mark.parametrize(("slow_mps", "found"), [(0.099, 10.0), (-0.099, 10.0), (0.1, None), (-0.1, None)])
def test_it_is_slower_than_a_tenth_either_way(slow_mps, found) -> None:
    assert first_standstill_s(T_S, speeds((10.0, 12.0), slow_mps=slow_mps), 5.0, 20.0) == found


def test_the_window_and_a_vehicle_that_stands_already() -> None:
    stops = speeds((3.0, 3.2), (8.0, 12.0))
    assert first_standstill_s(T_S, stops, 0.0, 20.0) == 8.0
    assert first_standstill_s(T_S, stops, 0.0, 8.0) == 8.0
    assert first_standstill_s(T_S, stops, 0.0, 7.9) is None
    assert first_standstill_s(T_S, stops, 9.03, 20.0) == 9.03
    assert first_standstill_s(T_S, stops, 11.7, 20.0) is None
