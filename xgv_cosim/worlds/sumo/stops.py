"""The ``<stop>``s of SUMO's demand: told in words, and taken from vehicles that are bound.

SUMO carries a stop out wherever the vehicle is placed: one with ``parking`` takes it off its lane, where its
position is no number that anybody can use, and any stop holds a car back that is written as speed in its lane
(measured). So whoever is bound loses all stops; SUMO has no way to lay them by.

A car that is parked already stands beside the lanes, where no stack finds a way. Without its stops SUMO's
driver brings it back onto its lane as soon as there is a gap; there it can be bound.

One that is bound where it is parked keeps its stops until it moves, and SUMO has it parked meanwhile, however
long that lasts: given back before, it is what it was, and SUMO's driver leaves the place when he would have.
(Measured: without its stop SUMO would lose it as soon as nobody places it any more; and placing it where it
is parked disturbs nothing.)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.lazy_snapshot import LazySnapshot

_FOR_LONG_S = 1e8
"""SUMO's times, in milliseconds, have room for it."""
_STAYS_M = 1e-6


class Stops:
    """Tells of stops and takes them away; keeps who is parked, or on his way back from a parking place."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._leaving: set[str] = set()
        self._parked: dict[str, float] = {}
        """Who is bound where he is parked, and until when, in SUMO's time."""

    def in_words(self, vehicle_id: str) -> tuple[str, ...]:
        """Return where SUMO has a vehicle stop that it has now, the next one first."""
        return tuple(
            f"stop at {stop.stoppingPlaceID}"
            if stop.stoppingPlaceID
            else f"stop on lane {stop.lane} at {stop.endPos:.1f} m"
            for stop in self._engine.vehicle.getStops(vehicle_id)
        )

    def bind(self, vehicle_id: str, *, on_lane: bool) -> None:
        """Take all stops from a vehicle that is bound from now on; where it is parked, not before it moves.

        Args:
            vehicle_id: A vehicle that SUMO has now.
            on_lane: See ``unpark``.
        """
        vehicle = self._engine.vehicle
        if on_lane or not vehicle.isStoppedParking(vehicle_id):
            self._drop(vehicle_id)
            return
        (stop, *_) = vehicle.getStops(vehicle_id)
        self._parked[vehicle_id] = self._engine.simulation.getTime() + stop.duration
        vehicle.setStopParameter(vehicle_id, 0, "duration", str(_FOR_LONG_S))

    def drop_moved(self, placement: Placement, before: LazySnapshot) -> None:
        """Take the stops from those who leave where they are parked, or whom SUMO's driver is to drive."""
        for vehicle_id in list(self._parked):
            number, row = placement.ids.index(vehicle_id), before.index_of[vehicle_id]
            place = placement.front_x_m[number], placement.front_y_m[number], placement.heading_rad[number]
            stays = np.allclose(place, before.pose_of(row), rtol=0.0, atol=_STAYS_M)
            if not (stays and placement.computer_speed[number] and placement.computer_steering[number]):
                before.keep(row)  # without its stop SUMO has it nowhere
                self._drop(vehicle_id)

    def give_back(self, vehicle_id: str) -> None:
        """Let a vehicle that is bound no longer be parked for as long as it would have been."""
        ends_s = self._parked.pop(vehicle_id, None)
        if ends_s is not None:
            rest_s = max(0.0, ends_s - self._engine.simulation.getTime())
            self._engine.vehicle.setStopParameter(vehicle_id, 0, "duration", str(rest_s))

    def _drop(self, vehicle_id: str) -> None:
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
            self._drop(vehicle_id)
            self._leaving.add(vehicle_id)  # SUMO waits for a gap, and calls it parked no more meanwhile
        return vehicle_id not in self._leaving

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle: it has left where it was parked, or SUMO has it no longer."""
        self._leaving.discard(vehicle_id)
        self._parked.pop(vehicle_id, None)
