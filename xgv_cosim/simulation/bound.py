"""The objects of all bound vehicles."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from xgv_cosim.columns import IntColumn
from xgv_cosim.links.base import Link
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.vehicles.base import VehicleProfile


class BoundVehicles:
    """The objects of all bound vehicles, by id and in slot order."""

    def __init__(self) -> None:
        self._by_id: dict[str, BoundVehicle] = {}
        self._in_slot_order: list[BoundVehicle] = []
        self._linked: list[tuple[BoundVehicle, Link]] = []
        self._groups: list[tuple[VehicleProfile, IntColumn]] = []
        self._first_until_tick = math.inf
        self._is_current = True

    def __iter__(self) -> Iterator[BoundVehicle]:
        return iter(self.in_slot_order)

    def __contains__(self, vehicle_id: object) -> bool:
        return vehicle_id in self._by_id

    def __getitem__(self, vehicle_id: str) -> BoundVehicle:
        return self._by_id[vehicle_id]

    @property
    def in_slot_order(self) -> list[BoundVehicle]:
        """Return all of them, as ``Fleet.bound`` has their slots."""
        self._bring_up_to_date()
        return self._in_slot_order

    @property
    def linked(self) -> list[tuple[BoundVehicle, Link]]:
        """Return those that have a stack, with its link, in slot order."""
        self._bring_up_to_date()
        return self._linked

    @property
    def groups(self) -> list[tuple[VehicleProfile, IntColumn]]:
        """Return (profile, its slots), so that each profile resolves its own in one call."""
        self._bring_up_to_date()
        return self._groups

    @property
    def first_until_tick(self) -> float:
        """Return the first control tick on which one is given back, ``inf`` for never."""
        self._bring_up_to_date()
        return self._first_until_tick

    def add(self, vehicle: BoundVehicle) -> None:
        """Take a vehicle in."""
        self._by_id[vehicle.vehicle_id] = vehicle
        self._is_current = False

    def connect(self, vehicle_id: str, link: Link | None) -> None:
        """Give a vehicle another link, or take its link away; the one before is not closed."""
        self._by_id[vehicle_id].link = link
        self._is_current = False

    def remove(self, vehicle_id: str) -> BoundVehicle:
        """Take a vehicle out and return it."""
        vehicle = self._by_id.pop(vehicle_id)
        self._is_current = False
        return vehicle

    def _bring_up_to_date(self) -> None:
        """Sort and group anew once after any number of changes."""
        if self._is_current:
            return
        self._in_slot_order = sorted(self._by_id.values(), key=lambda vehicle: vehicle.slot)
        self._linked = [(v, v.link) for v in self._in_slot_order if v.link is not None]
        slots: dict[int, list[int]] = {}
        profiles: dict[int, VehicleProfile] = {}
        for vehicle in self._in_slot_order:
            profile = vehicle.binding.profile
            profiles[id(profile)] = profile
            slots.setdefault(id(profile), []).append(vehicle.slot)
        self._groups = [(profiles[key], np.array(of_profile, np.int64)) for key, of_profile in slots.items()]
        until = (v.binding.until_tick for v in self._in_slot_order)
        self._first_until_tick = min((tick for tick in until if tick is not None), default=math.inf)
        self._is_current = True
