"""Platform messages of RA 3.3: specifications, pose, velocity, wrench effort, discrete devices (XGV-57).

The vehicle's frame is X forward, Y right, Z down: positive rotation about Z turns right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from jaus.fields import Byte, Date, Integer, Scaled, Text, Time, UnsignedLong, UnsignedShort
from jaus.messages.base import Message, message


class PropulsionBit(IntEnum):
    """Bits of the propulsion byte of Discrete Devices (XGV-60)."""

    MAIN_PROPULSION = 0
    MAIN_FUEL = 1
    AUXILIARY_FUEL = 2
    POWER_AUXILIARY_DEVICES = 3
    STARTING_DEVICE = 4
    COLD_START = 5
    AUTOMATIC_START = 6
    AUTOMATIC_STOP = 7


class BrakeHornBit(IntEnum):
    """Bits of the second byte of Discrete Devices (XGV-60)."""

    PARKING_BRAKE = 0
    HORN = 1


class GearCode(IntEnum):
    """Gears of Discrete Devices; 2 to 127 drive forward, 129 to 255 backward (XGV-60)."""

    PARK = 0
    LOW = 1
    DRIVE = 2
    NEUTRAL = 128
    REVERSE = 129


Extent = Annotated[float, Scaled("H", 0.0, 32.767, "m")]
Length = Annotated[float, Scaled("H", 0.0, 65.535, "m")]
Tilt = Annotated[float, Scaled("H", 0.0, 2.56, "rad")]
Speed = Annotated[float, Scaled("H", 0.0, 65.535, "m/s")]
AngularSpeed = Annotated[float, Scaled("H", 0.0, 32.767, "rad/s")]
Velocity = Annotated[float, Scaled("i", -65.534, 65.534, "m/s")]
AngularRate = Annotated[float, Scaled("h", -32.767, 32.767, "rad/s")]
Latitude = Annotated[float, Scaled("i", -90.0, 90.0, "°")]
Longitude = Annotated[float, Scaled("i", -180.0, 180.0, "°")]
Elevation = Annotated[float, Scaled("i", -10_000.0, 35_000.0, "m")]
Place = Annotated[float, Scaled("i", -100_000.0, 100_000.0, "m")]
Attitude = Annotated[float, Scaled("h", -math.pi, math.pi, "rad")]
Rms = Annotated[float, Scaled("I", 0.0, 100.0, "m")]
VelocityRms = Annotated[float, Scaled("I", 0.0, 100.0, "m/s")]
AngleRms = Annotated[float, Scaled("H", 0.0, math.pi, "rad")]
AngularRateRms = Annotated[float, Scaled("H", 0.0, math.pi, "rad/s")]
Propulsive = Annotated[float, Scaled("h", -100.0, 100.0, "%")]
Resistive = Annotated[float, Scaled("B", 0.0, 100.0, "%")]


@dataclass(slots=True)
class _WrenchEffort(Message):
    propulsive_linear_x_percent: Propulsive | None = None
    propulsive_linear_y_percent: Propulsive | None = None
    propulsive_linear_z_percent: Propulsive | None = None
    propulsive_rotational_x_percent: Propulsive | None = None
    propulsive_rotational_y_percent: Propulsive | None = None
    propulsive_rotational_z_percent: Propulsive | None = None
    resistive_linear_x_percent: Resistive | None = None
    resistive_linear_y_percent: Resistive | None = None
    resistive_linear_z_percent: Resistive | None = None
    resistive_rotational_x_percent: Resistive | None = None
    resistive_rotational_y_percent: Resistive | None = None
    resistive_rotational_z_percent: Resistive | None = None


@dataclass(slots=True)
class _DiscreteDevices(Message):
    propulsion_bits: Annotated[int, Integer("B", PropulsionBit, bits=True)] | None = None
    brake_horn_bits: Annotated[int, Integer("B", BrakeHornBit, bits=True)] | None = None
    gear: Annotated[int, Integer("B", GearCode)] | None = None
    transfer_case: Byte | None = None


@message(0x0405, presence="H")
class SetWrenchEffort(_WrenchEffort):
    """Open-loop efforts; an XGV takes throttle (bit 0), steering (bit 5) and brake (bit 6) (XGV-59)."""


@message(0x0406, presence="B")
class SetDiscreteDevices(_DiscreteDevices):
    """Engine, parking brake, horn, gear (XGV-60)."""


@message(0x040A)
class SetTravelSpeed(Message):
    """Speed along a path."""

    speed_mps: Annotated[float, Scaled("H", 0.0, 10_000.0, "m/s")]


@message(0x2400)
class QueryPlatformSpecifications(Message):
    """Ask for measures and limits."""

    requested_presence_vector: UnsignedLong


@message(0x2402)
class QueryGlobalPose(Message):
    """Ask for the pose on the globe."""

    requested_presence_vector: UnsignedShort


@message(0x2403)
class QueryLocalPose(Message):
    """Ask for the pose in a local frame."""

    requested_presence_vector: UnsignedShort


@message(0x2404)
class QueryVelocityState(Message):
    """Ask for velocities."""

    requested_presence_vector: UnsignedShort


@message(0x2405)
class QueryWrenchEffort(Message):
    """Ask for the efforts."""

    requested_presence_vector: UnsignedShort


@message(0x2406)
class QueryDiscreteDevices(Message):
    """Ask for engine, parking brake, horn, gear."""

    requested_presence_vector: Byte


@message(0x4400, presence="I")
class ReportPlatformSpecifications(Message):
    """Measures and limits of the vehicle."""

    name: Annotated[str, Text(15)] | None = None
    front_m: Extent | None = None
    back_m: Extent | None = None
    right_m: Extent | None = None
    left_m: Extent | None = None
    bottom_m: Extent | None = None
    top_m: Extent | None = None
    centre_of_gravity_x_m: Extent | None = None
    centre_of_gravity_y_m: Extent | None = None
    centre_of_gravity_z_m: Extent | None = None
    turning_radius_m: Length | None = None
    wheel_base_m: Length | None = None
    track_m: Length | None = None
    pitch_over_rad: Tilt | None = None
    roll_over_rad: Tilt | None = None
    max_velocity_x_mps: Speed | None = None
    max_velocity_y_mps: Speed | None = None
    max_velocity_z_mps: Speed | None = None
    max_roll_rate_rad_s: AngularSpeed | None = None
    max_pitch_rate_rad_s: AngularSpeed | None = None
    max_yaw_rate_rad_s: AngularSpeed | None = None


@message(0x4402, presence="H")
class ReportGlobalPose(Message):
    """Pose on the globe."""

    latitude_deg: Latitude | None = None
    longitude_deg: Longitude | None = None
    elevation_m: Elevation | None = None
    position_rms_m: Rms | None = None
    roll_rad: Attitude | None = None
    pitch_rad: Attitude | None = None
    yaw_rad: Attitude | None = None
    attitude_rms_rad: AngleRms | None = None
    time_stamp: Time | None = None
    date_stamp: Date | None = None
    """Not in every implementation; seen in a capture of a real vehicle."""


@message(0x4403, presence="H")
class ReportLocalPose(Message):
    """Pose in a local frame."""

    x_m: Place | None = None
    y_m: Place | None = None
    z_m: Elevation | None = None
    position_rms_m: Rms | None = None
    roll_rad: Attitude | None = None
    pitch_rad: Attitude | None = None
    yaw_rad: Attitude | None = None
    attitude_rms_rad: AngleRms | None = None
    time_stamp: Time | None = None


@message(0x4404, presence="H")
class ReportVelocityState(Message):
    """Velocities in the vehicle's frame; an XGV reports X and the time stamp."""

    velocity_x_mps: Velocity | None = None
    velocity_y_mps: Velocity | None = None
    velocity_z_mps: Velocity | None = None
    velocity_rms_mps: VelocityRms | None = None
    roll_rate_rad_s: AngularRate | None = None
    pitch_rate_rad_s: AngularRate | None = None
    yaw_rate_rad_s: AngularRate | None = None
    angular_rate_rms_rad_s: AngularRateRms | None = None
    time_stamp: Time | None = None
    date_stamp: Date | None = None
    """Not in every implementation; seen in a capture of a real vehicle."""


@message(0x4405, presence="H")
class ReportWrenchEffort(_WrenchEffort):
    """The efforts at work."""


@message(0x4406, presence="B")
class ReportDiscreteDevices(_DiscreteDevices):
    """State of engine, parking brake, horn, gear."""
