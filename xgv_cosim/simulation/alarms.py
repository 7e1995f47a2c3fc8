"""When a bound vehicle wants to act next, so that nobody is asked at the ticks in between.

Deadlines of an endpoint and its devices, and messages on their way, change only where somebody calls them.
Whoever does *touches* the vehicle; then, and only then, its deadlines are read anew.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from xgv_cosim.clock import time_of_tick_s
from xgv_cosim.columns import FloatColumn
from xgv_cosim.simulation.binding import BoundVehicle

_ROUNDING_S = 1e-9
"""Deadlines are sums of floats; one this near is due."""


class Alarms:
    """The next deadline of each bound vehicle, and who was touched since it was last looked at."""

    def __init__(self) -> None:
        self._vehicles: dict[int, BoundVehicle] = {}
        """By slot: whose deadline is in the column."""
        self._due_s: FloatColumn = np.full(32, math.inf)
        self._next_s = math.inf
        self._stale: dict[int, BoundVehicle] = {}
        self._unseen: dict[int, BoundVehicle] = {}
        self._unviewed: dict[int, BoundVehicle] = {}

    def touch(self, vehicle: BoundVehicle) -> None:
        """Take note that somebody called a vehicle's endpoint, devices or transmitter."""
        slot = vehicle.slot
        self._stale[slot] = self._unseen[slot] = self._unviewed[slot] = vehicle

    def forget(self, vehicle: BoundVehicle) -> None:
        """Leave out a vehicle that is released."""
        for by_slot in (self._vehicles, self._stale, self._unseen, self._unviewed):
            by_slot.pop(vehicle.slot, None)
        if vehicle.slot < self._due_s.size:
            self._due_s[vehicle.slot] = math.inf
        self._next_s = float(self._due_s.min())

    @property
    def next_s(self) -> float:
        """Return when somebody wants to act next, ``inf`` for never."""
        if self._stale:
            self._refresh()
        return self._next_s

    def due(self, now_s: float) -> Iterable[BoundVehicle]:
        """Return who wants to act by now, in slot order."""
        if self.next_s > now_s + _ROUNDING_S:
            return ()
        return [self._vehicles[slot] for slot in np.flatnonzero(self._due_s <= now_s + _ROUNDING_S).tolist()]

    @property
    def has_unseen(self) -> bool:
        """Return whether anybody was touched since ``take_unseen``."""
        return bool(self._unseen)

    def take_unseen(self) -> dict[int, BoundVehicle]:
        """Return by slot who was touched since the last call."""
        unseen, self._unseen = self._unseen, {}
        return unseen

    def take_unviewed(self) -> dict[int, BoundVehicle]:
        """Return by slot who was touched since the last call, for those who make the stacks' views."""
        unviewed, self._unviewed = self._unviewed, {}
        return unviewed

    def _refresh(self) -> None:
        while max(self._stale) >= self._due_s.size:
            self._due_s = np.concatenate([self._due_s, np.full(self._due_s.size, math.inf)])
        for slot, vehicle in self._stale.items():
            self._vehicles[slot] = vehicle
            self._due_s[slot] = _deadline_s(vehicle)
        self._stale.clear()
        self._next_s = float(self._due_s.min())


def _deadline_s(vehicle: BoundVehicle) -> float:
    """Return when the vehicle's devices, its endpoint if it computes, or a message on the way act next."""
    deadline_s = vehicle.devices.next_deadline_s
    if vehicle.is_computing:
        deadline_s = min(deadline_s, vehicle.endpoint.next_deadline_s)
    if vehicle.on_the_way:
        deadline_s = min(deadline_s, time_of_tick_s(vehicle.on_the_way[0][0]))
    return deadline_s
