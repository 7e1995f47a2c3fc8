"""Quantisation: a value comes back within half a quantum, and no value stays no value."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.recording.quantities import BOUND_VEHICLES, EVERY_VEHICLE, LARGEST, NULL, dequantise, quantise

SCALES = sorted({quantity.scale for quantity in (*EVERY_VEHICLE, *BOUND_VEHICLES)})


@given(st.lists(st.floats(-1e4, 1e4), min_size=1), st.sampled_from(SCALES))
def test_round_trip_is_within_half_a_quantum(values: list[float], scale: float) -> None:
    column = np.array(values)
    back = dequantise(quantise(column, scale), scale)
    assert np.all(np.abs(back - column) <= 0.5 * scale * (1.0 + 1e-6))


@given(st.integers(-(10**9), 10**9), st.sampled_from(SCALES))
def test_a_whole_number_of_quanta_comes_back_exactly(number: int, scale: float) -> None:
    numbers = np.array([number])
    assert quantise(dequantise(numbers, scale), scale)[0] == number


def test_what_is_not_finite_becomes_null() -> None:
    numbers = quantise(np.array([np.nan, np.inf, -np.inf, 1.0]), 0.01)
    assert numbers.tolist() == [NULL, NULL, NULL, 100]
    assert np.isnan(dequantise(numbers, 0.01)).tolist() == [True, True, True, False]


def test_what_is_too_large_is_held_at_the_end_and_never_becomes_null() -> None:
    assert quantise(np.array([1e300, -1e300]), 0.01).tolist() == [LARGEST, NULL + 1]


def test_every_scale_has_a_whole_inverse() -> None:
    """``dequantise`` divides by it."""
    assert all(abs(1.0 / scale - round(1.0 / scale)) < 1e-6 for scale in SCALES)
