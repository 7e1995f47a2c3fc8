"""Least gaps of every bound vehicle, kept as the sparse series of their new lows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xgv_cosim.columns import FloatColumn


class GapLows(NamedTuple):
    """How one vehicle's least gaps went down: a row whenever either was the least so far, shape ``(k,)``."""

    t_s: FloatColumn
    ahead_m: FloatColumn
    """Least gap to the leader up to then, bumper to bumper; ``inf``: there never was one."""
    behind_m: FloatColumn
    """Least gap to the follower up to then, likewise."""


class LeastGaps:
    """Running minima of all vehicles at once. The least gap up to any time can be read afterwards."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._least_m = np.full((0, 2), np.nan)
        self._lows: list[FloatColumn] = []
        """Tables of (vehicle number, time, ahead, behind), one for each step with a new low."""

    def note(self, t_s: float, names: Sequence[str], ahead_m: FloatColumn, behind_m: FloatColumn) -> None:
        """Note the gaps of the bound vehicles at one time; columns have shape ``(n,)``."""
        for name in names:
            self._numbers.setdefault(name, len(self._numbers))
        missing = len(self._numbers) - len(self._least_m)
        if missing:
            self._least_m = np.concatenate([self._least_m, np.full((missing, 2), np.nan)])
        numbers = np.array([self._numbers[name] for name in names], np.int64)
        before = self._least_m[numbers]
        least = np.fmin(before, np.column_stack([ahead_m, behind_m]))
        lower = ((least < before) | (np.isnan(before) & ~np.isnan(least))).any(axis=1)
        if lower.any():
            self._least_m[numbers] = least
            times = np.full(int(lower.sum()), t_s)
            self._lows.append(np.column_stack([numbers[lower], times, least[lower]]))

    def lows(self) -> dict[str, GapLows]:
        """Return the lows of every vehicle of which a gap was ever noted."""
        if not self._lows:
            return {}
        table = np.concatenate(self._lows)
        table = table[np.argsort(table[:, 0], kind="stable")]
        starts = np.searchsorted(table[:, 0], np.arange(len(self._numbers) + 1))
        return {
            name: GapLows(*table[starts[number] : starts[number + 1], 1:].T)
            for name, number in self._numbers.items()
        }
