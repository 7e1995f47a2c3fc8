"""What a stack sees of its own vehicle and of the traffic around it, after each world step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from xgv_cosim.actuation import Gear
from xgv_cosim.endpoint import StackMessage


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
class Observation:
    """One vehicle's view at ``time_s``. Frame east-north-up, own reference point at the rear axle."""

    time_s: float
    vehicle_id: str
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    """Measured speed."""
    accel_mps2: float
    curvature_per_m: float
    limit_mps: float
    """Speed limit of the lane."""
    lane_ahead_m: tuple[tuple[float, float], ...]
    """Points of the lane's centre line ahead, in the vehicle's frame: x forward, y left."""
    leader_gap_m: float
    """Bumper to bumper, ``inf`` without a leader in sight."""
    leader_speed_mps: float
    """Speed of the leader; own speed without one."""
    safety_mode: str
    reasons: tuple[str, ...]
    """Why the safety mode is what it is."""
    component_status: dict[ComponentId, ComponentStatus]
    component_controller: dict[ComponentId, JausAddress | None]
    """Who controls each component, None: nobody."""
    devices: DeviceReading
    """Gear, engine and parking brake."""


class Stack(Protocol):
    """An autonomy stack that drives one vehicle."""

    def act(self, observation: Observation) -> list[StackMessage]:
        """Return the messages to send now; they act at the start of the next step."""
        ...
