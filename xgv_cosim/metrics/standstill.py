"""Standstill: the one definition that metrics, expectations and reports share."""

from __future__ import annotations

import numpy as np

from xgv_cosim.columns import BoolColumn, FloatColumn

STANDSTILL_MPS = 0.1
"""Slower than this, either way, counts as standing."""
STANDSTILL_HELD_S = 0.5
"""A vehicle stands when its samples show it that slow for at least this long."""
_TOLERANCE_S = 1e-6
"""Far below the control tick; forgives the rounding of times."""


def is_slow(speed_mps: FloatColumn) -> BoolColumn:
    """Return at which samples the vehicle is slow enough to stand, shape ``(k,)``."""
    slow: BoolColumn = np.abs(speed_mps) < STANDSTILL_MPS
    return slow


def stops_of(t_s: FloatColumn, slow: BoolColumn) -> list[tuple[float, float]]:
    """Return (first, last) sample time of each unbroken series of samples at which the vehicle was slow."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]])))
    return [
        (float(t_s[begin]), float(t_s[end - 1])) for begin, end in zip(edges[::2], edges[1::2], strict=True)
    ]


def is_held(begin_s: float, end_s: float) -> bool:
    """Return whether being slow from ``begin_s`` to ``end_s`` is a standstill.

    A series that the end of the run cuts short of ``STANDSTILL_HELD_S`` is none: it cannot be judged.
    """
    return end_s - begin_s >= STANDSTILL_HELD_S - _TOLERANCE_S


def first_standstill_s(
    t_s: FloatColumn, speed_mps: FloatColumn, after_s: float, until_s: float
) -> float | None:
    """Return when the first standstill in ``[after_s, until_s]`` begins, None if there is none.

    Its hold may last beyond ``until_s``. A vehicle that stands at ``after_s`` already stands from then on,
    if it stays so for long enough.
    """
    for begin_s, end_s in stops_of(t_s, is_slow(speed_mps)):
        from_s = max(begin_s, after_s)
        if is_held(from_s, end_s):
            return from_s if from_s <= until_s + _TOLERANCE_S else None
    return None
