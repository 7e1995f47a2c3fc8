"""Vehicles that are not bound and held where they are: wrecks, and cars off the road."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.worlds.sumo.couplings import FreeCoupling, Target, let_drive

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
        self._targets: dict[str, Target] = {}

    def hold(self, vehicle_id: str, now: Snapshot, row: int) -> None:
        """Keep a vehicle that is not bound where it is."""
        if vehicle_id in self._targets:
            return
        self._engine.vehicle.setSpeedMode(vehicle_id, self._free.speed_mode)
        self._engine.vehicle.setLaneChangeMode(vehicle_id, self._free.lane_change_mode)
        self._targets[vehicle_id] = Target(
            vehicle_id,
            float(now.front_x_m[row]),
            float(now.front_y_m[row]),
            float(now.heading_rad[row]),
            speed_mps=0.0,
            travelled_m=0.0,
            along_m=0.0,
            lateral_m=0.0,
            ends_route=False,
        )

    def forget(self, vehicle_id: str) -> None:
        """Hold a vehicle no longer: it is bound, or SUMO has it no longer."""
        self._targets.pop(vehicle_id, None)

    def write(self, before: Snapshot) -> None:
        """Tell SUMO to keep them where they are in the coming step."""
        for target in self._targets.values():
            if target.vehicle_id not in before.index_of:
                continue
            if self._standstill.is_due(target.vehicle_id, at_rest=True):
                self._standstill.stir(
                    target.vehicle_id, target.front_x_m, target.front_y_m, target.heading_rad
                )
            else:
                self._free.write(target)

    def let_all_drive(self, present: Collection[str]) -> None:
        """Give all who are there to SUMO's driver."""
        for target in self._targets.values():
            if target.vehicle_id in present:
                let_drive(self._engine, target)
        self._targets.clear()
