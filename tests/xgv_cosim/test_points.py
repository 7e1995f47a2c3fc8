"""Points: a sequence of pairs over a matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.points import Points

pairs = st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)))


@given(pairs, st.slices(8))
def test_it_is_the_sequence_of_its_rows(rows: list[tuple[float, float]], part: slice) -> None:
    points = Points(np.array(rows).reshape(-1, 2))
    assert isinstance(points, Sequence)
    assert (len(points), list(points), bool(points)) == (len(rows), rows, bool(rows))
    assert points == rows
    assert points == tuple(rows)
    assert points[part] == rows[part]
    for number, row in enumerate(rows):
        assert points[number] == row
    np.testing.assert_array_equal(np.asarray(points), np.array(rows).reshape(-1, 2))


def test_numpy_takes_the_matrix_as_it_is_and_may_not_write_to_it() -> None:
    matrix = np.arange(6.0).reshape(3, 2)
    points = Points(matrix)
    taken = np.asarray(points)
    assert np.shares_memory(taken, matrix)
    with pytest.raises(ValueError, match="read-only"):
        taken[0, 0] = 1.0
    own = np.array(points)
    own[0, 0] = 9.0
    assert points[0] == (0.0, 1.0)
    assert points != [(9.0, 1.0)]
    assert points != 3
    assert repr(points) == "((0.0, 1.0), (2.0, 3.0), (4.0, 5.0))"
    with pytest.raises(IndexError):
        _ = points[3]
