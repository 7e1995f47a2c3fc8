"""Colours of vehicles in SUMO's window."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine


class Colours:
    """Gives colours, and gives back what a vehicle had before."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._own: dict[str, tuple[int, int, int, int]] = {}

    def paint(self, vehicle_id: str, rgb: tuple[int, int, int] | None) -> None:
        """Give a vehicle that SUMO has now a colour, or with None its own again."""
        vehicle = self._engine.vehicle
        if vehicle_id not in self._own:
            self._own[vehicle_id] = vehicle.getColor(vehicle_id)
        vehicle.setColor(vehicle_id, self._own[vehicle_id] if rgb is None else (*rgb, 255))

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self._own.pop(vehicle_id, None)
