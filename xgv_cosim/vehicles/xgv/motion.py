"""The motion command in force and the motions that wait behind it (XGV-43, XGV-58, XGV-70)."""

from __future__ import annotations

from collections import deque

from jaus.address import JausAddress
from xgv_cosim.commands import MotionProfile, MotionQueue, WrenchEffort
from xgv_cosim.endpoint import CommandAccepted, CommandDropped, EndpointEvent

MotionCommand = MotionProfile | MotionQueue | WrenchEffort
"""What Set Motion Profile and Set Wrench Effort carry."""

MOTION_PROFILE_RANGES = (
    ("speed_mps", -65.535, 65.535),
    ("max_accel_mps2", 0.0, 100.0),
    ("max_curvature_rate_per_m_s", 0.0, 10.0),
    ("duration_s", 0.0, 65.535),
)
"""What Set Motion Profile can carry (XGV-58); a value outside is not valid on any link."""
MOST_MOTIONS = 255
"""The number of motions is one byte (XGV-58)."""

_ROUNDING_S = 1e-9


class CommandInForce:
    """What the car is told to do, until when, and by whom.

    Args:
        wrench_timeout_s: Lifetime of wrench efforts.
    """

    def __init__(self, wrench_timeout_s: float) -> None:
        self._wrench_timeout_s = wrench_timeout_s
        self._waiting: deque[MotionProfile] = deque()
        self._expires_s = 0.0
        self.command: MotionProfile | WrenchEffort | None = None
        self.commander: JausAddress | None = None
        """Who sent it; stays after the command has ended."""

    @property
    def num_waiting(self) -> int:
        """Return how many motions wait behind the one in force."""
        return len(self._waiting)

    def take(self, command: MotionCommand, sender: JausAddress, now_s: float) -> CommandAccepted:
        """Put a command in force; it replaces the one before and all that wait (XGV-70)."""
        self._waiting.clear()
        self.commander = sender
        if isinstance(command, WrenchEffort):
            self.command, lifetime_s = command, self._wrench_timeout_s
        else:
            motions = motions_of(command)
            self._waiting.extend(motions[1:])
            self.command, lifetime_s = motions[0], motions[0].duration_s
        self._expires_s = now_s + lifetime_s
        return CommandAccepted(self.command, self._expires_s)

    def advance(self, now_s: float) -> CommandAccepted | None:
        """Put the next waiting motion in force when one has expired; None: the last one has ended.

        Each motion begins when the one before ended, so that a queue takes the sum of its durations.
        """
        while self._waiting:
            self.command = self._waiting.popleft()
            self._expires_s += self.command.duration_s
            if self._expires_s > now_s + _ROUNDING_S:
                return CommandAccepted(self.command, self._expires_s)
        self.command = None
        return None

    def delay(self, stopped_s: float) -> None:
        """Put the end of the command in force off by a time in which the clock stood still (XGV-67)."""
        self._expires_s += stopped_s

    def drop(self, reason: str) -> list[EndpointEvent]:
        """Drop the command in force and all that wait (XGV-70)."""
        self._waiting.clear()
        if self.command is None:
            return []
        self.command = None
        return [CommandDropped(reason)]

    def drop_waiting(self) -> int:
        """Drop what waits behind the command in force and return how much that was (XGV-70)."""
        count = len(self._waiting)
        self._waiting.clear()
        return count


def motions_of(command: MotionProfile | MotionQueue) -> tuple[MotionProfile, ...]:
    """Return the motions of a command, one or more."""
    return command.motions if isinstance(command, MotionQueue) else (command,)


def motion_fault(command: MotionProfile | MotionQueue, *, allow_many: bool) -> str:
    """Return what makes a Set Motion Profile invalid, empty if nothing does (XGV-58, XGV-70)."""
    motions = motions_of(command)
    if len(motions) > 1 and not allow_many:
        return (
            f"MotionQueue.motions: got {len(motions)}, expected 1: "
            "the XGV takes several only with xgv.motion.allow_many (XGV-70)"
        )
    if len(motions) > MOST_MOTIONS:
        return f"MotionQueue.motions: got {len(motions)}, expected 1 to {MOST_MOTIONS}"
    for motion in motions:
        fault = _value_fault(motion)
        if fault:
            return fault
    return ""


def _value_fault(motion: MotionProfile) -> str:
    """Return which value Set Motion Profile cannot carry, empty if it can carry all."""
    for name, lower, upper in MOTION_PROFILE_RANGES:
        value = getattr(motion, name)
        if not lower <= value <= upper:
            return f"MotionProfile.{name}: got {value!r}, expected {lower:g} to {upper:g}"
    return ""
