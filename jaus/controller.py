"""The controlling side: commands that may want an acknowledgement, and reports by service connection.

As ``jaus.port``, which it stands on: the caller owns the socket and the clock. A controller is a node too: it
sends heartbeats and answers who it is, since vehicles forget controllers that they cannot find.
"""

from __future__ import annotations

from collections.abc import Hashable
from copy import deepcopy
from dataclasses import dataclass
from typing import NamedTuple

from jaus.address import JausAddress
from jaus.discovery import ComponentDescription, NodeDescription
from jaus.errors import LocalProtocolError
from jaus.event_queue import EventQueue
from jaus.header import MAX_SEQUENCE, Acknowledgement
from jaus.messages import Ack, Message
from jaus.messages.core import (
    ConfirmServiceConnection,
    CreateServiceConnection,
    ServiceConnectionResponse,
    TerminateServiceConnection,
)
from jaus.messages.discovery import IdentificationType
from jaus.node import Node
from jaus.port import DatagramRefused, MessageNotSent, MessageReceived, Port
from jaus.service_connection import Client


class Acknowledged(NamedTuple):
    """A command was acknowledged, or refused with a NAK."""

    command: Message
    """As it was sent; see ``Controller.command``."""
    positive: bool


class NotAcknowledged(NamedTuple):
    """A command was sent once or several times, and not acknowledged in time."""

    command: Message


class SubscriptionRefused(NamedTuple):
    """A component does not send a report."""

    component: JausAddress
    report: type[Message]
    response: int
    """A ``ServiceConnectionResponse``."""


ControllerEvent = (
    Acknowledged | NotAcknowledged | SubscriptionRefused | MessageReceived | DatagramRefused | MessageNotSent
)


@dataclass(slots=True)
class _Pending:
    command: Message
    due_s: float
    attempts_left: int
    is_superseded: bool = False
    """A newer one took its place: it is not sent again, but may still be acknowledged."""

    @property
    def key(self) -> tuple[int, int]:
        """Return what it is, and for whom."""
        return self.command.code, self.command.header.destination_id


@dataclass(slots=True)
class _Subscription:
    request: CreateServiceConnection
    report: type[Message]
    try_s: float
    """When to ask again, unless a report comes before."""
    instance_id: int | None = None


class Controller:
    """One component that controls vehicles behind one place.

    Args:
        address: Its own JAUS address, on a node that no vehicle has.
        vehicles: Where the vehicles are.
        name: What it says it is.
        acknowledgement_timeout_s: How long it waits before it sends a command again.
        attempts: How many times it sends a command that nobody acknowledges.
        silence_s: After so long without a report it asks for its service connection again.
        max_events: How many events may wait for ``next_event``; while so many do, datagrams are refused.
        max_notices: How many refusals and the like may wait; the oldest give way.
    """

    def __init__(
        self,
        address: JausAddress,
        vehicles: Hashable,
        *,
        name: str = "controller",
        acknowledgement_timeout_s: float = 0.02,
        attempts: int = 5,
        silence_s: float = 3.0,
        max_events: int = 10_000,
        max_notices: int = 1_000,
    ) -> None:
        self.address = address
        self._vehicles = vehicles
        self._acknowledgement_timeout_s = acknowledgement_timeout_s
        self._attempts = attempts
        self._silence_s = silence_s
        components = tuple(
            ComponentDescription(
                number, name, instance=address.instance if number == address.component else 1
            )
            for number in sorted({1, address.component})
        )
        kind = IdentificationType.OPERATOR_CONTROL_UNIT
        description = NodeDescription(address.subsystem, name, components, address.node, kind)
        self._port = Port([Node(description, {}, _no_report)], peers=[vehicles])
        self._sequence = 0
        self._pending: dict[int, _Pending] = {}
        """By sequence number."""
        self._newest: dict[tuple[int, int], int] = {}
        """Sequence number of the newest command that waits, by what it is and for whom."""
        self._subscriptions: dict[tuple[int, int], _Subscription] = {}
        self._events: EventQueue[ControllerEvent] = EventQueue(max_events, max_notices)

    def command(
        self, message: Message, to: JausAddress, now_s: float, *, acknowledged: bool = False
    ) -> Message:
        """Send a command; a newer one of its kind to the same component takes the place of an older.

        The older is not sent again. If it is to be acknowledged, it still ends in ``Acknowledged`` or
        ``NotAcknowledged``.

        Args:
            message: The command; it stays as it is, and may be used again.
            to: Who shall do it.
            now_s: The time.
            acknowledged: Whether to ask for an acknowledgement, and to repeat the command until it comes.

        Returns:
            The command as it is sent: what ``Acknowledged`` and ``NotAcknowledged`` name.
        """
        sequence, self._sequence = self._sequence, (self._sequence + 1) & MAX_SEQUENCE
        wanted = Acknowledgement.REQUESTED if acknowledged else Acknowledgement.NONE
        sent = deepcopy(message).to(to, source=self.address, sequence=sequence, acknowledgement=wanted)
        older = self._pending.get(self._newest.pop((message.code, to.jaus_id), -1))
        if older is not None:
            older.is_superseded = True
        if sequence in self._pending:  # The numbers have run once round.
            self._give_up(sequence)
        if acknowledged:
            pending = _Pending(sent, now_s + self._acknowledgement_timeout_s, self._attempts - 1)
            self._pending[sequence] = pending
            self._newest[pending.key] = sequence
        self._send(sent)
        return sent

    def subscribe(
        self,
        report: type[Message],
        of: JausAddress,
        rate_hz: float,
        now_s: float,
        *,
        presence_vector: int = 0xFFFF,
    ) -> None:
        """Ask a component for a report again and again, and ask anew when none comes any more.

        Another presence vector than before is another service connection; the one before is ended.
        """
        request = CreateServiceConnection(report.code, rate_hz, presence_vector).to(of, source=self.address)
        before = self._subscriptions.get((report.code, of.jaus_id))
        made = _Subscription(request, report, now_s + self._silence_s)
        if before is not None and before.instance_id is not None:
            if before.request.requested_presence_vector == presence_vector:
                made.instance_id = before.instance_id
            else:
                self._end(report.code, before.instance_id, of)
        self._subscriptions[report.code, of.jaus_id] = made
        self._send(request)

    def unsubscribe(self, report: type[Message], of: JausAddress) -> None:
        """End a subscription; without one nothing happens."""
        ended = self._subscriptions.pop((report.code, of.jaus_id), None)
        if ended is not None and ended.instance_id is not None:
            self._end(report.code, ended.instance_id, of)

    def receive_datagram(self, datagram: bytes, source: Hashable, now_s: float) -> None:
        """Take a datagram; what comes from elsewhere than the vehicles' place is not listened to."""
        if source != self._vehicles:
            self._events.note(DatagramRefused(source, "it does not come from where the vehicles are"))
            return
        if self._events.is_full:
            self._events.note(DatagramRefused(source, "as many events wait as may"))
            return
        self._port.receive_datagram(datagram, source, now_s)
        self._take_events(now_s)

    def next_event(self) -> ControllerEvent | None:
        """Return what has happened, one by one, None when that was all."""
        return self._events.next()

    def datagrams_to_send(self, now_s: float) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams to send now, each with where it goes."""
        for sequence, pending in list(self._pending.items()):
            if pending.due_s > now_s:
                continue
            if pending.attempts_left == 0:
                self._give_up(sequence)
                continue
            pending.attempts_left -= 1
            pending.due_s = now_s + self._acknowledgement_timeout_s
            if not pending.is_superseded:
                self._send(pending.command)
        for subscription in self._subscriptions.values():
            if subscription.try_s <= now_s:
                subscription.try_s = now_s + self._silence_s
                self._send(subscription.request)
        outgoing = self._port.datagrams_to_send(now_s)
        self._take_events(now_s)
        return outgoing

    def next_deadline_s(self) -> float:
        """Return when ``datagrams_to_send`` has something to do: ``-inf`` for now."""
        deadlines = [pending.due_s for pending in self._pending.values()]
        deadlines += [subscription.try_s for subscription in self._subscriptions.values()]
        heartbeat_s = self._port.next_deadline_s()
        return min(deadlines if heartbeat_s is None else [*deadlines, heartbeat_s])

    def _give_up(self, sequence: int) -> None:
        self._events.add(NotAcknowledged(self._settled(sequence).command))

    def _settled(self, sequence: int) -> _Pending:
        """Return a command that waits no longer for its acknowledgement."""
        pending = self._pending.pop(sequence)
        if self._newest.get(pending.key) == sequence:
            del self._newest[pending.key]
        return pending

    def _end(self, report_code: int, instance_id: int, of: JausAddress) -> None:
        self._send(TerminateServiceConnection(report_code, instance_id).to(of, source=self.address))

    def _take_events(self, now_s: float) -> None:
        while (event := self._port.next_event()) is not None:
            if not isinstance(event, MessageReceived):
                self._events.note(event)
            elif not self._took(event.message, now_s):
                self._events.add(event)

    def _send(self, message: Message) -> None:
        self._port.send(message, Client(message.header.destination, self._vehicles))

    def _took(self, message: object, now_s: float) -> bool:
        """Deal with acknowledgements and confirmations; return whether that was all to it."""
        if isinstance(message, Ack):
            pending = self._pending.get(message.sequence)
            if pending is not None and pending.key == (message.code, message.header.source_id):
                self._events.add(Acknowledged(self._settled(message.sequence).command, message.positive))
            return True
        if isinstance(message, ConfirmServiceConnection):
            self._confirmed(message)
            return True
        if isinstance(message, Message):
            subscription = self._subscriptions.get((message.code, message.header.source_id))
            if subscription is not None:
                subscription.try_s = now_s + self._silence_s
        return False

    def _confirmed(self, message: ConfirmServiceConnection) -> None:
        key = message.command_code, message.header.source_id
        subscription = self._subscriptions.get(key)
        source = message.header.source
        if message.response == ServiceConnectionResponse.SUCCESSFUL:
            if subscription is None:
                # Nobody here wants it (any more): its sender would go on for ever.
                self._end(message.command_code, message.instance_id, source)
                return
            before, subscription.instance_id = subscription.instance_id, message.instance_id
            if before is not None and before != message.instance_id:
                self._end(message.command_code, before, source)  # Asked for before its confirmation was here.
        elif subscription is not None:
            del self._subscriptions[key]
            self._events.add(SubscriptionRefused(source, subscription.report, message.response))


def _no_report(component: int, code: int) -> Message:
    raise LocalProtocolError(f"controller: component {component} has no report {code:#06x}")
