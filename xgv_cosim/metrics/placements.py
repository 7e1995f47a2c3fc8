"""How exactly the world has the bound vehicles where the plant put them, and how they were written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from xgv_cosim.columns import IntColumn
from xgv_cosim.snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class PlacementRow:
    """One bound vehicle over the whole run."""

    placement_error_m: float
    """Largest distance of the world's front bumper from the plant's."""
    placement_error_deg: float
    """Largest difference of the world's heading from the plant's."""
    share_in_lane_frame: float
    """Share of its steps in which it was written as speed and lateral position in its lane."""


class Placements:
    """Running maxima and counts of all vehicles at once."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self._table = np.zeros((0, 4))
        """Rows (largest distance, largest angle, steps, steps in the lane frame)."""

    def note(self, snapshot: Snapshot, names: Sequence[str], rows: IntColumn) -> None:
        """Note one step of the bound vehicles ``names``, which stand at ``rows`` of the snapshot."""
        for name in names:
            self._numbers.setdefault(name, len(self._numbers))
        missing = len(self._numbers) - len(self._table)
        if missing:
            self._table = np.concatenate([self._table, np.zeros((missing, 4))])
        at = np.array([self._numbers[name] for name in names], np.int64)
        table = self._table
        table[at, 0] = np.maximum(table[at, 0], snapshot.placement_error_m[rows])
        table[at, 1] = np.maximum(table[at, 1], snapshot.placement_error_rad[rows])
        table[at, 2] += 1.0
        table[at, 3] += snapshot.in_lane_frame[rows]

    def rows(self) -> dict[str, PlacementRow]:
        """Return the row of every vehicle that was ever bound."""
        return {
            name: PlacementRow(float(far_m), math.degrees(turned_rad), float(in_frame / steps))
            for name, (far_m, turned_rad, steps, in_frame) in zip(self._numbers, self._table, strict=True)
        }
