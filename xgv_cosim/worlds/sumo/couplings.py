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

Where the computer has an axis, SUMO's checks on it are off (speed mode 0, lane-change mode 0), else SUMO
would soften the mistakes that a study is meant to see. A driver who only steers (e-stop disable: the
computer brakes, XGV-31) stays in his lane: nobody changes lanes under a brake that he cannot release.

The lateral position that a car has when the world's driver takes the wheel stays as it is in SUMO for
good (measured: across lane changes and edges); ``LateralEasing`` brings it to the lane's centre.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

from xgv_cosim.worlds.sumo.frames import angle_to_sumo

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.worlds.sumo.engine import Engine

ALL_SPEED_CHECKS = 31
NO_SPEED_CHECKS = 0
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


class Target(NamedTuple):
    """Where the plant wants one vehicle at the end of the step."""

    vehicle_id: str
    front_x_m: float
    front_y_m: float
    heading_rad: float
    speed_mps: float
    travelled_m: float
    along_m: float
    """Distance along the lane from where SUMO has the front bumper to where the plant puts it."""
    lateral_m: float
    """Offset of the front bumper from the lane's centre line, positive left."""
    ends_route: bool
    """The route ends within this step."""


class Coupling(Protocol):
    """One way to write a vehicle."""

    @property
    def speed_mode(self) -> int:
        """Return which of SUMO's checks of speed apply."""
        ...

    @property
    def lane_change_mode(self) -> int:
        """Return which lane changes SUMO may make."""
        ...

    def write(self, target: Target) -> None:
        """Tell SUMO what the plant wants for the coming step."""
        ...


@dataclass(frozen=True, slots=True)
class FreeCoupling:
    """Pose and speed from the plant, anywhere.

    ``moveToXY`` alone would report a speed that is clipped to the lane's limit and to the type's
    emergency deceleration; ``setSpeed`` makes it exact. A vehicle that is moved in every step never
    arrives: over the end of its route it rolls by itself.
    """

    engine: Engine
    step_s: float
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Place the vehicle and report its speed; SUMO knows no reverse, so that is reported as 0."""
        vehicle = self.engine.vehicle
        if target.ends_route:
            rolls_mps = max(target.speed_mps, target.travelled_m / self.step_s, 0.0)
            vehicle.setSpeed(target.vehicle_id, rolls_mps)
            return
        vehicle.setSpeed(target.vehicle_id, max(target.speed_mps, 0.0))
        vehicle.moveToXY(
            target.vehicle_id,
            "",
            -1,
            target.front_x_m,
            target.front_y_m,
            angle_to_sumo(target.heading_rad),
            KEEP_ROUTE_AND_POSE,
            MATCH_THRESHOLD_M,
        )


@dataclass(frozen=True, slots=True)
class LaneCoupling:
    """Speed and lateral position from the plant, within the lane that SUMO keeps. Forward only."""

    engine: Engine
    step_s: float
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Move the vehicle by the distance that the plant has driven, beside the lane's centre."""
        self.engine.vehicle.setSpeed(target.vehicle_id, max(target.travelled_m, 0.0) / self.step_s)
        self.engine.vehicle.setLateralLanePosition(target.vehicle_id, target.lateral_m)


@dataclass(frozen=True, slots=True)
class MirrorCoupling:
    """The plant's pose in the frame of its lane, for poses that SUMO can have there (``lane_frame``).

    Unlike ``LaneCoupling`` it follows the pose rather than the distance driven, so that errors do not add up.
    """

    engine: Engine
    step_s: float
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Move the vehicle to the plant's place along and across its lane."""
        self.engine.vehicle.setSpeed(target.vehicle_id, max(target.along_m, 0.0) / self.step_s)
        self.engine.vehicle.setLateralLanePosition(target.vehicle_id, target.lateral_m)


@dataclass(frozen=True, slots=True)
class LaneChangeEnding:
    """The plant's pose beside the lane's centre line while SUMO ends a lane change that its driver began.

    Nothing but time ends it (measured: neither ``moveTo`` nor ``moveToXY``, no new command, mode, route or
    type). SUMO crashes if the vehicle is placed in the other lane before SUMO itself has it there: in the
    middle it changes to the lane beside, which is now one too far. SUMO's own step sideways comes on top of
    the lateral position that is written.
    """

    engine: Engine
    step_s: float
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Move the vehicle to the plant's place along and across its lane."""
        vehicle = self.engine.vehicle
        vehicle.setSpeed(target.vehicle_id, max(target.along_m, 0.0) / self.step_s)
        own_m = vehicle.getLateralSpeed(target.vehicle_id) * self.step_s
        vehicle.setLateralLanePosition(target.vehicle_id, target.lateral_m - own_m)


@dataclass(frozen=True, slots=True)
class LaneKeeping:
    """Speed from the plant; the world's driver keeps the lane (computer brakes, driver steers)."""

    engine: Engine
    step_s: float
    speed_mode: int = NO_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Move the vehicle along its lane by the distance that the plant has driven."""
        self.engine.vehicle.setSpeed(target.vehicle_id, max(target.travelled_m, 0.0) / self.step_s)


@dataclass(frozen=True, slots=True)
class CarFollowing:
    """Lateral position from the plant; SUMO's car-following model governs speed (manual speed)."""

    engine: Engine
    speed_mode: int = ALL_SPEED_CHECKS
    lane_change_mode: int = NO_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Set the lateral position."""
        self.engine.vehicle.setLateralLanePosition(target.vehicle_id, target.lateral_m)


@dataclass(frozen=True, slots=True)
class WorldDriver:
    """SUMO's own driver has both axes."""

    speed_mode: int = ALL_SPEED_CHECKS
    lane_change_mode: int = OWN_LANE_CHANGES

    def write(self, target: Target) -> None:
        """Leave everything to SUMO."""


def enter(engine: Engine, vehicle_id: str, coupling: Coupling, before: Coupling | None) -> None:
    """Switch SUMO's modes for a vehicle that another coupling wrote before, or none."""
    had_speed = before is not None and before.speed_mode != NO_SPEED_CHECKS
    engine.vehicle.setSpeedMode(vehicle_id, coupling.speed_mode)
    engine.vehicle.setLaneChangeMode(vehicle_id, coupling.lane_change_mode)
    if coupling.speed_mode != NO_SPEED_CHECKS and not had_speed:
        engine.vehicle.setSpeed(vehicle_id, SUMO_GOVERNS_SPEED)


def let_drive(engine: Engine, held: Target) -> None:
    """Give a vehicle that was held to SUMO's driver, off the road on the nearest lane of its route."""
    vehicle = engine.vehicle
    vehicle.setSpeedMode(held.vehicle_id, ALL_SPEED_CHECKS)
    vehicle.setLaneChangeMode(held.vehicle_id, OWN_LANE_CHANGES)
    vehicle.setSpeed(held.vehicle_id, SUMO_GOVERNS_SPEED)
    if vehicle.getLaneID(held.vehicle_id):
        vehicle.setLateralLanePosition(held.vehicle_id, 0.0)
        return
    vehicle.moveToXY(
        held.vehicle_id,
        "",
        -1,
        held.front_x_m,
        held.front_y_m,
        angle_to_sumo(held.heading_rad),
        KEEP_ROUTE,
        ANYWHERE_M,
    )


@dataclass(slots=True)
class LateralEasing:
    """Brings vehicles that the world's driver steers to the centre of their lane, at a bounded rate."""

    engine: Engine
    step_s: float
    _offsets_m: dict[str, float] = field(default_factory=dict)

    def begin(self, vehicle_id: str) -> None:
        """The world's driver takes the wheel."""
        self._offsets_m[vehicle_id] = self.engine.vehicle.getLateralLanePosition(vehicle_id)

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
                self.engine.vehicle.setLateralLanePosition(vehicle_id, 0.0)
        self._offsets_m.clear()

    def is_under_way(self, vehicle_id: str) -> bool:
        """Return whether a vehicle is not at the centre yet."""
        return vehicle_id in self._offsets_m

    def advance(self) -> None:
        """Move every vehicle by one step's share towards the centre."""
        most_m = EASING_RATE_MPS * self.step_s
        for vehicle_id, offset_m in list(self._offsets_m.items()):
            eased_m = offset_m - max(-most_m, min(most_m, offset_m))
            self.engine.vehicle.setLateralLanePosition(vehicle_id, eased_m)
            if eased_m:
                self._offsets_m[vehicle_id] = eased_m
            else:
                del self._offsets_m[vehicle_id]
