"""What a road answers: lanes as numbered centre lines, and points along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn


@dataclass(frozen=True, slots=True)
class LanePoints:
    """Points on lane centre lines; every column has shape ``(n,)``, frame east-north-up."""

    x_m: FloatColumn
    y_m: FloatColumn
    heading_rad: FloatColumn
    """Direction of the lane, counter-clockwise from east."""


class Road(Protocol):
    """Geometry of the lanes a world has. Lanes are numbered from 0 in a fixed order; -1 is off-road."""

    @property
    def lane_ids(self) -> tuple[str, ...]:
        """Return the world's own name of each lane."""
        ...

    def lane_length_m(self, lane: IntColumn) -> FloatColumn:
        """Return the length of each lane."""
        ...

    def lane_width_m(self, lane: IntColumn) -> FloatColumn:
        """Return the width of each lane."""
        ...

    def lane_limit_mps(self, lane: IntColumn) -> FloatColumn:
        """Return the speed limit of each lane."""
        ...

    def lane_shape_m(self, lane: int) -> FloatMatrix:
        """Return the centre line of one lane, shape ``(k, 2)``, frame east-north-up."""
        ...

    def points_ahead(self, lane: IntColumn, position_m: FloatColumn, next_lane: IntColumn) -> LanePoints:
        """Return the centre-line points at ``position_m``.

        A position past the lane's end goes on along ``next_lane`` (-1: straight on past the end).
        """
        ...
