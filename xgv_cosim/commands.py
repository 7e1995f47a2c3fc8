"""Motion commands as values (as they arrive) and as columns (as the controllers read them)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from xgv_cosim.actuation import Gear
from xgv_cosim.columns import FloatColumn, UInt8Column
from xgv_cosim.errors import CommandError


class CommandKind(IntEnum):
    """Which kind of command a row of ``CommandColumns`` holds."""

    NONE = 0
    """No live command: none accepted yet, dropped, or expired."""
    MOTION_PROFILE = 1
    WRENCH_EFFORT = 2


def _require_finite(command: MotionProfile | WrenchEffort) -> None:
    for field in fields(command):
        value = getattr(command, field.name)
        if not math.isfinite(value):
            raise CommandError(
                f"{type(command).__name__}.{field.name}: got {value!r}, expected a finite number; "
                "the command was not sent"
            )


def _require_members(command: DiscreteDevices | Signals, **kinds: type[bool | IntEnum]) -> None:
    for name, kind in kinds.items():
        value = getattr(command, name)
        if value is not None and not isinstance(value, kind):
            names = ", ".join(member.name for member in kind) if issubclass(kind, IntEnum) else "True, False"
            raise CommandError(
                f"{type(command).__name__}.{name}: got {value!r}, expected {kind.__name__} ({names}) "
                "or None; the message was not sent"
            )


@dataclass(frozen=True, slots=True)
class MotionProfile:
    """One motion of Set Motion Profile: closed-loop speed and curvature (XGV-05, XGV-58).

    Raises:
        CommandError: A value is NaN or infinite, or a limit or the duration is negative.
    """

    speed_mps: float
    """Desired speed, negative in reverse."""
    max_accel_mps2: float
    """Greatest acceleration and deceleration towards it; 0 holds the speed (XGV-70)."""
    curvature_per_m: float
    """Desired path curvature, positive counter-clockwise (left)."""
    max_curvature_rate_per_m_s: float
    """Greatest rate of change of curvature; 0 holds the curvature (XGV-70)."""
    duration_s: float
    """How long the motion lasts; then it has expired (XGV-43)."""

    def __post_init__(self) -> None:
        _require_finite(self)
        for name in ("max_accel_mps2", "max_curvature_rate_per_m_s", "duration_s"):
            if getattr(self, name) < 0.0:
                raise CommandError(f"MotionProfile.{name}: got {getattr(self, name)!r}, expected 0 or more")


@dataclass(frozen=True, slots=True)
class WrenchEffort:
    """Set Wrench Effort: open-loop throttle, brake and steering (XGV-09, XGV-59).

    Raises:
        CommandError: A value is NaN or infinite, or outside its range.
    """

    throttle: float
    """Share of full throttle, 0 to 1. The message's propulsive effort has room down to -100 %; that is no
    command here, since a throttle pulls nothing back: the car goes backwards in its reverse gear."""
    brake: float
    """Share of full brake effort, 0 to 1."""
    steering: float
    """Share of the greatest road-wheel angle, -1 to 1, positive counter-clockwise (left)."""

    def __post_init__(self) -> None:
        _require_finite(self)
        for name, lower in (("throttle", 0.0), ("brake", 0.0), ("steering", -1.0)):
            value = getattr(self, name)
            if not lower <= value <= 1.0:
                hint = "; backwards is Gear.REVERSE, and slower is the brake" if name == "throttle" else ""
                raise CommandError(f"WrenchEffort.{name}: got {value!r}, expected {lower:g} to 1{hint}")


@dataclass(frozen=True, slots=True)
class MotionQueue:
    """Set Motion Profile with several motions, driven one after the other (XGV-58, XGV-70).

    Raises:
        CommandError: It holds no motion.
    """

    motions: tuple[MotionProfile, ...]

    def __post_init__(self) -> None:
        if not self.motions:
            raise CommandError("MotionQueue.motions: got none, expected one or more")


@dataclass(frozen=True, slots=True)
class DiscreteDevices:
    """Set Discrete Devices: gear, engine, parking brake; None leaves a device (XGV-09, XGV-34, XGV-60).

    Raises:
        CommandError: A value of another type.
    """

    gear: Gear | None = None
    engine_on: bool | None = None
    parking_brake: bool | None = None
    """True sets it, False releases it."""

    def __post_init__(self) -> None:
        _require_members(self, gear=Gear, engine_on=bool, parking_brake=bool)


class Turn(IntEnum):
    """Turn signals as the wire numbers them (XGV-61)."""

    OFF = 0
    LEFT = 1
    RIGHT = 2
    HAZARD = 3


class Headlights(IntEnum):
    """Headlights as the wire numbers them (XGV-61)."""

    OFF = 0
    PARKING = 1
    ON = 2


@dataclass(frozen=True, slots=True)
class Signals:
    """Set Signals: turn signals, horn, headlights; None leaves a device as it is (XGV-11, XGV-34).

    Raises:
        CommandError: A value of another type.
    """

    turn: Turn | None = None
    horn: bool | None = None
    headlights: Headlights | None = None

    def __post_init__(self) -> None:
        _require_members(self, turn=Turn, horn=bool, headlights=Headlights)


class CommandColumns(NamedTuple):
    """The command in force of each slot; every column has shape ``(num_slots,)``."""

    kind: UInt8Column
    """``CommandKind``; ``NONE`` means no live command."""
    expires_s: FloatColumn
    """Simulation time at which the command ends, ``inf`` where there is none (XGV-43)."""
    speed_mps: FloatColumn
    """Commanded speed."""
    max_accel_mps2: FloatColumn
    """Commanded limit of acceleration and deceleration."""
    curvature_per_m: FloatColumn
    """Commanded curvature, positive counter-clockwise."""
    max_curvature_rate_per_m_s: FloatColumn
    """Commanded limit of the rate of change of curvature."""
    throttle: FloatColumn
    """Commanded throttle share."""
    brake: FloatColumn
    """Commanded brake share."""
    steering: FloatColumn
    """Commanded share of the greatest road-wheel angle, positive counter-clockwise."""


def empty_commands(num_slots: int) -> CommandColumns:
    """Return the columns of a fleet without commands."""
    zeros = [np.zeros(num_slots) for _ in range(7)]
    return CommandColumns(np.zeros(num_slots, np.uint8), np.full(num_slots, np.inf), *zeros)
