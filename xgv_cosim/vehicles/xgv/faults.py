"""Which errors and warnings of one XGV are raised, what keeps them, and what they take away (XGV-38)."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.actuation import LostFunction
from xgv_cosim.endpoint import EndpointChanged, EndpointEvent
from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.errors import (
    DOOR_WARNING,
    ERRORS,
    ESTOP_DISABLE_WARNING,
    ESTOP_PAUSE_WARNING,
    NOT_READY_WARNING,
    PARKING_BRAKE_WARNING,
    STEERING_WARNING,
    near_codes,
)
from xgv_cosim.vehicles.xgv.modes import DOOR_OPEN, STEERING_AWAITS_USER, STEERING_UNINITIALISED
from xgv_cosim.vehicles.xgv.settings import ErrorLatch


class Faults:
    """Errors and warnings in force.

    An error has a cause that lasts or is gone. Without a cause it goes by itself, but for the codes of
    the car's own hardware: they are latched until the operator clears them.

    Args:
        latch: Which errors outlast their cause.
        effects: Bits of ``actuation.LostFunction`` by error code.
    """

    def __init__(self, latch: ErrorLatch, effects: Mapping[int, int]) -> None:
        self._latch = latch
        self._effects = effects
        self._lasting: set[int] = set()
        """Errors whose cause lasts."""
        self._raised: set[int] = set()
        """Those and the latched ones."""
        self._warnings: frozenset[int] = frozenset({NOT_READY_WARNING})
        """Warnings that follow from modes and devices; a bound car begins in standby."""

    @property
    def codes(self) -> frozenset[int]:
        """Return every code in force, warnings included."""
        return self._warnings | self._raised

    @property
    def pauses(self) -> bool:
        """Return whether one of them pauses the car."""
        return any(ERRORS[code].pauses for code in self._raised)

    @property
    def lost_functions(self) -> int:
        """Return bits of ``actuation.LostFunction``: what the errors in force take away."""
        lost = 0
        for code in self._raised:
            lost |= self._effects.get(code, 0)
        return lost

    def taking(self, function: LostFunction) -> tuple[str, ...]:
        """Return the labels of the errors in force that take a function away."""
        return tuple(
            ERRORS[code].label for code in sorted(self._raised) if self._effects.get(code, 0) & function
        )

    def raise_code(self, code: int, *reasons: str) -> list[EndpointEvent]:
        """Raise an error or a warning; a repeat has no effect.

        Raises:
            ScenarioError: The XGV has no such code.
        """
        if code not in ERRORS:
            raise ScenarioError(
                f"error code: got {code!r}, expected one that the XGV has, for example {near_codes(code)}"
            )
        self._lasting.add(code)
        if code in self._raised:
            return []
        self._raised.add(code)
        return [EndpointChanged(_kind(code), "", str(code), (ERRORS[code].label, *reasons))]

    def end_cause(self, code: int) -> list[EndpointEvent]:
        """Take note that the cause of an error is gone; a latched one stays."""
        if code not in self._lasting:
            return []
        self._lasting.remove(code)
        if self._latch is ErrorLatch.HARDWARE and ERRORS[code].is_hardware:
            reason = f"{ERRORS[code].label}: its cause is gone, it stays until the operator clears it"
            return [EndpointChanged("error_latched", str(code), str(code), (reason,))]
        return self._clear(code, f"{ERRORS[code].label} cleared")

    def clear_latched(self) -> list[EndpointEvent]:
        """Clear the latched errors whose cause is gone; say which stay because theirs lasts."""
        events: list[EndpointEvent] = []
        for code in sorted(self._raised):
            if code not in self._lasting:
                events += self._clear(code, f"{ERRORS[code].label} cleared by the operator")
            elif ERRORS[code].is_hardware:
                reason = f"{ERRORS[code].label}: its cause lasts, so the operator cannot clear it"
                events.append(EndpointChanged("error_latched", str(code), str(code), (reason,)))
        return events

    def show_warnings(self, codes: Collection[int]) -> list[EndpointEvent]:
        """Let the warnings that follow from modes and devices be exactly ``codes``."""
        before, self._warnings = self._warnings, frozenset(codes)
        events: list[EndpointEvent] = [
            EndpointChanged("warning", str(code), "", (f"{ERRORS[code].label} cleared",))
            for code in sorted(before - self._warnings)
        ]
        events += [
            EndpointChanged("warning", "", str(code), (ERRORS[code].label,))
            for code in sorted(self._warnings - before)
        ]
        return events

    def _clear(self, code: int, reason: str) -> list[EndpointEvent]:
        self._raised.discard(code)
        return [EndpointChanged(_kind(code), str(code), "", (reason,))]


def _kind(code: int) -> str:
    return "warning" if ERRORS[code].is_warning else "error"


def warnings_of(
    safety_mode: SafetyMode, safety_devices: int, *, software_ready: bool, parking_brake_drags: bool = False
) -> frozenset[int]:
    """Return the warnings that follow from modes and devices; none of them pauses the car (XGV-38).

    Args:
        safety_mode: In force now; an inactive system warns of nothing.
        safety_devices: Bits of Report Vehicle Mode, field 6.
        software_ready: Neither control mode nor ready mode is software pause.
        parking_brake_drags: The computer drives, and the parking brake is set.
    """
    if safety_mode is SafetyMode.INACTIVE:
        return frozenset()
    causes = {
        ESTOP_DISABLE_WARNING: safety_mode is SafetyMode.ESTOP_DISABLE,
        ESTOP_PAUSE_WARNING: safety_mode is SafetyMode.ESTOP_PAUSE,
        PARKING_BRAKE_WARNING: parking_brake_drags,
        DOOR_WARNING: bool(safety_devices & DOOR_OPEN),
        STEERING_WARNING: bool(safety_devices & (STEERING_UNINITIALISED | STEERING_AWAITS_USER)),
        NOT_READY_WARNING: not software_ready,
    }
    return frozenset(code for code, holds in causes.items() if holds)
