"""What a world returns after each step: all vehicles as columns, and what happened to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn


@dataclass(frozen=True, slots=True)
class Collision:
    """A contact of two vehicles in this step."""

    collider: str
    victim: str
    kind: str
    """The world's word for it, for example ``collision``; ``overlap`` where it reports none."""
    lane_id: str
    position_m: float


@dataclass(frozen=True)
class Snapshot:
    """All vehicles of the world at ``time_s``; every column has shape ``(len(ids),)``.

    Frame: east-north-up, metres, radians counter-clockwise from east. The reference point of this
    traffic view is the centre of the front bumper (the plant's is the rear axle).
    """

    time_s: float
    """Simulation time since the start of the run."""
    ids: tuple[str, ...]
    type_ids: tuple[str, ...]
    """The world's vehicle type of each vehicle."""
    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    speed_mps: FloatColumn
    accel_mps2: FloatColumn
    length_m: FloatColumn
    width_m: FloatColumn
    lane: IntColumn
    """Number of the lane in ``Road``, -1 off-road."""
    lane_position_m: FloatColumn
    """Distance of the front bumper from the beginning of the lane."""
    next_lane: IntColumn
    """Lane that follows on the vehicle's route, -1 where unknown; filled for bound vehicles."""
    leader: IntColumn
    """Index of the vehicle ahead in ``ids``, -1: none within sight; filled for bound vehicles."""
    leader_gap_m: FloatColumn
    """Distance from front bumper to the leader's rear bumper, ``inf`` without a leader."""
    follower: IntColumn
    """Index of the vehicle behind in ``ids``, -1: none within sight; filled for bound vehicles."""
    follower_gap_m: FloatColumn
    """Distance from rear bumper to the follower's front bumper, ``inf`` without a follower."""
    placement_error_m: FloatColumn
    """Distance of the front bumper from where the plant put it; 0 where a driver of the world's moves it."""
    placement_error_rad: FloatColumn
    """Difference of the heading from the plant's, 0 or more, likewise."""
    in_lane_frame: BoolColumn
    """Whether a bound vehicle was written as speed and lateral position in its lane in this step."""
    departed: tuple[str, ...] = ()
    """Who was not in the snapshot before: entered the world, was there from its start, or came back."""
    arrived: tuple[str, ...] = ()
    teleported: tuple[str, ...] = ()
    teleported_from: tuple[str, ...] = ()
    """The edge of its route from which each of them was taken, empty where the world does not know it; no
    entries at all: it knows none."""
    collisions: tuple[Collision, ...] = ()
    notes: tuple[tuple[str, str], ...] = field(default=())
    """(vehicle id, text) about things the world did, for example a coupling that gave way to another."""

    @cached_property
    def index_of(self) -> dict[str, int]:
        """Return the index of each vehicle id."""
        return {vehicle_id: index for index, vehicle_id in enumerate(self.ids)}

    def read_all(self) -> None:
        """Make the snapshot one that can be kept: a world may read columns only when they are asked for.

        What such a world has not read by its next step is gone, and asking for it then is an error.
        """

    def of(self, name: str, rows: IntColumn) -> Any:  # noqa: ANN401 - a column of the name's own type
        """Return the values of some rows of a column; where columns are read on demand, only these are."""
        return getattr(self, name)[rows]

    def value(self, name: str, row: int) -> float:
        """Return the value of one row of a column of numbers, likewise."""
        return float(self.of(name, np.array([row]))[0])

    def pose_of(self, row: int) -> tuple[float, float, float]:
        """Return front bumper and heading of one row."""
        return self.value("front_x_m", row), self.value("front_y_m", row), self.value("heading_rad", row)

    def rows_of(self, vehicle_ids: Iterable[str]) -> IntColumn:
        """Return the index of each of some vehicles, -1 where it is not there."""
        index_of = self.index_of
        return np.array([index_of.get(vehicle_id, -1) for vehicle_id in vehicle_ids], np.int64)
