"""Small fleets and snapshots to record."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from xgv_cosim.fleet import Fleet
from xgv_cosim.snapshot import Snapshot

MakeSnapshot = Callable[..., Snapshot]


def _snapshot(*ids: str, **columns: object) -> Snapshot:
    n = len(ids)
    base = np.arange(n, dtype=np.float64)
    none = np.full(n, -1, np.int64)
    values: dict[str, object] = {
        "time_s": 0.0,
        "ids": ids,
        "type_ids": ("car",) * n,
        "front_x_m": 100.0 * base,
        "front_y_m": -3.2 * base,
        "heading_rad": 0.01 * base,
        "speed_mps": 20.0 + base,
        "accel_mps2": 0.1 * base,
        "length_m": np.full(n, 4.5),
        "width_m": np.full(n, 1.8),
        "lane": np.zeros(n, np.int64),
        "lane_position_m": 100.0 * base,
        "next_lane": none,
        "leader": none,
        "leader_gap_m": np.full(n, np.inf),
        "follower": none,
        "follower_gap_m": np.full(n, np.inf),
        "placement_error_m": np.zeros(n),
        "placement_error_rad": np.zeros(n),
        "in_lane_frame": np.zeros(n, np.bool_),
    }
    return Snapshot(**{**values, **columns})  # type: ignore[arg-type]


@pytest.fixture
def make_snapshot() -> MakeSnapshot:
    return _snapshot


@pytest.fixture
def fleet() -> Fleet:
    """One bound vehicle, ``xgv_0``, in slot 0."""
    fleet = Fleet()
    fleet.occupy("xgv_0")
    return fleet


class OneLane:
    lane_ids = ("main_0", "unused_0")

    def lane_length_m(self, lane: np.ndarray) -> np.ndarray:
        return np.full(len(lane), 500.0)

    def lane_width_m(self, lane: np.ndarray) -> np.ndarray:
        return np.full(len(lane), 3.2)

    def lane_shape_m(self, lane: int) -> np.ndarray:
        return np.array([[0.0, 0.0], [500.0, 1.0]])


@pytest.fixture
def one_lane() -> OneLane:
    return OneLane()
