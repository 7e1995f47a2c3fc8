"""The modes of the ByWire XGV and what they come from, by their codes on the wire (XGV-48 to XGV-52)."""

from __future__ import annotations

from enum import IntEnum


class ControlMode(IntEnum):
    """Which kind of command the car executes; wire codes of Report Vehicle Mode, field 2 (XGV-48)."""

    UNKNOWN = 0
    """Not computed: the system is not active (XGV-32)."""
    SOFTWARE_PAUSE = 1
    WRENCH_EFFORTS = 2
    MOTION_PROFILES = 3


class ReadyMode(IntEnum):
    """The pause that user software commands; wire codes of Report Vehicle Mode, field 3 (XGV-49)."""

    UNKNOWN = 0
    """Not computed: the system is not active (XGV-32)."""
    SOFTWARE_PAUSE = 1
    READY = 2


class SafetyMode(IntEnum):
    """Final operating state; wire codes of Report Vehicle Mode, field 4 (XGV-50).

    The enumeration is that of the note's text, 1 to 11 without a gap: its damaged table hides none (XGV-54).

    The codes from 1 on rise with precedence, so the mode in force is the greatest active one.
    """

    INACTIVE = 0
    """The system is not active: no mode is computed, and the car is silent (XGV-01, XGV-32)."""
    DRIVE_BY_WIRE = 1
    SOFTWARE_PAUSE = 2
    """The wire's 2 to 7 all mean software pause; this version emits 2 (XGV-50)."""
    ESTOP_PAUSE = 8
    MANUAL_OVERRIDE = 9
    EMERGENCY_MANUAL_OVERRIDE = 10
    ESTOP_DISABLE = 11


def safety_mode_of(code: int) -> SafetyMode:
    """Return what field 4 of Report Vehicle Mode means to a client (XGV-50).

    All of 2 to 7 are software pause, whatever the reason; what is reserved says no more than 0, unknown.
    """
    if SafetyMode.SOFTWARE_PAUSE <= code < SafetyMode.ESTOP_PAUSE:
        return SafetyMode.SOFTWARE_PAUSE
    return SafetyMode(code) if 0 <= code <= SafetyMode.ESTOP_DISABLE else SafetyMode.INACTIVE


class PartialOverrideBit(IntEnum):
    """Bits of the partial overrides (XGV-51)."""

    STEERING_MANUAL = 0
    SPEED_MANUAL = 1


class SafetyDeviceBit(IntEnum):
    """Bits of the safety devices in Report Vehicle Mode (XGV-52)."""

    MANUAL_OVERRIDE = 0
    SAFESTOP_PAUSE = 1
    SAFESTOP_STOP = 2
    LINK_BYPASS = 3
    """The two link bits: 0 none, 1 bypass, 2 good."""
    LINK_GOOD = 4
    EXTERNAL_ESTOP = 5
    DOOR = 6
    ERRORS = 7
    EMERGENCY_MANUAL_OVERRIDE = 8
    STEERING_UNINITIALISED = 9
    AWAITING_USER = 10
