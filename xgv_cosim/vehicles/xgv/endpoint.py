"""The XGV's endpoint: its two drivers, the command in force, and the errors of the controller.

It takes typed messages and says what they caused. It reads no clock and moves no bytes, so that the
in-process link and a wire link meet the same component logic.
"""

from __future__ import annotations

from typing import assert_never

from jaus.address import ComponentId, JausAddress
from jaus.component import Component, ComponentStatus
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.actuation import LostFunction
from xgv_cosim.commands import DiscreteDevices, MotionProfile, MotionQueue, Signals, WrenchEffort
from xgv_cosim.endpoint import (
    CommandStatus,
    ControlPreempted,
    DevicesCommanded,
    EndpointChanged,
    EndpointEvent,
    MessageRefused,
    ReleaseControl,
    RequestControl,
    SetAuthority,
    StackMessage,
)
from xgv_cosim.vehicles.xgv.auxiliaries import Auxiliaries
from xgv_cosim.vehicles.xgv.drivers import Drivers
from xgv_cosim.vehicles.xgv.errors import (
    COMMAND_TIMEOUTS,
    CONTROLLER_FAILED,
    MOTION_PROFILES_TIMEOUT,
    WRENCH_EFFORTS_TIMEOUT,
)
from xgv_cosim.vehicles.xgv.faults import Faults, warnings_of
from xgv_cosim.vehicles.xgv.modes import ERRORS_DETECTED, MANUAL_SPEED, PARTIAL_MODE_ACTS_IN, PAUSES
from xgv_cosim.vehicles.xgv.motion import CommandInForce, MotionCommand, motion_fault
from xgv_cosim.vehicles.xgv.partial_effort import PartialWrenchEffort
from xgv_cosim.vehicles.xgv.reasons import (
    COMPONENT_NAMES,
    mode_name,
    safety_mode_reasons,
)
from xgv_cosim.vehicles.xgv.settings import XgvSettings
from xgv_cosim.vehicles.xgv.software_modes import SoftwareModes


class XgvEndpoint:
    """One XGV's components and errors. Implements ``xgv_cosim.endpoint.Endpoint``.

    Args:
        settings: Settings of the vehicle.
        subsystem: Subsystem number of its JAUS addresses.
    """

    def __init__(self, settings: XgvSettings, subsystem: int = 1) -> None:
        self._settings = settings
        self._drivers = Drivers(
            subsystem,
            settings.mpd_request_period_s,
            settings.initialize_s,
            settings.controller_timeout_s,
        )
        self._motion = CommandInForce(settings.wrench_timeout_s)
        self._faults = Faults(settings.errors_latch, settings.error_effects)
        self._safety_mode = SafetyMode.SOFTWARE_PAUSE
        self._safety_devices = 0
        self._drags = False
        self._auxiliaries = Auxiliaries(needs_control=settings.nonmotion_needs_control)
        self._modes = SoftwareModes(self._drivers, settings.control_mode_both_clients)

    @property
    def control_mode(self) -> ControlMode:
        """Return the control mode (XGV-15)."""
        return self._modes.control

    @property
    def ready_mode(self) -> ReadyMode:
        """Return the ready mode (XGV-22, XGV-23, XGV-24)."""
        return self._modes.ready

    @property
    def device_bits(self) -> int:
        """Return bit 7, "paused due to errors", if an error that pauses is raised (XGV-38)."""
        return ERRORS_DETECTED if self._faults.pauses else 0

    @property
    def lost_functions(self) -> int:
        """Return bits of ``actuation.LostFunction``: what the errors in force take away (XGV-38)."""
        return self._faults.lost_functions

    def errors_taking(self, function: LostFunction) -> tuple[str, ...]:
        """Return the errors in force that take a function away, in words (XGV-38)."""
        return self._faults.taking(function)

    @property
    def errors(self) -> frozenset[int]:
        """Return the codes that are raised, warnings included."""
        return self._faults.codes

    @property
    def signals(self) -> Signals:
        """Return lights and horn as the computer has them (XGV-11)."""
        return self._auxiliaries.signals

    @property
    def component_status(self) -> dict[ComponentId, ComponentStatus]:
        """Return the status of both drivers."""
        return {name: component.status for name, component in self._drivers.by_id.items()}

    @property
    def component_controller(self) -> dict[ComponentId, JausAddress | None]:
        """Return who controls both drivers, None for nobody."""
        return {name: component.controller for name, component in self._drivers.by_id.items()}

    @property
    def component_authority(self) -> dict[ComponentId, int]:
        """Return the authority with which both drivers are controlled, 0 for nobody (XGV-20)."""
        return {
            name: 0 if component.control is None else component.control.authority
            for name, component in self._drivers.by_id.items()
        }

    @property
    def next_deadline_s(self) -> float:
        """Return when a request of the MPD, the end of an initialisation or of a silence is due."""
        return self._drivers.next_deadline_s

    def receive(self, message: StackMessage, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        """Take one message; one without effect is refused with a reason, or is a mere repeat.

        "Accepted" means that the sender controls the component, the message fits the control mode and
        its values are valid, whatever the safety mode (cross-profile rules). Axes that efforts leave out keep
        what is in force now, if the sender commanded it (XGV-59).
        """
        if isinstance(message, PartialWrenchEffort):
            message = message.completed(self._motion.command if self._motion.commander == sender else None)
        if self._safety_mode is SafetyMode.INACTIVE:
            return [MessageRefused(message, "the system is not active (XGV-32)")]
        if sender in {component.address for component in self._drivers.by_id.values()}:
            return [MessageRefused(message, f"{sender} is a component of this car, nobody outside (XGV-65)")]
        events = self._handle(message, sender, now_s)
        self._drivers.heard(sender, now_s)
        return events

    def _handle(self, message: StackMessage, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        match message:
            case RequestControl():
                events = self._drivers.request_control(message, sender, now_s)
            case ReleaseControl():
                events = self._drivers.release_control(message, sender, now_s)
            case SetAuthority():
                events = self._drivers.set_authority(message, sender, now_s)
            case CommandStatus():
                events = self._drivers.command_status(message, sender, now_s)
            case MotionProfile() | MotionQueue() | WrenchEffort():
                return self._take_command(message, sender, now_s)
            case DiscreteDevices():
                standing = self._drivers.standing(sender)
                return self._auxiliaries.take_devices(
                    message, self._safety_mode, self._modes.control, standing
                )
            case Signals():
                return self._auxiliaries.take_signals(message, self._safety_mode, sender)
            case _:
                assert_never(message)
        return self._settle(events)

    def delay(self, stopped_s: float) -> None:
        """Put every deadline off by a time in which the controller was frozen (XGV-67)."""
        self._drivers.delay(stopped_s)
        self._motion.delay(stopped_s)

    def heard(self, sender: JausAddress, now_s: float) -> None:
        """Take note of traffic that is no message for the endpoint (XGV-65)."""
        self._drivers.heard(sender, now_s)

    def safety_mode_entered(self, code: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Take note of the safety mode now in force.

        A pause drops the motions that wait, an override or a disable also the command in force, motion or
        effort (XGV-70): afterwards the car stops and holds until a fresh one. In a pause it goes on steering
        (XGV-33). Where the human has all systems, the computer's signals
        are off (XGV-13, XGV-31). A disable may switch the engine off (XGV-31).
        """
        self._safety_mode = mode = SafetyMode(code)
        events: list[EndpointEvent] = []
        words = mode.name.lower().replace("_", " ")
        if mode in PAUSES and self._motion.num_waiting:
            waiting = f"{self._motion.drop_waiting()} waiting"
            events.append(EndpointChanged("motion_queue", waiting, "0 waiting", (f"dropped by {words}",)))
        if mode not in PARTIAL_MODE_ACTS_IN:
            events += self._motion.drop(f"dropped by {words}")
            events += self._auxiliaries.release(mode)
        if mode is SafetyMode.ESTOP_DISABLE and self._settings.disable_engine_off:
            events.append(DevicesCommanded(engine_on=False, reason=f"{words} (xgv.disable.engine_off)"))
        return events + self._show_warnings()

    def partial_mode_entered(self, bits: int) -> None:
        """Take note of which axes the human has: with the speed he has gear and parking brake (XGV-41)."""
        self._auxiliaries.manual_speed = bool(bits & MANUAL_SPEED)

    def devices_changed(self, safety_devices: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Take note of the safety devices now in force; only warnings come of it (XGV-38)."""
        self._safety_devices = safety_devices
        return self._show_warnings()

    def parking_brake_drags(self, begins: bool, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Warn while the computer drives against the set parking brake; it pauses nothing (XGV-38)."""
        self._drags = begins
        return self._show_warnings()

    def handle_deadline(self, now_s: float) -> list[EndpointEvent]:
        """Let the MPD ask for the PD again (XGV-19), initialisations end and the silent go (XGV-65)."""
        return self._settle(self._drivers.handle_deadline(now_s))

    def command_expired(self, now_s: float) -> list[EndpointEvent]:
        """Go on to the next motion; without one raise 9157 or 9158, by the kind that has ended (XGV-43)."""
        ended = self._motion.command
        if ended is None:
            return []
        successor = self._motion.advance(now_s)
        if successor is not None:
            return [successor]
        is_motion = isinstance(ended, MotionProfile)
        return self._faults.raise_code(MOTION_PROFILES_TIMEOUT if is_motion else WRENCH_EFFORTS_TIMEOUT)

    def raise_error(self, code: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Raise an error or a warning (XGV-38); a repeat has no effect.

        With the error of its own controllers the Motion Profile Driver goes to failure (XGV-21).

        Raises:
            ScenarioError: The XGV has no such code.
        """
        events = self._faults.raise_code(code)
        if code == CONTROLLER_FAILED and events:
            events += self._drivers.status.fail(ComponentId.MOTION_PROFILE_DRIVER, "its controllers failed")
        return events + self._enter_modes()

    def clear_error(self, code: int, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Take note that the cause of an error is gone; a latched error stays (XGV-38)."""
        return self._faults.end_cause(code)

    def clear_errors(self, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Clear what is latched and whose cause is gone: the operator's verb (XGV-38)."""
        return self._faults.clear_latched()

    def refuse_resume(self, reason: str) -> None:
        """Refuse Resume for ``reason`` from now on, or allow it again (XGV-37)."""
        self._drivers.status.resume_refusal = reason

    def stand_by(self, reason: str, now_s: float) -> list[EndpointEvent]:  # noqa: ARG002 - the protocol's
        """Set the drivers that are ready to standby (XGV-37)."""
        return self._drivers.status.stand_by(reason) + self._enter_modes()

    def reasons(self, safety_devices: int) -> tuple[str, ...]:
        """Return why the safety mode is what it is, strongest cause first."""
        return safety_mode_reasons(
            safety_devices,
            self._faults.codes,
            self._modes.control,
            self._modes.control_reason,
            self._modes.ready_reasons,
            has_command=self._motion.command is not None,
        )

    def _take_command(self, command: MotionCommand, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        """Accept or refuse a motion command; it replaces those before (XGV-10, XGV-16, XGV-70)."""
        if isinstance(command, WrenchEffort):
            target, mode, fault = self._drivers.primitive, ControlMode.WRENCH_EFFORTS, ""
        else:
            target, mode = self._drivers.profile, ControlMode.MOTION_PROFILES
            fault = motion_fault(command, allow_many=self._settings.motion_allow_many)
        reason = self._why_refused(target, mode, sender) or fault
        if reason:
            return [MessageRefused(command, reason)]
        events: list[EndpointEvent] = [self._motion.take(command, sender, now_s)]
        for code in sorted(COMMAND_TIMEOUTS & self._faults.codes):
            events += self._faults.end_cause(code)
        resumed = self._drivers.status.command_accepted(sender)
        return events + resumed + self._enter_modes() if resumed else events

    def _why_refused(self, target: Component, mode: ControlMode, sender: JausAddress) -> str:
        """Return why a motion command of ``sender`` is not accepted, empty if it is."""
        in_force = f"control mode is {mode_name(self._modes.control)} ({self._modes.control_reason})"
        if target.controller != sender:
            holder = self._drivers.holder_name(target.controller)
            name = COMPONENT_NAMES[ComponentId(target.address.component)]
            return f"{holder} controls the {name}, not {sender}; {in_force}"
        if self._modes.control is not mode:
            return f"{in_force}, but the command needs {mode_name(mode)}"
        return ""

    def _settle(self, events: list[EndpointEvent]) -> list[EndpointEvent]:
        """Let the modes follow from what has happened to the drivers.

        A pre-emption ends the command in force, and with it everything that is executed: a software pause
        for that reason alone, until the first command of the new controller (XGV-66). Where control mode
        becomes software pause by it, that is the pause.
        """
        preempted = any(isinstance(event, ControlPreempted) for event in events)
        if preempted and self._motion.command is not None:
            why = f"{self._motion.commander} was preempted"
            events = events + self._motion.drop(why)
            if self._modes.control_now() is not ControlMode.SOFTWARE_PAUSE:
                events += self._drivers.status.stand_by_for_command(why)
        return events + self._enter_modes()

    def _enter_modes(self) -> list[EndpointEvent]:
        """Compute control and ready mode anew, and drop a command that has lost its ground (XGV-70)."""
        before = self._modes.control
        changes = self._modes.enter()
        dropped: list[EndpointEvent] = []
        if self._modes.control is not before:
            change = f"control mode changed from {mode_name(before)} to {mode_name(self._modes.control)}"
            dropped = self._motion.drop(f"{change}: {self._modes.control_reason}")
        return [*dropped, *changes, *self._show_warnings()]

    def _show_warnings(self) -> list[EndpointEvent]:
        return self._faults.show_warnings(
            warnings_of(
                self._safety_mode,
                self._safety_devices,
                software_ready=self._modes.are_ready,
                parking_brake_drags=self._drags,
            )
        )
