"""What SUMO leaves of a placed vehicle in the lane beside its own.

With a duration of lane changes (``--lanechange.duration``) SUMO has a vehicle that it puts onto a lane also
in the lane beside, if its body reaches over the line, and leaves it there for as long as it stays on that
edge, wherever it is placed then (measured): who drives in the lane that it has left waits behind nobody, and
SUMO crashes when the vehicle goes off the road while its rear is still on the edge before. Which lane that is
depends on SUMO's own idea of where the vehicle is across its lane; in left-hand networks it is the wrong one
(``lane_frame``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad


@dataclass(slots=True)
class Shadows:
    """Takes them away: ghosts tell SUMO's drivers where a body reaches."""

    engine: Engine
    road: SumoRoad

    def clear(self, vehicle_ids: Sequence[str], lanes: Sequence[int]) -> None:
        """Call when vehicles are on another lane than before, before poses are written.

        It leaves them at the centre of their lane.

        Args:
            vehicle_ids: Vehicles that are placed across their lane in the coming step.
            lanes: The lane that SUMO has each of them on now, -1: none.
        """
        for name, lane in zip(vehicle_ids, lanes, strict=True):
            if lane >= 0:
                self._clear(name, lane)

    def _clear(self, name: str, lane: int) -> None:
        """Put a vehicle onto the lane that its body reaches into, and back, both at the centre."""
        vehicle, own = self.engine.vehicle, self.road.lane_ids[lane]
        lateral_m = vehicle.getLateralLanePosition(name)
        if 2.0 * abs(lateral_m) + vehicle.getWidth(name) <= self.road.widths_m[lane]:
            return
        edge, _, place = own.rpartition("_")
        beside = f"{edge}_{int(place) + (1 if lateral_m > 0.0 else -1)}"
        if beside not in self.road.index_of:
            return
        position_m = vehicle.getLanePosition(name)
        vehicle.moveTo(name, beside, min(position_m, float(self.road.lengths_m[self.road.index_of[beside]])))
        vehicle.moveTo(name, own, position_m)
