"""Error codes of the XGV's Error Manager, and which of them pause the car (XGV-38).

The codes are those of Report Error Count as public clients know them; the texts are ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

MOTION_PROFILES_TIMEOUT = 9157
"""The last motion expired without a successor (XGV-43)."""
WRENCH_EFFORTS_TIMEOUT = 9158
"""Wrench efforts stopped coming (XGV-43)."""
COMMAND_TIMEOUTS = frozenset({MOTION_PROFILES_TIMEOUT, WRENCH_EFFORTS_TIMEOUT})
"""Errors that a freshly accepted command clears (XGV-43)."""
CONTROLLER_FAILED = 9156
"""Module communication: the nearest code to a car whose own controllers yield no valid numbers."""
ESTOP_DISABLE_WARNING = 9143
ESTOP_PAUSE_WARNING = 9144
PARKING_BRAKE_WARNING = 9175
DOOR_WARNING = 9176
STEERING_WARNING = 9177
NOT_READY_WARNING = 9178


@dataclass(frozen=True, slots=True)
class XgvError:
    """One error code."""

    code: int
    text: str
    is_warning: bool = False

    @property
    def pauses(self) -> bool:
        """Return whether it sets bit 7, "paused due to errors"; warnings and 9138 do not (XGV-38)."""
        return not self.is_warning and self.code != SAFESTOP_LINK_LOSS

    @property
    def is_hardware(self) -> bool:
        """Return whether it is a fault of the car itself, which ``xgv.errors.latch`` keeps (XGV-38)."""
        return self.pauses and self.code not in COMMAND_TIMEOUTS

    @property
    def label(self) -> str:
        """Return code and text as reasons show them."""
        return f"{'warning' if self.is_warning else 'error'} {self.code} {self.text}"


SAFESTOP_LINK_LOSS = 9138
"""Reported, but its effect comes from the relays alone (XGV-38, XGV-42)."""

_ERROR_TEXTS = {
    9101: "steering initialisation",
    9103: "steering communication",
    9104: "steering feedback",
    9106: "throttle communication",
    9107: "speed feedback",
    9108: "wheel speed feedback",
    9109: "brake",
    9110: "brake communication",
    9111: "brake at reduced duty",
    9113: "shifter communication",
    9115: "transmission communication",
    9137: "SafeStop communication",
    SAFESTOP_LINK_LOSS: "SafeStop link loss",
    9139: "fuses",
    9145: "power distribution communication",
    9149: "devices communication",
    9150: "horn",
    9153: "lights",
    CONTROLLER_FAILED: "module communication",
    MOTION_PROFILES_TIMEOUT: "motion profiles timeout",
    WRENCH_EFFORTS_TIMEOUT: "wrench efforts timeout",
    9159: "controller's own CAN bus",
    9160: "vehicle CAN bus",
    9161: "fuel feedback",
    9162: "door communication",
    9163: "12 V battery",
    9164: "CPU load high",
    9165: "reset to defaults failed",
}
_WARNING_TEXTS = {
    ESTOP_DISABLE_WARNING: "e-stop disable",
    ESTOP_PAUSE_WARNING: "e-stop pause",
    PARKING_BRAKE_WARNING: "parking brake",
    DOOR_WARNING: "door open",
    STEERING_WARNING: "steering not initialised",
    NOT_READY_WARNING: "not ready to run",
    9179: "restarting",
    9180: "updating firmware",
}

ERRORS: Mapping[int, XgvError] = MappingProxyType(
    {code: XgvError(code, text) for code, text in _ERROR_TEXTS.items()}
    | {code: XgvError(code, text, is_warning=True) for code, text in _WARNING_TEXTS.items()}
)
"""Every known code."""


def near_codes(code: int, count: int = 3) -> str:
    """Return the known codes nearest to an unknown one, each with its text."""
    nearest = sorted(ERRORS, key=lambda known: (abs(known - code), known))[:count]
    return ", ".join(f"{known} {ERRORS[known].text}" for known in sorted(nearest))
