"""The states of a component."""

from __future__ import annotations

from enum import IntEnum


class ComponentStatus(IntEnum):
    """State of a component; the number is the low nibble of Report Component Status (XGV-21)."""

    INITIALIZE = 0
    READY = 1
    STANDBY = 2
    SHUTDOWN = 3
    FAILURE = 4
    EMERGENCY = 5
