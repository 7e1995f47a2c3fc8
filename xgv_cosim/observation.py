"""What a stack sees of its own vehicle and of the traffic around it, after each world step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from xgv_cosim.actuation import Gear
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.surroundings import Junction, Signal


@dataclass(frozen=True, slots=True)
class DeviceReading:
    """What Report Discrete Devices tells: gear selector, engine and parking brake (XGV-57, XGV-60)."""

    gear: Gear
    """Gear in effect."""
    gear_wanted: Gear
    """Gear to which the selector is to go; another one than ``gear`` while a shift waits or is under way."""
    engine_on: bool
    parking_brake: bool


@dataclass(frozen=True, slots=True)
class LaneBeside:
    """A lane to one side that may be changed to; who reaches into it over a line counts as there."""

    offset_m: float
    """From the own lane's centre line to that lane's, positive left."""
    leader_gap_m: float
    """From the own front bumper to the rear one of who drives ahead there, below 0 beside; ``inf``: none."""
    leader_speed_mps: float
    follower_gap_m: float
    """From the own rear bumper to the front one of who comes behind there, below 0 beside; ``inf``: none."""
    follower_speed_mps: float


@dataclass(frozen=True, slots=True)
class Observation:
    """One vehicle's view at ``time_s``. Frame east-north-up, own reference point at the rear axle."""

    time_s: float
    """Simulation time since the start of the run."""
    vehicle_id: str
    x_m: float
    """Rear axle, to the east."""
    y_m: float
    """Rear axle, to the north."""
    heading_rad: float
    """Counter-clockwise from east."""
    speed_mps: float
    """Measured speed."""
    accel_mps2: float
    """Measured acceleration."""
    curvature_per_m: float
    """Curvature of the path driven now, positive to the left."""
    limit_mps: float
    """Speed limit of the lane."""
    lane_ahead_m: Sequence[tuple[float, float]]
    """Points of the centre line ahead along the route, through junctions, up to 190 m from the front bumper;
    in the vehicle's frame: x forward, y left. Off the road the way that was left; empty if none is known."""
    leader_gap_m: float
    """Bumper to bumper, ``inf`` without a leader in sight; also to a body that stands or crosses inside a
    junction, off the road or over a line between lanes, and reaches into the way."""
    leader_speed_mps: float
    """Speed of the leader along the way; own speed without one."""
    safety_mode: str
    """``drive_by_wire``, ``software_pause`` and so on, as docs/modes.md names them."""
    reasons: tuple[str, ...]
    """Why the safety mode is what it is."""
    component_status: dict[ComponentId, ComponentStatus]
    """Ready, standby and so on, of each component."""
    component_controller: dict[ComponentId, JausAddress | None]
    """Who controls each component, None: nobody."""
    devices: DeviceReading
    """Gear, engine and parking brake."""
    length_m: float = 4.4
    """Length of the own vehicle."""
    on_road: bool = True
    """Whether the front bumper is over a lane."""
    lane_id: str = ""
    """The world's name of the lane, empty off the road."""
    lane_width_m: float = 3.2
    """Width of the lane."""
    lateral_m: float = 0.0
    """Front bumper from the lane's centre line, positive left."""
    curvature_ahead: Sequence[tuple[float, float]] = ()
    """(distance from the front bumper, curvature of the way there, positive to the left)."""
    limits_ahead: tuple[tuple[float, float], ...] = ()
    """(distance from the front bumper, limit from there on) of each change of the limit ahead."""
    lane_changes: int = 0
    """Lanes to be changed to stay on the route, positive to the left, 0: none."""
    lane_end_m: float = math.inf
    """From the front bumper to where the own lane no longer leads on along the route; ``inf``: it does."""
    route_end_m: float = math.inf
    """From the front bumper to the end of the route; ``inf``: not in sight."""
    left: LaneBeside | None = None
    """The lane to the left, None: there is none that may be changed to."""
    right: LaneBeside | None = None
    """The lane to the right, likewise."""
    signal: Signal | None = None
    """The next traffic light on the way, None: none in sight."""
    junction: Junction | None = None
    """The next junction on the way, or the one it is in; None: none in sight."""


class Stack(Protocol):
    """An autonomy stack that drives one vehicle."""

    def act(self, observation: Observation) -> list[StackMessage]:
        """Return the messages to send now; they act at the start of the next step."""
        ...
