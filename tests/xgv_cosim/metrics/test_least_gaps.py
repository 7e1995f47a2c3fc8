"""Least gaps of all bound vehicles, against the plain minimum of all that was seen."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.metrics.gaps import LeastGaps

GAP = st.one_of(st.floats(0.0, 50.0), st.just(float("inf")))
STEP = st.dictionaries(st.sampled_from(["a", "b", "c"]), st.tuples(GAP, GAP))


@given(st.lists(STEP, max_size=12))
def test_the_least_gap_up_to_any_time_is_among_the_lows(steps) -> None:
    gaps = LeastGaps()
    for t_s, step in enumerate(steps):
        table = np.array(list(step.values())).reshape(-1, 2)
        gaps.note(float(t_s), list(step), table[:, 0], table[:, 1])
    lows = gaps.lows()
    assert set(lows) == {name for step in steps for name in step}
    for name, low in lows.items():
        for until in range(len(steps)):
            seen = [step[name] for step in steps[: until + 1] if name in step]
            if not seen:
                continue
            upto = low.t_s <= until
            assert low.ahead_m[upto].min() == min(ahead for ahead, _ in seen)
            assert low.behind_m[upto].min() == min(behind for _, behind in seen)
