"""Surrogate safety measures from gaps and speeds, vectorised."""

from __future__ import annotations

import numpy as np

from xgv_cosim.columns import FloatColumn

SLOWEST_FOLLOWER_MPS = 3.0
"""Below this the last metres of an ordinary approach dominate the time to collision."""


def time_to_collision_s(
    gap_m: FloatColumn, follower_speed_mps: FloatColumn, leader_speed_mps: FloatColumn
) -> FloatColumn:
    """Return the time to collision ``gap / closing speed`` (Hayward 1972), shape ``(n,)``.

    ``inf`` where nothing closes in, where there is no leader (gap ``inf``), and where the follower
    is slower than ``SLOWEST_FOLLOWER_MPS``; 0 where the gap is used up.
    """
    closing = follower_speed_mps - leader_speed_mps
    applies = (closing > 0.0) & np.isfinite(gap_m) & (follower_speed_mps >= SLOWEST_FOLLOWER_MPS)
    safe_gap = np.where(applies, np.maximum(gap_m, 0.0), 0.0)
    return np.where(applies, safe_gap / np.where(applies, closing, 1.0), np.inf)
