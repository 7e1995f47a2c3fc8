"""The vehicles of which the plant has both axes: where it has them, and how far from there SUMO does."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from xgv_cosim.worlds.sumo.frames import headings_from_sumo

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine


class Driven(NamedTuple):
    """Those of the last snapshot; every column has shape ``(len(ids),)``."""

    ids: list[str]
    rows: IntColumn
    """In the snapshot."""
    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn

    @classmethod
    def of(cls, placement: Placement, rows: IntColumn) -> Self:
        """Return whom the plant drives alone.

        Args:
            placement: Before the step.
            rows: Those of its vehicles in the snapshot after it, -1: not there.
        """
        driven = np.flatnonzero(placement.computer_speed & placement.computer_steering & (rows >= 0))
        return cls(
            [placement.ids[number] for number in driven.tolist()],
            rows[driven],
            placement.front_x_m[driven],
            placement.front_y_m[driven],
            placement.heading_rad[driven],
        )

    def without(self, vehicle_id: str) -> Self:
        """Return the others."""
        stays: BoolColumn = np.array([name != vehicle_id for name in self.ids], np.bool_)
        return self._replace(
            ids=[name for name in self.ids if name != vehicle_id],
            rows=self.rows[stays],
            front_x_m=self.front_x_m[stays],
            front_y_m=self.front_y_m[stays],
            heading_rad=self.heading_rad[stays],
        )

    def errors(self, engine: Engine, num_vehicles: int) -> tuple[FloatColumn, FloatColumn]:
        """Return distance and turn of SUMO's poses from the plant's for all vehicles of the snapshot."""
        distance_m, turned_rad = np.zeros((2, num_vehicles))
        if self.ids:
            places_m = np.array([engine.vehicle.getPosition(name) for name in self.ids])
            angles_rad = headings_from_sumo(np.array([engine.vehicle.getAngle(name) for name in self.ids]))
            east_m, north_m = places_m[:, 0] - self.front_x_m, places_m[:, 1] - self.front_y_m
            turn_rad = np.remainder(angles_rad - self.heading_rad + np.pi, 2.0 * np.pi) - np.pi
            distance_m[self.rows], turned_rad[self.rows] = np.hypot(east_m, north_m), np.abs(turn_rad)
        return distance_m, turned_rad
