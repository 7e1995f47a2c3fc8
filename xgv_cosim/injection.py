"""Injections as data: what happens to which vehicles, from when to when.

The same rows drive a test, a demonstration and a study. The vocabulary is shared by all vehicle
profiles; a profile that lacks a kind says "unsupported" in the event log instead of ignoring it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum


class InjectionKind(StrEnum):
    """The event vocabulary shared by all profiles (requirements: cross-profile rules)."""

    ESTOP_PAUSE = "estop_pause"
    """The SafeStop transmitter's toggle asks for pause (XGV-28)."""
    ESTOP_DISABLE = "estop_disable"
    """The SafeStop transmitter's stop button is pressed (XGV-31)."""
    ESTOP_BUTTON = "estop_button"
    """A hard-wired emergency stop button is pressed (XGV-31)."""
    OVERRIDE = "override"
    """Manual override is engaged (XGV-29)."""
    EMO = "emo"
    """Emergency manual override is engaged (XGV-30)."""
    DOOR = "door"
    """A door or the liftgate stands open (XGV-27)."""
    ERROR = "error"
    """The vehicle detects an internal error; ``code`` says which (XGV-38)."""
    CMD_LOSS = "cmd_loss"
    """Nothing that the stack sends reaches the vehicle (XGV-43)."""
    LINK = "link"
    """The SafeStop radio link is lost (XGV-42)."""
    PAUSE_REQUEST = "pause_request"
    SHUTDOWN = "shutdown"
    REINIT = "reinit"


@dataclass(frozen=True, slots=True)
class Injection:
    """One injection on some vehicles; overlapping ones of the same kind and vehicle count as one."""

    tick: int
    """Control tick on which it begins to act."""
    kind: InjectionKind
    vehicle_ids: tuple[str, ...] = ()
    """Vehicles named outright; one that is not bound then is an event of its own."""
    matches: Callable[[str, str], bool] | None = None
    """(vehicle id, type id) -> chosen; asked of the vehicles that are bound when it begins."""
    end_tick: int | None = None
    """Control tick on which it ends; None: it stays (latching is the vehicle's business)."""
    code: int | None = None
    """Error code, for kind ``error``."""
