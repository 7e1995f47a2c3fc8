"""What the world answers about one vehicle: whether and who it is, where it stops and turns."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from xgv_cosim.traveller import Traveller

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import OpenSimulation
    from xgv_cosim.worlds.sumo.stops import Stops
    from xgv_cosim.worlds.sumo.turns import Turns


class Asking(ABC):
    """Asks SUMO at once; changes nothing."""

    _stops: Stops
    _turns: Turns

    @abstractmethod
    def _open(self) -> OpenSimulation:
        """Return the open simulation.

        Raises:
            WorldError: The world is closed.
        """

    def knows(self, vehicle_id: str) -> bool:
        """Return whether SUMO has the vehicle, or has read it from its demand for later.

        SUMO reads its demand ahead by ``--route-steps`` (200 s unless told).

        Raises:
            WorldError: The world is closed.
        """
        flow, _, number = vehicle_id.rpartition(".")
        from_a_flow = bool(flow) and number.isdecimal()  # SUMO names these only as it inserts them
        session = self._open()
        with session.failures():
            return from_a_flow or vehicle_id in session.engine.vehicle.getLoadedIDList()

    def traveller(self, vehicle_id: str) -> Traveller:
        """Return who a vehicle is that drives in SUMO now.

        Raises:
            WorldError: SUMO has no such vehicle, or the world is closed.
        """
        session = self._open()
        with session.failures():
            vehicle = session.engine.vehicle
            return Traveller(
                vehicle_id,
                vehicle.getTypeID(vehicle_id),
                vehicle.getRouteID(vehicle_id),
                tuple(vehicle.getRoute(vehicle_id)),
            )

    def stops_of(self, vehicle_id: str) -> tuple[str, ...]:
        """Return in words where SUMO's demand has a vehicle stop that drives in SUMO now, the next one first.

        Raises:
            WorldError: SUMO has no such vehicle, or the world is closed.
        """
        session = self._open()
        with session.failures():
            return self._stops.in_words(vehicle_id)

    def tight_turns_of(self, vehicle_id: str, radius_m: float) -> tuple[str, ...]:
        """Return in words where the rest of a vehicle's route turns on a smaller radius, see ``turns``.

        Raises:
            WorldError: SUMO has no such vehicle, or the world is closed.
        """
        session = self._open()
        with session.failures():
            vehicle = session.engine.vehicle
            at = max(vehicle.getRouteIndex(vehicle_id), 0)
            return self._turns.tighter_than(radius_m, vehicle.getRoute(vehicle_id)[at:])
