"""Injections as data: what happens to which vehicles, from when to when.

The same rows drive a test, a demonstration and a study. The vocabulary is shared by all vehicle
profiles; a profile that lacks a kind says "unsupported" in the event log instead of ignoring it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from xgv_cosim.condition import Condition
from xgv_cosim.traveller import Traveller


class InjectionKind(StrEnum):
    """The event vocabulary shared by all profiles (requirements: cross-profile rules)."""

    ESTOP_PAUSE = "estop_pause"
    """The SafeStop transmitter's toggle asks for pause (XGV-28)."""
    ESTOP_DISABLE = "estop_disable"
    """The SafeStop transmitter's stop button is pressed (XGV-31)."""
    ESTOP_BUTTON = "estop_button"
    """A hard-wired emergency stop button is pressed; it latches, and the injection's end is the hand
    that resets it (XGV-31, XGV-37)."""
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
    BYPASS = "bypass"
    """The SafeStop receiver is switched to bypass: its link is not supervised (XGV-42)."""
    RECEIVER_DEAD = "receiver_dead"
    """The SafeStop receiver is dead (XGV-42)."""
    RELAY_STUCK_PAUSE = "relay_stuck_pause"
    """The SafeStop pause relay stays as it is when this begins (XGV-42)."""
    RELAY_STUCK_STOP = "relay_stuck_stop"
    """The SafeStop stop relay stays as it is when this begins (XGV-42)."""
    STEERING_UNINITIALISED = "steering_uninitialised"
    """The steering needs to be initialised, until an operator has done so (XGV-69)."""
    STEERING_AWAITS_USER = "steering_awaits_user"
    """The steering's initialisation waits for an operator's OK (XGV-69)."""
    FROZEN = "frozen"
    """The vehicle's controller is frozen: last outputs held, nothing computed or answered (XGV-67)."""
    INACTIVE = "inactive"
    """The vehicle's system is not active: not booted (XGV-01, XGV-32)."""
    PAUSE_REQUEST = "pause_request"
    """Somebody asks the vehicle's controller to pause (GKC-17)."""
    SHUTDOWN = "shutdown"
    """Somebody asks the vehicle's controller to shut down (GKC-20)."""
    REINIT = "reinit"
    """Somebody asks the vehicle's controller to initialise itself anew (GKC-27)."""


class OperatorAction(StrEnum):
    """What an operator does at the vehicle itself, beside devices that stay as he leaves them."""

    REARM = "rearm"
    """Allow Resume again after a stop whose key says ``operator`` (XGV-37)."""
    INITIALISE_STEERING = "initialise_steering"
    """Initialise the steering and press OK (XGV-69)."""


@dataclass(frozen=True, slots=True)
class Injection:
    """One injection on some vehicles; overlapping ones of the same kind and vehicle count as one."""

    tick: int
    """Control tick on which it begins to act; with a condition, from which on it waits for that."""
    kind: InjectionKind
    vehicle_ids: tuple[str, ...] = ()
    """Vehicles named outright; one that is not bound then is an event of its own."""
    matches: Callable[[Traveller], bool] | None = None
    """Says who is chosen; asked of the vehicles that are bound when it begins."""
    end_tick: int | None = None
    """Control tick on which it ends; None: it stays (latching is the vehicle's business)."""
    code: int | None = None
    """Error code, for kind ``error``."""
    transmitter: str = ""
    """Instead of vehicles: the transmitter of a wireless stop that is pressed, or loses its radio."""
    selector: str = ""
    """Whom ``matches`` chooses, and which row of a scenario says so, in words for messages."""
    condition: Condition | None = None
    """It begins for each vehicle by itself, once, when this holds; ``end_tick`` then tells how long for."""
