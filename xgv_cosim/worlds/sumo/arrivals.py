"""Where vehicles arrive: the ``arrivalPos`` of SUMO's demand.

libsumo has no getter for it; a saved state of the simulation tells it. That is written once for all
vehicles that are there when the first of them comes onto the last edge of its route.
"""

from __future__ import annotations

import math
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine


@dataclass(slots=True)
class ArrivalPositions:
    """Arrival positions on the last edge, read when they are asked for.

    ``arrivalPos="random"`` counts as the end of the edge: SUMO tells nobody what it has drawn.
    """

    engine: Engine
    _declared_m: dict[str, float] = field(default_factory=dict)
    """Infinite: at the end. Negative: from the end."""

    def position_m(self, vehicle_id: str, edge_id: str, length_m: float) -> float:
        """Return where on an edge of ``length_m`` a vehicle arrives; its end if the route goes on."""
        if vehicle_id not in self._declared_m:
            if not self.is_on_last_edge(vehicle_id, edge_id):
                return length_m
            self._declared_m = self._read()
            self._declared_m.setdefault(vehicle_id, math.inf)
        declared_m = self._declared_m[vehicle_id]
        return min(max(declared_m + length_m if declared_m < 0.0 else declared_m, 0.0), length_m)

    def forget(self, vehicle_id: str) -> None:
        """Read a vehicle's anew: somebody else may have had its id when it was read."""
        self._declared_m.pop(vehicle_id, None)

    def is_on_last_edge(self, vehicle_id: str, edge_id: str) -> bool:
        """Return whether an edge is the last of a vehicle's route, on the last pass if it is a loop."""
        vehicle = self.engine.vehicle
        route = vehicle.getRoute(vehicle_id)
        return bool(edge_id == route[-1] and vehicle.getRouteIndex(vehicle_id) == len(route) - 1)

    def _read(self) -> dict[str, float]:
        with tempfile.TemporaryDirectory(prefix="xgv-cosim-sumo-") as folder:
            self.engine.simulation.saveState(str(Path(folder) / "state.xml"))
            (file,) = Path(folder).iterdir()  # under another name if the user sets --output-prefix
            vehicles = ET.parse(file).getroot().iter("vehicle")  # noqa: S314 - SUMO has just written it
            return {row.get("id", ""): _declared_m(row.get("arrivalPos", "max")) for row in vehicles}


def _declared_m(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.inf
