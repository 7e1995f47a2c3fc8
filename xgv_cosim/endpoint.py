"""What a stack sends to a vehicle, what the vehicle answers, and the shape of a vehicle's endpoint.

The in-process link hands these typed messages straight to the endpoint; a wire link decodes its
datagrams into the same ones. Either way they meet the same component logic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.actuation import Gear, LostFunction
from xgv_cosim.commands import DiscreteDevices, MotionProfile, MotionQueue, Signals, WrenchEffort


@dataclass(frozen=True, slots=True)
class RequestControl:
    """Request Component Control (XGV-20)."""

    component: ComponentId
    authority: int = 6
    """0 to 255; public clients ask with 6 or 255 (XGV-20)."""


@dataclass(frozen=True, slots=True)
class ReleaseControl:
    """Release Component Control (XGV-20)."""

    component: ComponentId


@dataclass(frozen=True, slots=True)
class CommandStatus:
    """Resume, Standby, Shutdown, Reset, Set Emergency or Clear Emergency (XGV-25)."""

    component: ComponentId
    command: StatusCommand


@dataclass(frozen=True, slots=True)
class SetAuthority:
    """Set Component Authority (XGV-20)."""

    component: ComponentId
    authority: int
    """0 to 255."""


StackMessage = (
    RequestControl
    | ReleaseControl
    | CommandStatus
    | SetAuthority
    | MotionProfile
    | MotionQueue
    | WrenchEffort
    | DiscreteDevices
    | Signals
)
"""Everything a stack may send in this version."""


@dataclass(frozen=True, slots=True)
class CommandAccepted:
    """A motion command became the one in force: it was just accepted, or waited for its turn."""

    command: MotionProfile | WrenchEffort
    expires_s: float
    """Simulation time at which it ends."""


@dataclass(frozen=True, slots=True)
class CommandDropped:
    """The command in force is gone: control mode changed, or control was lost (XGV-70)."""

    reason: str


@dataclass(frozen=True, slots=True)
class MessageRefused:
    """A message had no effect."""

    message: StackMessage
    reason: str


@dataclass(frozen=True, slots=True)
class EndpointChanged:
    """Something of the endpoint's state changed; becomes a row of the event log."""

    kind: str
    """``control_mode``, ``ready_mode``, ``component_control``, ``component_status``, ``error``,
    ``error_latched``, ``warning`` or ``signals``."""
    before: str
    after: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ControlPreempted:
    """Somebody with more authority has taken a component from another (XGV-66); becomes a row of its own."""

    before: str
    after: str
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class DevicesCommanded:
    """Gear selector, engine or parking brake are to change; None leaves a device (XGV-09, XGV-34, XGV-60)."""

    gear: Gear | None = None
    engine_on: bool | None = None
    parking_brake: bool | None = None
    reason: str = ""
    """Why, where nobody commanded it."""


EndpointEvent = (
    CommandAccepted | CommandDropped | ControlPreempted | DevicesCommanded | MessageRefused | EndpointChanged
)


class Endpoint(Protocol):
    """One vehicle's endpoint: components, control, status and errors. Reads no clock (sans-IO)."""

    @property
    def control_mode(self) -> int:
        """Return the profile's control mode code."""
        ...

    @property
    def ready_mode(self) -> int:
        """Return the profile's ready mode code."""
        ...

    @property
    def device_bits(self) -> int:
        """Return the safety-device bits that the endpoint itself sets, such as "errors detected"."""
        ...

    @property
    def lost_functions(self) -> int:
        """Return the bits of ``actuation.LostFunction`` that the errors in force take away (XGV-38)."""
        ...

    def errors_taking(self, function: LostFunction) -> tuple[str, ...]:
        """Return the errors in force that take a function away, in words (XGV-38)."""
        ...

    @property
    def component_status(self) -> dict[ComponentId, ComponentStatus]:
        """Return the status of each component."""
        ...

    @property
    def component_controller(self) -> dict[ComponentId, JausAddress | None]:
        """Return who controls each component, None: nobody."""
        ...

    @property
    def component_authority(self) -> dict[ComponentId, int]:
        """Return the authority with which each component is controlled, 0: nobody controls it (XGV-20)."""
        ...

    @property
    def errors(self) -> frozenset[int]:
        """Return the codes that are raised, warnings included (XGV-38)."""
        ...

    @property
    def signals(self) -> Signals:
        """Return lights and horn as the computer has them (XGV-11)."""
        ...

    @property
    def next_deadline_s(self) -> float:
        """Return when ``handle_deadline`` is due, ``inf`` for never."""
        ...

    def receive(self, message: StackMessage, sender: JausAddress, now_s: float) -> list[EndpointEvent]:
        """Take one message from ``sender``."""
        ...

    def delay(self, stopped_s: float) -> None:
        """Put every deadline off by a time in which the controller's clock stood still (XGV-67)."""
        ...

    def heard(self, sender: JausAddress, now_s: float) -> None:
        """Take note of traffic of ``sender`` that is no message for the endpoint (XGV-65)."""
        ...

    def safety_mode_entered(self, code: int, now_s: float) -> list[EndpointEvent]:
        """Take note of the safety mode now in force (XGV-34, XGV-70)."""
        ...

    def partial_mode_entered(self, bits: int) -> None:
        """Take note of which axes the human has: bit 0 steering, bit 1 speed (XGV-41, XGV-51)."""
        ...

    def devices_changed(self, safety_devices: int, now_s: float) -> list[EndpointEvent]:
        """Take note of the safety devices now in force; only warnings come of it (XGV-38)."""
        ...

    def parking_brake_drags(self, begins: bool, now_s: float) -> list[EndpointEvent]:
        """Take note that the computer drives against the set parking brake, or no longer does (XGV-38)."""
        ...

    def handle_deadline(self, now_s: float) -> list[EndpointEvent]:
        """Do what is due, for example ask again for the Primitive Driver (XGV-19)."""
        ...

    def command_expired(self, now_s: float) -> list[EndpointEvent]:
        """Take note that the command in force has ended without a successor (XGV-43)."""
        ...

    def raise_error(self, code: int, now_s: float) -> list[EndpointEvent]:
        """Raise an error code (XGV-38)."""
        ...

    def clear_error(self, code: int, now_s: float) -> list[EndpointEvent]:
        """Take note that the cause of an error is gone; a latched error stays (XGV-38)."""
        ...

    def clear_errors(self, now_s: float) -> list[EndpointEvent]:
        """Clear what is latched and whose cause is gone: the operator's verb (XGV-38)."""
        ...

    def refuse_resume(self, reason: str) -> None:
        """Refuse Resume from now on for ``reason``; an empty one allows it again (XGV-37)."""
        ...

    def stand_by(self, reason: str, now_s: float) -> list[EndpointEvent]:
        """Set the components that are ready to standby (XGV-37)."""
        ...

    def reasons(self, safety_devices: int) -> tuple[str, ...]:
        """Return why the safety mode is what it is, strongest cause first."""
        ...
