"""Component status and component control of JAUS RA 3.3, as transition tables.

A component serves at most one controlling component at a time. Whoever wants to command it requests
control with an authority from 0 to 255. The request is confirmed when nobody controls the component,
repeated requests of the controller are confirmed again without effect, and a request with a higher
authority than the controller's preempts him: he is told by a reject. All else is rejected
(XGV-10, XGV-19, XGV-20). Authority arbitrates; it is not a safety function (XGV-66).

Beside that each component has a status, changed by commands. Who may send them depends on how the
sender stands to the component: ``PERMITTED_STATUS_COMMANDS`` (XGV-10, XGV-25, XGV-63).

This module only says what happens; it moves no bytes and reads no clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from types import MappingProxyType

from jaus.address import JausAddress
from jaus.errors import LocalProtocolError
from jaus.status import ComponentStatus as ComponentStatus  # noqa: PLC0414 - users look for it here

MAX_AUTHORITY = 255


class StatusCommand(Enum):
    """A command that changes a component's status (XGV-25)."""

    RESUME = auto()
    STANDBY = auto()
    SHUTDOWN = auto()
    RESET = auto()
    SET_EMERGENCY = auto()
    CLEAR_EMERGENCY = auto()


def _status_transitions() -> dict[tuple[ComponentStatus, StatusCommand], ComponentStatus]:
    transitions = {
        (ComponentStatus.STANDBY, StatusCommand.RESUME): ComponentStatus.READY,
        (ComponentStatus.READY, StatusCommand.STANDBY): ComponentStatus.STANDBY,
    }
    for status in ComponentStatus:
        transitions[status, StatusCommand.SHUTDOWN] = ComponentStatus.SHUTDOWN
        transitions[status, StatusCommand.RESET] = ComponentStatus.INITIALIZE
        transitions[status, StatusCommand.SET_EMERGENCY] = ComponentStatus.EMERGENCY
        transitions[status, StatusCommand.CLEAR_EMERGENCY] = ComponentStatus.STANDBY
    return transitions


STATUS_TRANSITIONS: Mapping[tuple[ComponentStatus, StatusCommand], ComponentStatus] = MappingProxyType(
    _status_transitions()
)
"""Status after a permitted command (XGV-25). A pair that is absent has no effect: Resume acts in
standby only, Standby in ready only. Set and Clear Emergency act in every status, as in OpenJAUS: so Clear
Emergency leads out of shutdown and failure too, and to standby from ready."""


class Standing(Enum):
    """How the sender of a status command stands to the component."""

    CONTROLLER = auto()
    """It controls the component."""
    DEPUTY = auto()
    """It controls the component that controls this one."""
    BYSTANDER = auto()
    """Somebody else controls the component."""
    NOBODY_CONTROLS = auto()
    """The component has no controller."""


PERMITTED_STATUS_COMMANDS: Mapping[Standing, frozenset[StatusCommand]] = MappingProxyType(
    {
        Standing.CONTROLLER: frozenset(StatusCommand),
        Standing.DEPUTY: frozenset(StatusCommand) - {StatusCommand.SHUTDOWN, StatusCommand.RESET},
        Standing.BYSTANDER: frozenset({StatusCommand.SET_EMERGENCY}),
        Standing.NOBODY_CONTROLS: frozenset(StatusCommand) - {StatusCommand.CLEAR_EMERGENCY},
    }
)
"""Who may send what: anyone sets emergency, only the controller clears it (XGV-63).

So does the deputy, since the component that controls this one clears nothing itself: else whoever drives
through it could not undo what a stranger has set. Shutdown and Reset stay with the controller.
"""


class Situation(Enum):
    """How the sender of a control message stands to the component."""

    UNCONTROLLED = auto()
    """Nobody controls the component."""
    SENDER_CONTROLS = auto()
    """The sender does."""
    OTHER_CONTROLS = auto()
    """Somebody else does, with at least the sender's authority (or the message carries none)."""
    OTHER_OUTRANKED = auto()
    """Somebody else does, with less authority than the sender asks with."""


class ControlInput(Enum):
    """A message about control of a component (XGV-20)."""

    REQUEST = auto()
    RELEASE = auto()
    SET_AUTHORITY = auto()


class ControlReply(Enum):
    """Who is told what."""

    NOTHING = auto()
    CONFIRM_SENDER = auto()
    REJECT_SENDER = auto()
    REJECT_CONTROLLER_AND_CONFIRM_SENDER = auto()


class ControlEffect(Enum):
    """What becomes of the control."""

    NONE = auto()
    TAKE = auto()
    """The sender controls from now on, with the authority it asked with."""
    RAISE_AUTHORITY = auto()
    """The controller keeps the higher of its present and the requested authority."""
    SET_AUTHORITY = auto()
    """The controller has exactly the given authority, which may be lower than before."""
    GIVE_UP = auto()
    """Nobody controls from now on."""


CONTROL_TRANSITIONS: Mapping[tuple[Situation, ControlInput], tuple[ControlReply, ControlEffect]] = (
    MappingProxyType(
        {
            (Situation.UNCONTROLLED, ControlInput.REQUEST): (ControlReply.CONFIRM_SENDER, ControlEffect.TAKE),
            (Situation.SENDER_CONTROLS, ControlInput.REQUEST): (
                ControlReply.CONFIRM_SENDER,
                ControlEffect.RAISE_AUTHORITY,
            ),
            (Situation.OTHER_CONTROLS, ControlInput.REQUEST): (
                ControlReply.REJECT_SENDER,
                ControlEffect.NONE,
            ),
            (Situation.OTHER_OUTRANKED, ControlInput.REQUEST): (
                ControlReply.REJECT_CONTROLLER_AND_CONFIRM_SENDER,
                ControlEffect.TAKE,
            ),
            (Situation.UNCONTROLLED, ControlInput.RELEASE): (ControlReply.NOTHING, ControlEffect.NONE),
            (Situation.SENDER_CONTROLS, ControlInput.RELEASE): (ControlReply.NOTHING, ControlEffect.GIVE_UP),
            (Situation.OTHER_CONTROLS, ControlInput.RELEASE): (ControlReply.NOTHING, ControlEffect.NONE),
            (Situation.OTHER_OUTRANKED, ControlInput.RELEASE): (ControlReply.NOTHING, ControlEffect.NONE),
            (Situation.UNCONTROLLED, ControlInput.SET_AUTHORITY): (ControlReply.NOTHING, ControlEffect.NONE),
            (Situation.SENDER_CONTROLS, ControlInput.SET_AUTHORITY): (
                ControlReply.NOTHING,
                ControlEffect.SET_AUTHORITY,
            ),
            (Situation.OTHER_CONTROLS, ControlInput.SET_AUTHORITY): (
                ControlReply.NOTHING,
                ControlEffect.NONE,
            ),
            (Situation.OTHER_OUTRANKED, ControlInput.SET_AUTHORITY): (
                ControlReply.NOTHING,
                ControlEffect.NONE,
            ),
        }
    )
)
"""Every pair of situation and message has its reply and effect (XGV-19, XGV-20)."""


@dataclass(frozen=True, slots=True)
class Control:
    """Who controls a component, and with which authority."""

    controller: JausAddress
    authority: int


@dataclass(frozen=True, slots=True)
class ControlConfirmed:
    """Confirm Component Control, "accepted", goes to ``to``."""

    to: JausAddress


@dataclass(frozen=True, slots=True)
class ControlRejected:
    """Reject Component Control goes to ``to``: refused, or preempted."""

    to: JausAddress


@dataclass(frozen=True, slots=True)
class ControlChanged:
    """Another controller, another authority, or none."""

    before: Control | None
    after: Control | None


@dataclass(frozen=True, slots=True)
class StatusChanged:
    """The component's status changed."""

    before: ComponentStatus
    after: ComponentStatus


@dataclass(frozen=True, slots=True)
class StatusCommandRefused:
    """A status command of a sender that may not send it; nothing changed."""

    command: StatusCommand
    standing: Standing


ControlOutcome = ControlConfirmed | ControlRejected | ControlChanged
StatusOutcome = StatusChanged | StatusCommandRefused


class Component:
    """One component: its address, its status and who controls it.

    Args:
        address: The component's own address.
        status: Its status to begin with.
    """

    def __init__(self, address: JausAddress, status: ComponentStatus = ComponentStatus.INITIALIZE) -> None:
        self._address = address
        self._status = status
        self._control: Control | None = None

    @property
    def address(self) -> JausAddress:
        """Return the component's own address."""
        return self._address

    @property
    def status(self) -> ComponentStatus:
        """Return the present status (XGV-21)."""
        return self._status

    @property
    def control(self) -> Control | None:
        """Return controller and authority, None while nobody controls."""
        return self._control

    @property
    def controller(self) -> JausAddress | None:
        """Return who controls the component, None for nobody."""
        return None if self._control is None else self._control.controller

    def request_control(self, sender: JausAddress, authority: int) -> list[ControlOutcome]:
        """Take Request Component Control (XGV-20); repeats of the controller only confirm again.

        Raises:
            LocalProtocolError: The authority does not fit into one byte.
        """
        return self._take(sender, ControlInput.REQUEST, _checked(authority))

    def release_control(self, sender: JausAddress) -> list[ControlOutcome]:
        """Take Release Component Control; from anyone but the controller it has no effect (XGV-20)."""
        return self._take(sender, ControlInput.RELEASE, 0)

    def set_authority(self, sender: JausAddress, authority: int) -> list[ControlOutcome]:
        """Take Set Component Authority: the controller says with which authority he controls (XGV-20).

        From anyone else it has no effect. Raising it is nothing that a new request could not do;
        lowering it lets others preempt him.

        Raises:
            LocalProtocolError: The authority does not fit into one byte.
        """
        return self._take(sender, ControlInput.SET_AUTHORITY, _checked(authority))

    def command_status(
        self, command: StatusCommand, sender: JausAddress, *, deputy: JausAddress | None = None
    ) -> list[StatusOutcome]:
        """Take a status command (XGV-25).

        Args:
            command: What to do.
            sender: Who asks.
            deputy: Who controls this component's controlling component, if that is a component of
                the same vehicle: he may send Resume, Standby and Clear Emergency too.
        """
        standing = self.standing_of(sender, deputy=deputy)
        if command not in PERMITTED_STATUS_COMMANDS[standing]:
            return [StatusCommandRefused(command, standing)]
        return self._enter(STATUS_TRANSITIONS.get((self._status, command), self._status))

    def finish_initialization(self) -> list[StatusOutcome]:
        """Go from initialize to standby; in any other status nothing happens."""
        return self._enter(ComponentStatus.STANDBY) if self._status is ComponentStatus.INITIALIZE else []

    def fail(self) -> list[StatusOutcome]:
        """Go to failure; a component that is shut down stays so (XGV-21).

        Resume does not lead out of it. Reset does, and Set and Clear Emergency do, which act everywhere.
        """
        return [] if self._status is ComponentStatus.SHUTDOWN else self._enter(ComponentStatus.FAILURE)

    def standing_of(self, sender: JausAddress, *, deputy: JausAddress | None = None) -> Standing:
        """Return how ``sender`` stands to this component."""
        if self._control is None:
            return Standing.NOBODY_CONTROLS
        if sender == self._control.controller:
            return Standing.CONTROLLER
        return Standing.DEPUTY if sender == deputy else Standing.BYSTANDER

    def _enter(self, after: ComponentStatus) -> list[StatusOutcome]:
        before, self._status = self._status, after
        return [] if after is before else [StatusChanged(before, after)]

    def _situation(self, sender: JausAddress, authority: int) -> Situation:
        if self._control is None:
            return Situation.UNCONTROLLED
        if sender == self._control.controller:
            return Situation.SENDER_CONTROLS
        if authority > self._control.authority:
            return Situation.OTHER_OUTRANKED
        return Situation.OTHER_CONTROLS

    def _take(self, sender: JausAddress, message: ControlInput, authority: int) -> list[ControlOutcome]:
        before = self._control
        reply, effect = CONTROL_TRANSITIONS[self._situation(sender, authority), message]
        self._control = _control_after(effect, before, sender, authority)
        outcomes: list[ControlOutcome] = []
        # The one who loses control is told first, as the reference implementations do.
        if reply is ControlReply.REJECT_CONTROLLER_AND_CONFIRM_SENDER and before is not None:
            outcomes.append(ControlRejected(before.controller))
        if reply in {ControlReply.CONFIRM_SENDER, ControlReply.REJECT_CONTROLLER_AND_CONFIRM_SENDER}:
            outcomes.append(ControlConfirmed(sender))
        if reply is ControlReply.REJECT_SENDER:
            outcomes.append(ControlRejected(sender))
        if self._control != before:
            outcomes.append(ControlChanged(before, self._control))
        return outcomes


def _checked(authority: int) -> int:
    if not 0 <= authority <= MAX_AUTHORITY:
        raise LocalProtocolError(f"authority: got {authority!r}, expected 0 to {MAX_AUTHORITY}")
    return authority


def _control_after(
    effect: ControlEffect, before: Control | None, sender: JausAddress, authority: int
) -> Control | None:
    if effect is ControlEffect.TAKE:
        return Control(sender, authority)
    if effect is ControlEffect.SET_AUTHORITY:
        return Control(sender, authority)
    if effect is ControlEffect.GIVE_UP:
        return None
    if effect is ControlEffect.RAISE_AUTHORITY and before is not None:
        return Control(sender, max(before.authority, authority))
    return before
