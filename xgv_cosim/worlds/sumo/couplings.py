"""How one bound vehicle is written into SUMO, step by step.

Who governs which axis decides how it is written:

====================  =========================  ==========================================
speed                 steering                   written as
====================  =========================  ==========================================
computer              computer                   free, lane, or (auto) mirrored where that is exact
computer              world's driver             ``LaneKeeping``: SUMO keeps the lane
world's driver        computer                   ``CarFollowing``: SUMO governs the speed
world's driver        world's driver             ``WorldDriver``: SUMO drives
====================  =========================  ==========================================

Where the computer has an axis, SUMO's checks on it are off (speed mode 0, for who stands 16, lane-change
mode 0), else SUMO would soften the mistakes that a study is meant to see. A driver who only steers (e-stop
disable: the computer brakes, XGV-31) stays in his lane: nobody changes lanes under a brake that he cannot
release.

The lateral position that a car has when the world's driver takes the wheel stays as it is in SUMO for
good (measured: across lane changes and edges); ``LateralEasing`` brings it to the lane's centre.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from xgv_cosim.worlds.sumo.frames import angle_to_sumo, angles_to_sumo

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from xgv_cosim.columns import BoolColumn, FloatColumn
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.lane_frame import LaneFrame

ALL_SPEED_CHECKS = 31
NO_SPEED_CHECKS = 0
PLANS_TO_STOP_AT_RED = 16
"""No check has a say in the speed either, but SUMO plans no farther than to a red light, see ``placing``."""
OWN_LANE_CHANGES = 1621
NO_LANE_CHANGES = 0
SUMO_GOVERNS_SPEED = -1.0
"""SUMO's word for "the speed is yours again"; so a speed below 0 must never be set."""

KEEP_ROUTE_AND_POSE = 3
"""``moveToXY``: the exact pose even off the road, and the route is kept whatever lane lies beneath."""
KEEP_ROUTE = 1
"""``moveToXY``: onto the nearest lane of the route."""
MATCH_THRESHOLD_M = 5.0
"""How far ``moveToXY`` looks for a lane; the cost grows with it."""
ANYWHERE_M = 1e4
"""Likewise, for a vehicle that has to be on some lane."""

EASING_RATE_MPS = 0.5
"""How fast the world's driver brings a car back to the centre of its lane."""


class Targets(NamedTuple):
    """Where the plant wants some vehicles at the end of the step; every column has shape ``(n,)``."""

    ids: Sequence[str]
    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    speed_mps: FloatColumn
    travelled_m: FloatColumn
    along_m: FloatColumn
    """Distance along the lane from where SUMO has the front bumper to where the plant puts it."""
    lateral_m: FloatColumn
    """Offset of the front bumper from the lane's centre line, positive left."""
    shifts: BoolColumn
    """SUMO does not know of that offset yet."""
    ends_route: BoolColumn
    """The route ends within this step."""


def standing(vehicle_id: str, front_x_m: float, front_y_m: float, heading_rad: float) -> Targets:
    """Return the target of one vehicle that is to stay at a place."""
    x_m, y_m, heading = (np.array([value]) for value in (front_x_m, front_y_m, heading_rad))
    none, no = np.zeros(1), np.zeros(1, np.bool_)
    return Targets([vehicle_id], x_m, y_m, heading, none, none, none, none, no, no)


class Coupling(Protocol):
    """One way to write vehicles."""

    @property
    def speed_mode(self) -> int:
        """Return which of SUMO's checks of speed apply; how it plans for who has none see ``replan``."""
        ...

    @property
    def lane_change_mode(self) -> int:
        """Return which lane changes SUMO may make."""
        ...

    def write(self, targets: Targets) -> None:
        """Tell SUMO what the plant wants for the coming step."""
        ...


@dataclass(frozen=True, slots=True)
class FreeCoupling:
    """Pose and speed from the plant, anywhere.

    ``moveToXY`` alone would report a speed that is clipped to the lane's limit and to the type's
    emergency deceleration; ``setSpeed`` makes it exact. A vehicle that is moved in every step never
    arrives: over the end of its route it rolls by itself.
    """

    frame: LaneFrame
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Place the vehicles and report their speeds; SUMO knows no reverse, so that is reported as 0."""
        vehicle = self.frame.engine.vehicle
        set_speed, move_to = vehicle.setSpeed, vehicle.moveToXY
        angles_deg = angles_to_sumo(targets.heading_rad)
        for name, x_m, y_m, angle_deg, speed_mps, travelled_m, ends in zip(
            targets.ids,
            targets.front_x_m.tolist(),
            targets.front_y_m.tolist(),
            angles_deg.tolist(),
            targets.speed_mps.tolist(),
            targets.travelled_m.tolist(),
            targets.ends_route.tolist(),
            strict=True,
        ):
            if ends:
                self.frame.move(name, max(speed_mps * self.frame.step_s, travelled_m))
            else:
                set_speed(name, max(speed_mps, 0.0))
                move_to(name, "", -1, x_m, y_m, angle_deg, KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M)


@dataclass(frozen=True, slots=True)
class LaneCoupling:
    """Speed and lateral position from the plant, within the lane that SUMO keeps. Forward only."""

    frame: LaneFrame
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Move the vehicles by the distance that the plant has driven, beside the lane's centre."""
        self.frame.place(targets.ids, targets.travelled_m, targets.lateral_m, targets.shifts)


@dataclass(frozen=True, slots=True)
class MirrorCoupling:
    """The plant's pose in the frame of its lane, for poses that SUMO can have there (``placing``).

    Unlike ``LaneCoupling`` it follows the pose rather than the distance driven, so that errors do not add up.
    """

    frame: LaneFrame
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Move the vehicles to the plant's place along and across their lanes."""
        self.frame.place(targets.ids, targets.along_m, targets.lateral_m, targets.shifts)


@dataclass(frozen=True, slots=True)
class LaneKeeping:
    """Speed from the plant; the world's driver keeps the lane (computer brakes, driver steers)."""

    frame: LaneFrame
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Move the vehicles along their lanes by the distance that the plant has driven."""
        for name, travelled_m in zip(targets.ids, targets.travelled_m.tolist(), strict=True):
            self.frame.move(name, travelled_m)


@dataclass(frozen=True, slots=True)
class CarFollowing:
    """Lateral position from the plant; SUMO's car-following model governs speed (manual speed)."""

    frame: LaneFrame
    speed_mode: int = ALL_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Set the lateral positions."""
        self.frame.shift_all(targets.ids, targets.lateral_m, targets.shifts)


@dataclass(frozen=True, slots=True)
class WorldDriver:
    """SUMO's own driver has both axes."""

    speed_mode: int = ALL_SPEED_CHECKS
    lane_change_mode: int = OWN_LANE_CHANGES

    def write(self, targets: Targets) -> None:
        """Leave everything to SUMO."""


def enter(engine: Engine, vehicle_id: str, coupling: Coupling, before: Coupling | None) -> None:
    """Switch SUMO's modes for a vehicle that another coupling wrote before, or none."""
    had_speed = before is not None and before.speed_mode != NO_SPEED_CHECKS
    if before is None or before.speed_mode != coupling.speed_mode:
        engine.vehicle.setSpeedMode(vehicle_id, coupling.speed_mode)
    if before is None or before.lane_change_mode != coupling.lane_change_mode:
        engine.vehicle.setLaneChangeMode(vehicle_id, coupling.lane_change_mode)
    if coupling.speed_mode != NO_SPEED_CHECKS and not had_speed:
        engine.vehicle.setSpeed(vehicle_id, SUMO_GOVERNS_SPEED)


def replan(engine: Engine, vehicle_id: str, coupling: Coupling, *, stops_at_red: bool) -> None:
    """Have SUMO plan for a vehicle that it does not drive as for one that stops at red lights, or passes."""
    if coupling.speed_mode == NO_SPEED_CHECKS:
        engine.vehicle.setSpeedMode(vehicle_id, PLANS_TO_STOP_AT_RED if stops_at_red else NO_SPEED_CHECKS)


def let_drive(engine: Engine, held: Targets) -> None:
    """Give a vehicle that was held to SUMO's driver, off the road on the nearest lane of its route."""
    vehicle, (vehicle_id,) = engine.vehicle, held.ids
    vehicle.setSpeedMode(vehicle_id, ALL_SPEED_CHECKS)
    vehicle.setLaneChangeMode(vehicle_id, OWN_LANE_CHANGES)
    vehicle.setSpeed(vehicle_id, SUMO_GOVERNS_SPEED)
    if vehicle.getLaneID(vehicle_id):
        vehicle.setLateralLanePosition(vehicle_id, 0.0)
        return
    vehicle.moveToXY(
        vehicle_id,
        "",
        -1,
        float(held.front_x_m[0]),
        float(held.front_y_m[0]),
        angle_to_sumo(float(held.heading_rad[0])),
        KEEP_ROUTE,
        ANYWHERE_M,
    )


@dataclass(slots=True)
class LateralEasing:
    """Brings vehicles that the world's driver steers to the centre of their lane, at a bounded rate."""

    frame: LaneFrame
    _offsets_m: dict[str, float] = field(default_factory=dict)
    """How far left of the centre each of them is."""

    def begin(self, vehicle_id: str, left_m: float) -> None:
        """The world's driver takes the wheel of a car so far to the left of its lane's centre."""
        self._offsets_m[vehicle_id] = left_m

    def end(self, vehicle_id: str) -> None:
        """The computer takes the wheel, or the vehicle is gone."""
        self._offsets_m.pop(vehicle_id, None)

    @property
    def is_at_work(self) -> bool:
        """Return whether somebody is not at the centre."""
        return any(self._offsets_m.values())

    @property
    def pending(self) -> Collection[str]:
        """Return who may not be at the centre yet."""
        return self._offsets_m.keys()

    def settle(self, present: Collection[str]) -> None:
        """Have all who are there at the centre: nobody will move them on."""
        for vehicle_id in self._offsets_m:
            if vehicle_id in present:
                self.frame.shift(vehicle_id, 0.0)
        self._offsets_m.clear()

    def advance(self) -> None:
        """Move every vehicle by one step's share towards the centre."""
        most_m = EASING_RATE_MPS * self.frame.step_s
        for vehicle_id, offset_m in list(self._offsets_m.items()):
            eased_m = offset_m - max(-most_m, min(most_m, offset_m))
            self.frame.shift(vehicle_id, eased_m)
            if eased_m:
                self._offsets_m[vehicle_id] = eased_m
            else:
                del self._offsets_m[vehicle_id]
