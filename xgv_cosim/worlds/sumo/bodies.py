"""What does not change about SUMO's vehicles."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine


class Body(NamedTuple):
    """What does not change about a vehicle."""

    type_id: str
    length_m: float
    width_m: float
    min_gap_m: float


@dataclass(slots=True)
class Bodies:
    """Asks SUMO once about each vehicle."""

    engine: Engine
    _known: dict[str, Body] = field(default_factory=dict)

    def of(self, vehicle_id: str) -> Body:
        """Return the body of a vehicle that is there."""
        body = self._known.get(vehicle_id)
        if body is None:
            vehicle = self.engine.vehicle
            body = self._known[vehicle_id] = Body(
                vehicle.getTypeID(vehicle_id),
                vehicle.getLength(vehicle_id),
                vehicle.getWidth(vehicle_id),
                vehicle.getMinGap(vehicle_id),
            )
        return body

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle."""
        self._known.pop(vehicle_id, None)
