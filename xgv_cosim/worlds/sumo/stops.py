"""The ``<stop>``s of SUMO's demand: told in words, and taken from vehicles that are bound.

SUMO carries a stop out wherever the vehicle is placed: one with ``parking`` takes it off its lane, where its
position is no number that anybody can use, and any stop holds a car back that is written as speed in its lane
(measured). So whoever is bound loses all stops; SUMO has no way to lay them by.

A car that is parked already stands beside the lanes, where no stack finds a way. Without its stops SUMO's
driver brings it back onto its lane as soon as there is a gap; there it can be bound.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine


class Stops:
    """Tells of stops and takes them away; keeps who is on his way back from a parking place."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._leaving: set[str] = set()

    def in_words(self, vehicle_id: str) -> tuple[str, ...]:
        """Return where SUMO has a vehicle stop that it has now, the next one first."""
        return tuple(
            f"stop at {stop.stoppingPlaceID}"
            if stop.stoppingPlaceID
            else f"stop on lane {stop.lane} at {stop.endPos:.1f} m"
            for stop in self._engine.vehicle.getStops(vehicle_id)
        )

    def drop(self, vehicle_id: str) -> None:
        """Take all stops from a vehicle that SUMO has now; one that stands at a stop may go on."""
        self.forget(vehicle_id)
        vehicle = self._engine.vehicle
        for _ in vehicle.getStops(vehicle_id):
            vehicle.replaceStop(vehicle_id, 0, "")

    def unpark(self, vehicle_id: str, *, on_lane: bool) -> bool:
        """Have a parked vehicle drive off; return whether it is parked no longer.

        Args:
            vehicle_id: A vehicle that SUMO has now.
            on_lane: Whether it is on a lane; who is parked is on none, nor is who left the road.
        """
        if on_lane:
            self.forget(vehicle_id)
            return True
        if self._engine.vehicle.isStoppedParking(vehicle_id):
            self.drop(vehicle_id)
            self._leaving.add(vehicle_id)  # SUMO waits for a gap, and calls it parked no more meanwhile
        return vehicle_id not in self._leaving

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle: it has left its parking place, or SUMO has it no longer."""
        self._leaving.discard(vehicle_id)
