"""The objects of all bound vehicles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from xgv_cosim.columns import IntColumn
from xgv_cosim.simulation.binding import BoundVehicle
from xgv_cosim.vehicles.base import VehicleProfile


class BoundVehicles:
    """The objects of all bound vehicles, by id and in slot order."""

    def __init__(self) -> None:
        self._by_id: dict[str, BoundVehicle] = {}
        self._groups: list[tuple[VehicleProfile, IntColumn]] = []

    def __iter__(self) -> Iterator[BoundVehicle]:
        return iter(self._by_id.values())

    def __contains__(self, vehicle_id: object) -> bool:
        return vehicle_id in self._by_id

    def __getitem__(self, vehicle_id: str) -> BoundVehicle:
        return self._by_id[vehicle_id]

    @property
    def groups(self) -> list[tuple[VehicleProfile, IntColumn]]:
        """Return (profile, its slots), so that each profile resolves its own in one call."""
        return self._groups

    def add(self, vehicle: BoundVehicle) -> None:
        """Take a vehicle in."""
        self._by_id[vehicle.vehicle_id] = vehicle
        self._regroup()

    def remove(self, vehicle_id: str) -> BoundVehicle:
        """Take a vehicle out and return it."""
        vehicle = self._by_id.pop(vehicle_id)
        self._regroup()
        return vehicle

    def _regroup(self) -> None:
        self._by_id = dict(sorted(self._by_id.items(), key=lambda item: item[1].slot))
        slots: dict[int, list[int]] = {}
        profiles: dict[int, VehicleProfile] = {}
        for vehicle in self._by_id.values():
            profile = vehicle.binding.profile
            profiles[id(profile)] = profile
            slots.setdefault(id(profile), []).append(vehicle.slot)
        self._groups = [(profiles[key], np.array(of_profile, np.int64)) for key, of_profile in slots.items()]
