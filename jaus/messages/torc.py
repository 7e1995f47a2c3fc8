"""Messages of the TORC ByWire XGV, all experimental; positive curvature turns right (XGV-47 to XGV-61).

What is not public is proposed here and says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from jaus.fields import Byte, Integer, Scaled, Time
from jaus.messages.base import Message, message, record
from jaus.vehicle_mode import ControlMode, PartialOverrideBit, ReadyMode, SafetyDeviceBit, SafetyMode


class SecondaryStatusBit(IntEnum):
    """Bits of the secondary status of the two drivers: another order than ``SafetyDeviceBit`` (XGV-46)."""

    MANUAL_OVERRIDE = 16
    SAFESTOP_PAUSE = 17
    SAFESTOP_STOP = 18
    LINK_BYPASS = 19
    LINK_GOOD = 20
    EXTERNAL_ESTOP = 21
    STEERING_MANUAL = 22
    SPEED_MANUAL = 23
    DOOR = 24
    ERRORS = 25
    EMERGENCY_MANUAL_OVERRIDE = 26
    STEERING_UNINITIALISED = 27
    AWAITING_USER = 28


class TurnSignal(IntEnum):
    """Turn signals (XGV-61)."""

    OFF = 0
    LEFT = 1
    RIGHT = 2
    HAZARD = 3


class ErrorCode(IntEnum):
    """Error codes of the XGV."""

    STEERING_INITIALISATION = 9101
    STEERING_COMMUNICATION = 9103
    STEERING_FEEDBACK = 9104
    THROTTLE_COMMUNICATION = 9106
    SPEED_FEEDBACK = 9107
    WHEEL_SPEED_FEEDBACK = 9108
    BRAKE = 9109
    BRAKE_COMMUNICATION = 9110
    BRAKE_REDUCED_DUTY = 9111
    SHIFTER_COMMUNICATION = 9113
    TRANSMISSION_COMMUNICATION = 9115
    SAFESTOP_COMMUNICATION = 9137
    SAFESTOP_LINK_LOSS = 9138
    FUSES = 9139
    ESTOP_DISABLE_WARNING = 9143
    ESTOP_PAUSE_WARNING = 9144
    POWER_DISTRIBUTION_COMMUNICATION = 9145
    DEVICES_COMMUNICATION = 9149
    HORN = 9150
    LIGHT = 9153
    MODULE_COMMUNICATION = 9156
    MOTION_PROFILES_TIMEOUT = 9157
    WRENCH_EFFORTS_TIMEOUT = 9158
    TORC_CAN = 9159
    FORD_CAN = 9160
    FUEL_FEEDBACK = 9161
    DOOR_COMMUNICATION = 9162
    BATTERY_12_V = 9163
    CPU_HIGH = 9164
    RESET_TO_DEFAULTS_FAILED = 9165
    PARKING_BRAKE_WARNING = 9175
    DOOR_OPEN_WARNING = 9176
    STEERING_NOT_INITIALISED_WARNING = 9177
    NOT_READY_TO_RUN_WARNING = 9178
    RESTARTING_WARNING = 9179
    UPDATING_FIRMWARE_WARNING = 9180


SignedSpeed = Annotated[float, Scaled("H", -65.535, 65.535, "m/s")]
AtanCurvature = Annotated[float, Scaled("H", -math.pi / 2, math.pi / 2, "rad")]


@record
class Motion:
    """One motion of Set Motion Profile (XGV-58)."""

    speed_mps: SignedSpeed
    """Desired speed, negative in reverse."""
    max_acceleration_mps2: Annotated[float, Scaled("H", 0.0, 100.0, "m/s²")]
    """Greatest acceleration and deceleration."""
    atan_curvature_rad: AtanCurvature
    """Arc tangent of the desired curvature in 1/m, positive to the right."""
    max_curvature_rate_per_m_s: Annotated[float, Scaled("H", 0.0, 10.0, "1/(m s)")]
    duration_ms: Annotated[int, Integer("H", unit="ms")]


@record
class Horn:
    """The horn; the two periods are not in use."""

    on: Byte
    on_period: Byte = 0
    off_period: Byte = 0


@record
class Lights:
    """The lights: 0 off, 1 parking, 2 on; with bit 3 high beam, with bit 4 fog; two bytes not in use."""

    headlights: Byte
    on_period: Byte = 0
    off_period: Byte = 0


@dataclass(slots=True)
class _Signals(Message):
    version: Byte = 0
    turn_signal: Annotated[int, Integer("B", TurnSignal)] | None = None
    horn: Horn | None = None
    lights: Lights | None = None


@dataclass(slots=True)
class _Versioned(Message):
    version: Byte = 0


@message(0xE328)
class SetMotionProfile(Message):
    """Closed-loop speed and curvature; several motions are driven one after the other (XGV-58)."""

    version: Byte = 1
    motions: tuple[Motion, ...] = ()


@message(0xE322, presence="B", presence_at=1)
class SetSignals(_Signals):
    """Turn signals, horn, lights (XGV-61)."""


@message(0xE445, presence="B", presence_at=1)
class ReportSignals(_Signals):
    """State of turn signals, horn, lights (XGV-61)."""


@message(0xE42E)
class ReportWheelsSpeed(Message):
    """Speed at each wheel."""

    version: Byte
    right_front_mps: SignedSpeed
    left_front_mps: SignedSpeed
    right_rear_mps: SignedSpeed
    left_rear_mps: SignedSpeed
    time_stamp: Time


@message(0xE451)
class ReportErrorCount(Message):
    """The errors and warnings that are present (XGV-61)."""

    version: Byte = 1
    reserved: Byte = 0
    errors: tuple[Annotated[int, Integer("i", ErrorCode)], ...] = ()


@message(0xE455)
class ReportCurvature(Message):
    """The car's curvature."""

    version: Byte
    atan_curvature_rad: AtanCurvature
    """Arc tangent of the curvature in 1/m, positive to the right."""
    time_stamp: Time


@message(0xE456)
class ReportVehicleMode(Message):
    """The car's modes and safety devices (XGV-47 to XGV-52)."""

    version: Byte
    control_mode: Annotated[int, Integer("B", ControlMode)]
    ready_mode: Annotated[int, Integer("B", ReadyMode)]
    safety_mode: Annotated[int, Integer("B", SafetyMode)]
    partial_override_bits: Annotated[int, Integer("B", PartialOverrideBit, bits=True)]
    safety_device_bits: Annotated[int, Integer("H", SafetyDeviceBit, bits=True)]


@message(0xE22E)
class QueryWheelsSpeed(_Versioned):
    """Ask for Report Wheels Speed. Not public, proposed here."""


@message(0xE245)
class QuerySignals(_Versioned):
    """Ask for Report Signals. Not public, proposed here."""


@message(0xE251)
class QueryErrorCount(_Versioned):
    """Ask for Report Error Count. Not public, proposed here."""


@message(0xE255)
class QueryCurvature(_Versioned):
    """Ask for Report Curvature. Not public, proposed here."""


@message(0xE256)
class QueryVehicleMode(_Versioned):
    """Ask for Report Vehicle Mode. Not public, proposed here."""


@message(0xE351)
class ClearErrors(_Versioned):
    """Have the Error Manager forget its errors. Not public, proposed here."""
