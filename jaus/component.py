"""Component status and component control of RA 3.3, as transition tables (jaus core, no I/O, no clock)."""

from __future__ import annotations

from enum import Enum, IntEnum, auto


class ComponentStatus(IntEnum):
    """State of a component; the number is the low nibble of Report Component Status (XGV-21)."""

    INITIALIZE = 0
    READY = 1
    STANDBY = 2
    SHUTDOWN = 3
    FAILURE = 4
    EMERGENCY = 5


class StatusCommand(Enum):
    """A command that changes a component's status (XGV-25)."""

    RESUME = auto()
    STANDBY = auto()
    SHUTDOWN = auto()
    RESET = auto()
    SET_EMERGENCY = auto()
    CLEAR_EMERGENCY = auto()
