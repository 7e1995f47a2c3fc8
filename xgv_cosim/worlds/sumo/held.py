"""Vehicles that are not bound and held where they are: wrecks, and cars off the road.

When SUMO's driver is to have a car again that is off the road, it has to be moved onto a lane. That move is
written only when SUMO's next step is certain: libsumo keeps a move that no step follows, and makes it in the
next simulation of this process, with whoever has the place in memory of the car that was meant (measured).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.worlds.sumo.couplings import FreeCoupling, Targets, let_drive, standing

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.standstill import Standstill


class Held:
    """Holds them, step by step."""

    def __init__(self, engine: Engine, free: FreeCoupling, standstill: Standstill) -> None:
        self._engine = engine
        self._free = free
        self._standstill = standstill
        self._targets: dict[str, Targets] = {}
        self._returning: dict[str, Targets] = {}
        """Who is off the road and is SUMO's driver's from the next step on."""

    def hold(self, vehicle_id: str, now: Snapshot, row: int) -> None:
        """Keep a vehicle that is not bound where it is."""
        if vehicle_id in self._targets:
            return
        self._engine.vehicle.setSpeedMode(vehicle_id, self._free.speed_mode)
        self._engine.vehicle.setLaneChangeMode(vehicle_id, self._free.lane_change_mode)
        self._targets[vehicle_id] = standing(vehicle_id, *now.pose_of(row))

    def forget(self, vehicle_id: str) -> None:
        """Hold a vehicle no longer: it is bound, or SUMO has it no longer."""
        self._targets.pop(vehicle_id, None)
        self._returning.pop(vehicle_id, None)

    @property
    def is_returning(self) -> bool:
        """Return whether a car waits off the road for the next step."""
        return bool(self._returning)

    def write(self, before: Snapshot) -> None:
        """Tell SUMO to keep them where they are in the coming step, or to have them back."""
        self.bring_back(before.index_of)
        for vehicle_id, target in self._targets.items():
            if vehicle_id not in before.index_of:
                continue
            if self._standstill.is_due(vehicle_id, at_rest=True):
                place = (float(column[0]) for column in target[1:4])
                self._standstill.stir(vehicle_id, *place)
            else:
                self._free.write(target)

    def let_all_drive(self, present: Collection[str]) -> None:
        """Give all who are there to SUMO's driver; who is off the road is brought back by the next step."""
        for vehicle_id, target in self._targets.items():
            if vehicle_id in present and not self._engine.vehicle.getLaneID(vehicle_id):
                self._returning[vehicle_id] = target
            elif vehicle_id in present:
                let_drive(self._engine, target)
        self._targets.clear()

    def bring_back(self, present: Collection[str]) -> None:
        """Have those who wait off the road on the nearest lane of their route in the coming step."""
        for vehicle_id, target in self._returning.items():
            if vehicle_id in present:
                let_drive(self._engine, target)
        self._returning.clear()
