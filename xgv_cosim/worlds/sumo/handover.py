"""What SUMO's driver does at once and no driver can, eased where he takes a car over from the computer.

**Speed.**
SUMO's drivers have neither reaction time nor jerk limit. Measured with cars that the computer had driven
above or below the driver's own wish: he brakes with the full comfortable deceleration in the very first
step (0.45 m/s in 0.1 s), above the type's ``maxSpeed`` even with the emergency deceleration, and
accelerates with the full 2.6 m/s².

What is used, and why (all measured):

* From below: ``slowDown``, which also speeds up. It starts at the car's own speed, and what safety demands
  (leader, signals, right of way, limits ahead) still brakes the car. It ends by itself, so that nothing of
  it stays, and a script's own ``setSpeed`` takes its place.
* From above: the speed factor, step by step. ``setSpeed`` and ``slowDown`` cannot hold a car above the
  driver's wish, whatever the speed mode. ``setMaxSpeed`` makes a type of its own for the vehicle; it is
  used only above the ``maxSpeed`` of the type, and the type is put back.

Safety comes first: a driver whose car-following model asks for more braking brakes more.

**Heading.** SUMO turns a car to its lane at once. The difference fades in the snapshots; SUMO itself has
no way to show it. (For the lateral position see ``couplings.LateralEasing``.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

SLOWS_MPS2 = 0.6
"""How fast a driver slows down whose car is faster than he wants: he lifts his foot. With the dawdling of
SUMO's default driver (up to 1.3 m/s²) that stays below 0.2 m/s in 0.1 s."""
QUICKENS_MPS2 = 1.0
"""How fast he accelerates at first, whose car is slower than he wants."""
QUICKENS_FOR_S = 1.0
"""For how long, at most; then with what his type can do."""
JERK_MPS3 = 1.0
"""How fast the acceleration passes from that of the plant to ``-SLOWS_MPS2``."""
HEADING_EASE_S = 0.5
"""Time in which a difference in heading falls to 1/e."""
_NO_TURN_RAD = 1e-4
"""A smaller rest is dropped."""


@dataclass(slots=True)
class _Slowing:
    """A car that is faster than its driver wants."""

    own_factor: float
    own_max_mps: float
    own_type: str
    decel_mps2: float
    """What SUMO's driver brakes with on his own account."""
    accel_mps2: float
    factor: float
    """As set now."""
    has_own_max: bool = True
    """The car is not above the ``maxSpeed`` of its type."""


class SpeedEasing:
    """Lets drivers who have just taken a car over want its speed at first, and their own by and by."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float) -> None:
        self._engine = engine
        self._road = road
        self._step_s = step_s
        self._slowing: dict[str, _Slowing] = {}

    @property
    def is_at_work(self) -> bool:
        """Return whether a vehicle has a setting in SUMO that will have to be taken back."""
        return bool(self._slowing)

    def begin(self, vehicle_id: str, speed_mps: float, accel_mps2: float) -> None:
        """The world's driver takes the pedals of a car with this motion."""
        self.end(vehicle_id)
        vehicle = self._engine.vehicle
        wish_mps = vehicle.getAllowedSpeed(vehicle_id)
        if wish_mps <= 0.0:
            return  # in the middle of a teleport, or on a closed lane
        if speed_mps > wish_mps:
            factor = vehicle.getSpeedFactor(vehicle_id)
            self._slowing[vehicle_id] = _Slowing(
                own_factor=factor,
                own_max_mps=vehicle.getMaxSpeed(vehicle_id),
                own_type=vehicle.getTypeID(vehicle_id),
                decel_mps2=vehicle.getDecel(vehicle_id),
                accel_mps2=max(-SLOWS_MPS2, min(accel_mps2, SLOWS_MPS2)),
                factor=factor,
            )
            return
        speed_mps = max(speed_mps, 0.0)
        gain_mps = min(QUICKENS_MPS2 * QUICKENS_FOR_S, wish_mps - speed_mps)
        if gain_mps > 0.0:
            vehicle.slowDown(vehicle_id, speed_mps + gain_mps, gain_mps / QUICKENS_MPS2)

    def end(self, vehicle_id: str) -> None:
        """Take back what is set: the computer takes the pedals, or the wish is reached."""
        state = self._slowing.pop(vehicle_id, None)
        if state is None:
            return
        vehicle = self._engine.vehicle
        factor_is_ours = vehicle.getSpeedFactor(vehicle_id) == state.factor  # else a script has set another
        if not state.has_own_max:
            if vehicle.getTypeID(vehicle_id) == state.own_type:  # the vehicle's very own before us
                vehicle.setMaxSpeed(vehicle_id, state.own_max_mps)
            else:
                vehicle.setType(vehicle_id, state.own_type)
        if factor_is_ours:
            vehicle.setSpeedFactor(vehicle_id, state.own_factor)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self._slowing.pop(vehicle_id, None)

    def settle(self) -> None:
        """Take back at once whatever is set: nobody will do it later."""
        for vehicle_id in list(self._slowing):
            self.end(vehicle_id)

    def advance(self, before: Snapshot) -> None:
        """Tell SUMO what each driver wants in the coming step, seen from the state before it."""
        for vehicle_id, state in list(self._slowing.items()):
            row = before.index_of.get(vehicle_id)
            if row is None:
                self._leave(vehicle_id)
                continue
            if self._engine.vehicle.getSpeedFactor(vehicle_id) != state.factor:
                self.end(vehicle_id)  # a script has set another, which stays
                continue
            limit_mps = self._limit_mps(vehicle_id, state)
            state.accel_mps2 = max(state.accel_mps2 - JERK_MPS3 * self._step_s, -SLOWS_MPS2)
            target_mps = min(
                before.value("speed_mps", row) + state.accel_mps2 * self._step_s,
                self._limit_ahead_mps(vehicle_id, state, before, row),
            )
            if target_mps <= min(state.own_max_mps, limit_mps * state.own_factor):
                self.end(vehicle_id)
                continue
            if target_mps > state.own_max_mps or not state.has_own_max:
                state.has_own_max = False
                self._engine.vehicle.setMaxSpeed(vehicle_id, max(target_mps, state.own_max_mps))
            state.factor = max(state.own_factor, target_mps / limit_mps)
            self._engine.vehicle.setSpeedFactor(vehicle_id, state.factor)

    def _limit_mps(self, vehicle_id: str, state: _Slowing) -> float:
        """Return the limit of the lane for this type; where ``maxSpeed`` binds, what would give that."""
        reach_mps: float = self._engine.vehicle.getAllowedSpeed(vehicle_id)
        return reach_mps / state.factor

    def _limit_ahead_mps(self, vehicle_id: str, state: _Slowing, before: Snapshot, row: int) -> float:
        """Return the speed from which he can still brake to his wish for the lanes that come next.

        SUMO looks ahead with the factor that is set now, which may be too high for a turn.
        """
        lane = int(before.value("lane", row))
        links = self._engine.vehicle.getNextLinks(vehicle_id)
        if not links or lane < 0:
            return math.inf
        approached, *_, via, _, _, via_m = links[0]
        speed_mps = before.value("speed_mps", row)
        after_m = before.value("lane_position_m", row) + speed_mps * self._step_s
        left_m = max(float(self._road.lengths_m[lane] - after_m), 0.0)
        most_mps = math.inf
        for ahead, distance_m in ((via, left_m), (approached, left_m + via_m)):
            if ahead:
                wish_mps = state.own_factor * self._road.limits_mps[self._road.index_of[ahead]]
                squared_m2ps2 = wish_mps**2 + 2.0 * state.decel_mps2 * distance_m
                most_mps = min(most_mps, math.sqrt(squared_m2ps2))
        return most_mps

    def _leave(self, vehicle_id: str) -> None:
        """A vehicle is not on the road any more: it may come back from a teleport."""
        if vehicle_id in self._engine.vehicle.getTeleportingIDList():
            self.end(vehicle_id)
        else:
            self.forget(vehicle_id)


@dataclass(slots=True)
class HeadingEasing:
    """Turns cars whose wheel the world's driver has just taken to their lanes by and by, in the snapshots."""

    step_s: float
    _left_rad: dict[str, float | None] = field(default_factory=dict)
    """How much further left a car still points than SUMO has it; None until that has been measured."""

    def begin(self, vehicle_id: str) -> None:
        """The world's driver takes the wheel."""
        self._left_rad[vehicle_id] = None

    def end(self, vehicle_id: str) -> None:
        """The computer takes the wheel, or the vehicle is gone."""
        self._left_rad.pop(vehicle_id, None)

    @property
    def is_at_work(self) -> bool:
        """Return whether a car still turns to its lane."""
        return bool(self._left_rad)

    def rows_in(self, index_of: Mapping[str, int]) -> IntColumn:
        """Return the rows of those who do, of whom is there."""
        return np.array([index_of[name] for name in self._left_rad if name in index_of], np.int64)

    def eased(self, before: Snapshot, index_of: Mapping[str, int], heading_rad: FloatColumn) -> None:
        """Let headings follow on those before.

        Args:
            before: The world before the step.
            index_of: Rows of the vehicles after it.
            heading_rad: Their headings as SUMO has them; changed in place.
        """
        faded = math.exp(-self.step_s / HEADING_EASE_S)
        for vehicle_id, rest_rad in list(self._left_rad.items()):
            row, row_before = index_of.get(vehicle_id), before.index_of.get(vehicle_id)
            if row is None or row_before is None:
                del self._left_rad[vehicle_id]
                continue
            turned_rad = float(before.value("heading_rad", row_before) - heading_rad[row])
            at_first_rad = float(np.remainder(turned_rad + np.pi, 2.0 * np.pi) - np.pi)
            left_rad = at_first_rad if rest_rad is None else rest_rad * faded
            if abs(left_rad) < _NO_TURN_RAD:
                del self._left_rad[vehicle_id]
                continue
            self._left_rad[vehicle_id] = left_rad
            heading_rad[row] += left_rad
