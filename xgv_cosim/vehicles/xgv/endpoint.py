"""The XGV's endpoint: its two drivers, the command in force, and the errors of the controller.

It takes typed messages and says what they caused. It reads no clock and moves no bytes, so that the
in-process link and a wire link meet the same component logic.
"""

from __future__ import annotations

from typing import assert_never

from jaus.address import ComponentId, JausAddress
from jaus.component import Component, ComponentStatus
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import (
    CommandAccepted,
    CommandDropped,
    CommandStatus,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    StackMessage,
)
from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.drivers import Drivers
from xgv_cosim.vehicles.xgv.errors import (
    COMMAND_TIMEOUTS,
    ERRORS,
    MOTION_PROFILES_TIMEOUT,
    WRENCH_EFFORTS_TIMEOUT,
)
from xgv_cosim.vehicles.xgv.modes import (
    ERRORS_DETECTED,
    ControlMode,
    ReadyMode,
    resolve_control_mode,
    resolve_ready_mode,
)
from xgv_cosim.vehicles.xgv.reasons import (
    COMPONENT_NAMES,
    control_mode_reason,
    mode_name,
    ready_mode_reasons,
    safety_mode_reasons,
)
from xgv_cosim.vehicles.xgv.settings import XgvSettings

MOTION_PROFILE_RANGES = (
    ("speed_mps", -65.535, 65.535),
    ("max_accel_mps2", 0.0, 100.0),
    ("max_curvature_rate_per_m_s", 0.0, 10.0),
    ("duration_s", 0.0, 65.535),
)
"""What Set Motion Profile can carry (XGV-58); a value outside is not valid on any link."""


class XgvEndpoint:
    """One XGV's components and errors. Implements ``xgv_cosim.endpoint.Endpoint``.

    Args:
        settings: Settings of the vehicle.
        subsystem: Subsystem number of its JAUS addresses.
    """

    def __init__(self, settings: XgvSettings, subsystem: int = 1) -> None:
        self._settings = settings
        self._drivers = Drivers(subsystem, settings.mpd_request_period_s, settings.initialize_s)
        self._command: MotionProfile | WrenchEffort | None = None
        self._commander: JausAddress | None = None
        self._errors: set[int] = set()
        self._control_mode = self._resolve_control_mode()
        self._ready_mode = self._resolve_ready_mode()

    @property
    def control_mode(self) -> ControlMode:
        """Return the control mode (XGV-15)."""
        return self._control_mode

    @property
    def ready_mode(self) -> ReadyMode:
        """Return the ready mode (XGV-22 to 24)."""
        return self._ready_mode

    @property
    def device_bits(self) -> int:
        """Return bit 7, "paused due to errors", if an error that pauses is raised (XGV-38)."""
        return ERRORS_DETECTED if any(ERRORS[code].pauses for code in self._errors) else 0

    @property
    def errors(self) -> frozenset[int]:
        """Return the codes that are raised, warnings included."""
        return frozenset(self._errors)

    @property
    def component_status(self) -> dict[ComponentId, ComponentStatus]:
        """Return the status of both drivers."""
        return {name: component.status for name, component in self._drivers.by_id.items()}

    @property
    def component_controller(self) -> dict[ComponentId, JausAddress | None]:
        """Return who controls both drivers, None for nobody."""
        return {name: component.controller for name, component in self._drivers.by_id.items()}

    @property
    def next_deadline_s(self) -> float:
        """Return when the MPD's next request or the end of an initialisation is due."""
        return self._drivers.next_deadline_s

    def receive(self, message: StackMessage, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        """Take one message; one without effect is refused with a reason, or is a mere repeat.

        "Accepted" means that the sender controls the component, the message fits the control mode and
        its values are valid, whatever the safety mode (cross-profile rules).
        """
        match message:
            case RequestControl():
                events = self._drivers.request_control(message, sender, now_s)
            case ReleaseControl():
                events = self._drivers.release_control(message, sender, now_s)
            case CommandStatus():
                events = self._drivers.command_status(message, sender, now_s)
            case MotionProfile() | WrenchEffort():
                return self._take_command(message, sender, now_s)
            case _:
                assert_never(message)
        return events + self._enter_modes()

    def handle_deadline(self, now_s: float) -> list[EndpointEvent]:
        """Let the MPD ask for the PD again (XGV-19), and let initialisations end."""
        return self._drivers.handle_deadline(now_s) + self._enter_modes()

    def command_expired(self, now_s: float) -> list[EndpointEvent]:
        """Raise 9157 or 9158, by the kind of the command that has ended (XGV-43)."""
        if self._command is None:
            return []
        is_motion = isinstance(self._command, MotionProfile)
        self._command = None
        return self.raise_error(MOTION_PROFILES_TIMEOUT if is_motion else WRENCH_EFFORTS_TIMEOUT, now_s)

    def raise_error(self, code: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Raise an error or a warning (XGV-38); a repeat has no effect.

        Raises:
            ScenarioError: The XGV has no such code.
        """
        if code not in ERRORS:
            known = ", ".join(map(str, sorted(ERRORS)))
            raise ScenarioError(f"error code: got {code!r}, expected one that the XGV has: {known}")
        if code in self._errors:
            return []
        self._errors.add(code)
        return [EndpointChanged("error", "", str(code), (ERRORS[code].label,))]

    def clear_error(self, code: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Clear an error or a warning; one that is not raised stays so."""
        if code not in self._errors:
            return []
        self._errors.remove(code)
        return [EndpointChanged("error", str(code), "", (f"{ERRORS[code].label} cleared",))]

    def reasons(self, safety_devices: int) -> tuple[str, ...]:
        """Return why the safety mode is what it is, strongest cause first."""
        return safety_mode_reasons(
            safety_devices,
            self._errors,
            self._control_mode,
            self._ready_mode,
            self._drivers.primitive,
            self._drivers.profile,
        )

    def _take_command(
        self, command: MotionProfile | WrenchEffort, sender: JausAddress, now_s: float
    ) -> list[EndpointEvent]:
        """Accept or refuse a motion command; it replaces the one in force (XGV-10, XGV-16)."""
        if isinstance(command, MotionProfile):
            target, mode = self._drivers.profile, ControlMode.MOTION_PROFILES
            expires_s = now_s + command.duration_s
            fault = _motion_fault(command)
        else:
            target, mode = self._drivers.primitive, ControlMode.WRENCH_EFFORTS
            expires_s = now_s + self._settings.wrench_timeout_s
            fault = ""
        reason = self._why_refused(target, mode, sender) or fault
        if reason:
            return [MessageRefused(command, reason)]
        self._command, self._commander = command, sender
        events: list[EndpointEvent] = [CommandAccepted(command, expires_s)]
        for code in sorted(COMMAND_TIMEOUTS & self._errors):
            events += self.clear_error(code, now_s)
        return events

    def _why_refused(self, target: Component, mode: ControlMode, sender: JausAddress) -> str:
        """Return why a motion command of ``sender`` is not accepted, empty if it is."""
        why = control_mode_reason(self._control_mode, self._drivers.primitive, self._drivers.profile)
        in_force = f"control mode is {mode_name(self._control_mode)} ({why})"
        if target.controller != sender:
            holder = self._drivers.holder_name(target.controller)
            name = COMPONENT_NAMES[ComponentId(target.address.component)]
            return f"{holder} controls the {name}, not {sender}; {in_force}"
        if self._control_mode is not mode:
            return f"{in_force}, but the command needs {mode_name(mode)}"
        return ""

    def _resolve_control_mode(self) -> ControlMode:
        return resolve_control_mode(
            self._drivers.primitive.controller,
            self._drivers.profile.controller,
            mpd_address=self._drivers.profile.address,
            both_clients=self._settings.control_mode_both_clients,
        )

    def _resolve_ready_mode(self) -> ReadyMode:
        return resolve_ready_mode(
            self._control_mode, self._drivers.primitive.status, self._drivers.profile.status
        )

    def _enter_modes(self) -> list[EndpointEvent]:
        """Compute control and ready mode anew, and drop a command that has lost its ground (XGV-70)."""
        primitive, profile = self._drivers.primitive, self._drivers.profile
        events: list[EndpointEvent] = []
        before, self._control_mode = self._control_mode, self._resolve_control_mode()
        why = control_mode_reason(self._control_mode, primitive, profile)
        if self._control_mode is not before:
            change = f"control mode changed from {mode_name(before)} to {mode_name(self._control_mode)}"
            events += self._drop_command(f"{change}: {why}")
            events.append(
                EndpointChanged("control_mode", before.name.lower(), self._control_mode.name.lower(), (why,))
            )
        elif self._commander not in {primitive.controller, profile.controller}:
            events += self._drop_command(f"{self._commander} lost control: {why}")
        was, self._ready_mode = self._ready_mode, self._resolve_ready_mode()
        if self._ready_mode is not was:
            reasons = ready_mode_reasons(self._control_mode, primitive, profile) or (
                "all that is needed is ready",
            )
            events.append(
                EndpointChanged("ready_mode", was.name.lower(), self._ready_mode.name.lower(), reasons)
            )
        return events

    def _drop_command(self, reason: str) -> list[EndpointEvent]:
        if self._command is None:
            return []
        self._command = None
        return [CommandDropped(reason)]


def _motion_fault(command: MotionProfile) -> str:
    """Return which value Set Motion Profile cannot carry, empty if it can carry all."""
    for name, lower, upper in MOTION_PROFILE_RANGES:
        value = getattr(command, name)
        if not lower <= value <= upper:
            return f"MotionProfile.{name}: got {value!r}, expected {lower:g} to {upper:g}"
    if command.speed_mps < 0.0:
        return f"MotionProfile.speed_mps: got {command.speed_mps!r}; this version emulates forward gears only"
    return ""
