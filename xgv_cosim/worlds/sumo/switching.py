"""From one coupling to another: SUMO's modes, and what eases the hand-over to SUMO's driver."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.worlds.sumo.couplings import NO_SPEED_CHECKS, Coupling, LateralEasing, enter
from xgv_cosim.worlds.sumo.handover import HeadingEasing, SpeedEasing

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.choosing import Binding, Choosing
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad


class Switching:
    """Switches vehicles to other couplings, and keeps what is under way between them."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float, choosing: Choosing) -> None:
        self._engine = engine
        self._steered_by_driver = frozenset({choosing.lane_keeping, choosing.world_driver})
        self._lateral = LateralEasing(engine, step_s)
        self._speed = SpeedEasing(engine, road, step_s)
        self.headings = HeadingEasing(step_s)

    def switch(self, vehicle_id: str, binding: Binding, coupling: Coupling, now: Snapshot) -> None:
        """Make ``coupling`` the one that writes the vehicle; calls SUMO only on a change."""
        if binding.coupling is coupling:
            return
        enter(self._engine, vehicle_id, coupling, binding.coupling)
        row = now.index_of.get(vehicle_id)
        if coupling.speed_mode == NO_SPEED_CHECKS:
            self._speed.end(vehicle_id)
        elif (
            binding.coupling is not None
            and binding.coupling.speed_mode == NO_SPEED_CHECKS
            and row is not None
        ):
            self._speed.begin(vehicle_id, float(now.speed_mps[row]), float(now.accel_mps2[row]))
        driver_steered = binding.coupling in self._steered_by_driver
        if coupling not in self._steered_by_driver:
            self._lateral.end(vehicle_id)
            self.headings.end(vehicle_id)
        elif binding.coupling is not None and not driver_steered:
            self._lateral.begin(vehicle_id)
            self.headings.begin(vehicle_id)
        binding.coupling = coupling

    def is_on_way_to_centre(self, vehicle_id: str) -> bool:
        """Return whether a vehicle that the world's driver steers is not at its lane's centre yet."""
        return self._lateral.is_under_way(vehicle_id)

    @property
    def is_under_way(self) -> bool:
        """Return whether a hand-over to SUMO's driver has not ended."""
        return self._lateral.is_at_work or self._speed.is_at_work

    def advance(self, before: Snapshot) -> None:
        """Tell SUMO what is under way for the coming step, seen from the state before it."""
        if self._lateral.pending:  # a script may have taken somebody away
            for gone in set(self._lateral.pending).difference(self._engine.vehicle.getIDList()):
                self._lateral.end(gone)
        self._lateral.advance()
        self._speed.advance(before)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self._lateral.end(vehicle_id)
        self._speed.forget(vehicle_id)
        self.headings.end(vehicle_id)

    def settle(self, present: Collection[str]) -> None:
        """Take back at once whatever is under way, of those who are there."""
        self._speed.settle()
        self._lateral.settle(present)
