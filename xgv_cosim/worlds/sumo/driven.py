"""The vehicles of which the plant has both axes: where it has them, and how far from there SUMO does."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from xgv_cosim.worlds.sumo.engine import of_each
from xgv_cosim.worlds.sumo.frames import headings_from_sumo

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine


class Driven(NamedTuple):
    """Those of the last snapshot."""

    placement: Placement
    """Before the step."""
    rows: IntColumn
    """Its vehicles in the snapshot after it, -1: not there."""
    lost: frozenset[str] = frozenset()
    """Who was taken out of SUMO since."""

    def without(self, vehicle_id: str) -> Self:
        """Return the others."""
        return self._replace(lost=self.lost | {vehicle_id})

    def errors(self, engine: Engine, num_vehicles: int) -> tuple[FloatColumn, FloatColumn]:
        """Return distance and turn of SUMO's poses from the plant's for all vehicles of the snapshot."""
        distance_m, turned_rad = np.zeros((2, num_vehicles))
        placement, vehicle = self.placement, engine.vehicle
        both = placement.computer_speed & placement.computer_steering & (self.rows >= 0)
        numbers = [
            number for number in np.flatnonzero(both).tolist() if placement.ids[number] not in self.lost
        ]
        if numbers:
            ids = [placement.ids[number] for number in numbers]
            places_m = np.array(of_each(vehicle.getPosition, ids))
            angles_rad = headings_from_sumo(np.array(of_each(vehicle.getAngle, ids)))
            east_m = places_m[:, 0] - placement.front_x_m[numbers]
            north_m = places_m[:, 1] - placement.front_y_m[numbers]
            turn_rad = np.remainder(angles_rad - placement.heading_rad[numbers] + np.pi, 2.0 * np.pi) - np.pi
            at = self.rows[numbers]
            distance_m[at], turned_rad[at] = np.hypot(east_m, north_m), np.abs(turn_rad)
        return distance_m, turned_rad
