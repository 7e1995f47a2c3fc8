"""How SUMO is told where a vehicle is in the frame of its lane: by its speed along it, an offset across it.

SUMO counts offsets and moves across lanes towards the lane with the next higher number. Lane 0 is the
one at the kerb, so that is to the left, and in left-hand networks to the right (measured). Freely placed
vehicles are an exception: ``moveToXY`` counts their offset to the left in every network, so that SUMO would
have them on the other side of the centre line in the first step in which nobody writes their offset.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.engine import for_each

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.integration import Integration


@dataclass(frozen=True, slots=True)
class LaneFrame:
    """Writes vehicles of an open simulation in the frame of their lanes."""

    engine: Engine
    integration: Integration
    leftwards: int = 1
    """See ``SumoRoad.leftwards``."""

    @property
    def step_s(self) -> float:
        """Return the length of a step."""
        return self.integration.step_s

    def place(
        self, ids: Sequence[str], distance_m: FloatColumn, left_m: FloatColumn, shifts: BoolColumn
    ) -> None:
        """Have vehicles go so far along their lanes in the coming step, and be so far left of the centre.

        Args:
            ids: The vehicles.
            distance_m: Forward only, shape ``(n,)``.
            left_m: Likewise.
            shifts: Whose offset SUMO does not know yet, likewise.
        """
        if self.integration.is_ballistic:
            speeds_mps = list(map(self._speed_mps, ids, distance_m.tolist()))
        else:
            speeds_mps = (np.maximum(distance_m, 0.0) / self.integration.step_s).tolist()
        for_each(self.engine.vehicle.setSpeed, ids, speeds_mps)
        self.shift_all(ids, left_m, shifts)

    def shift_all(self, ids: Sequence[str], left_m: FloatColumn, shifts: BoolColumn) -> None:
        """Have those of whom SUMO does not know so far to the left, see ``place``."""
        which = shifts.nonzero()[0]
        names = [ids[number] for number in which.tolist()]
        for_each(self.engine.vehicle.setLateralLanePosition, names, (self.leftwards * left_m[which]).tolist())

    def move(self, vehicle_id: str, distance_m: float) -> None:
        """Have a vehicle go so far along its lane in the coming step; forward only."""
        self.engine.vehicle.setSpeed(vehicle_id, self._speed_mps(vehicle_id, distance_m))

    def _speed_mps(self, vehicle_id: str, distance_m: float) -> float:
        """Return the speed with which SUMO moves a vehicle so far."""
        mean_mps = max(distance_m, 0.0) / self.integration.step_s
        if not self.integration.is_ballistic:
            return mean_mps
        before_mps: float = self.engine.vehicle.getSpeed(vehicle_id)
        if before_mps > 2.0 * mean_mps:  # it stops within the step
            before_mps = 2.0 * mean_mps
            self.engine.vehicle.setPreviousSpeed(vehicle_id, before_mps)
        return 2.0 * mean_mps - before_mps

    def shift(self, vehicle_id: str, left_m: float) -> None:
        """Have a vehicle so far to the left of its lane's centre line after the coming step."""
        self.engine.vehicle.setLateralLanePosition(vehicle_id, self.leftwards * left_m)
