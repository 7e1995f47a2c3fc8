"""From one coupling to another: SUMO's modes, and what eases the hand-over to SUMO's driver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.couplings import NO_SPEED_CHECKS, LateralEasing, enter, replan
from xgv_cosim.worlds.sumo.handover import HeadingEasing, SpeedEasing
from xgv_cosim.worlds.sumo.placing_tables import Way

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.choosing import Couplings
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

_STEERED_BY_DRIVER = frozenset({Way.LANE_KEEPING, Way.WORLD_DRIVER})


class Switching:
    """Switches vehicles to other couplings, and keeps what is under way between them."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float, couplings: Couplings) -> None:
        self._engine = engine
        self._couplings = couplings.by_way
        self._road = road
        self._lateral = LateralEasing(couplings.frame)
        self._speed = SpeedEasing(engine, road, step_s)
        self.headings = HeadingEasing(step_s)

    def switch(self, vehicle_id: str, before: Way, after: Way, now: Snapshot) -> None:
        """Let another coupling write the vehicle from now on; ``Way.NONE``: none did so far."""
        coupling, left = self._couplings[after], self._couplings.get(before)
        enter(self._engine, vehicle_id, coupling, left)
        row = now.index_of.get(vehicle_id)
        if coupling.speed_mode == NO_SPEED_CHECKS:
            self._speed.end(vehicle_id)
        elif left is not None and left.speed_mode == NO_SPEED_CHECKS and row is not None:
            self._speed.begin(vehicle_id, now.value("speed_mps", row), now.value("accel_mps2", row))
        if after not in _STEERED_BY_DRIVER:
            self._lateral.end(vehicle_id)
            self.headings.end(vehicle_id)
        elif left is not None and before not in _STEERED_BY_DRIVER:
            if row is not None and (lane := int(now.value("lane", row))) >= 0:
                front_x_m, front_y_m, _ = now.pose_of(row)
                _, left_m = self._road.project(lane, np.array([front_x_m]), np.array([front_y_m]))
                self._lateral.begin(vehicle_id, float(left_m[0]))
            self.headings.begin(vehicle_id)

    def replan(self, vehicle_id: str, way: Way, *, stops_at_red: bool) -> None:
        """Have SUMO plan for a vehicle as for one that stops at red lights, or that may pass them."""
        replan(self._engine, vehicle_id, self._couplings[way], stops_at_red=stops_at_red)

    @property
    def on_way_to_centre(self) -> Collection[str]:
        """Return the vehicles that the world's driver steers and that are not at their lane's centre yet."""
        return self._lateral.pending

    @property
    def is_under_way(self) -> bool:
        """Return whether a hand-over to SUMO's driver has not ended."""
        return self._lateral.is_at_work or self._speed.is_at_work

    def advance(self, before: Snapshot) -> None:
        """Tell SUMO what is under way for the coming step, seen from the state before it."""
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
