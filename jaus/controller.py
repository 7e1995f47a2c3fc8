"""The controlling side: commands that may want an acknowledgement, and reports by service connection.

As ``jaus.port``, which it stands on: the caller owns the socket and the clock. A controller is a node too: it
sends heartbeats and answers who it is, since vehicles forget controllers that they cannot find.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple

from jaus.address import JausAddress
from jaus.discovery import ComponentDescription, NodeDescription
from jaus.errors import LocalProtocolError
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
    positive: bool


class NotAcknowledged(NamedTuple):
    """A command was sent several times, and never acknowledged."""

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
        address: Its own JAUS address.
        vehicles: Where the vehicles are.
        name: What it says it is.
        acknowledgement_timeout_s: How long it waits before it sends a command again.
        attempts: How many times it sends a command that nobody acknowledges.
        silence_s: After so long without a report it asks for its service connection again.
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
        self._pending: dict[tuple[int, int], _Pending] = {}
        self._subscriptions: dict[tuple[int, int], _Subscription] = {}
        self._events: deque[ControllerEvent] = deque()

    def command(self, message: Message, to: JausAddress, now_s: float, *, acknowledged: bool = False) -> None:
        """Send a command; a newer one of its kind to the same component takes the place of an older.

        Args:
            message: The command.
            to: Who shall do it.
            now_s: The time.
            acknowledged: Whether to ask for an acknowledgement, and to repeat the command until it comes.
        """
        wanted = Acknowledgement.REQUESTED if acknowledged else Acknowledgement.NONE
        message.to(to, source=self.address, sequence=self._sequence, acknowledgement=wanted)
        self._sequence = (self._sequence + 1) & MAX_SEQUENCE
        key = message.code, to.jaus_id
        self._pending.pop(key, None)
        if acknowledged:
            due_s = now_s + self._acknowledgement_timeout_s
            self._pending[key] = _Pending(message, due_s, self._attempts - 1)
        self._send(message)

    def subscribe(
        self,
        report: type[Message],
        of: JausAddress,
        rate_hz: float,
        now_s: float,
        *,
        presence_vector: int = 0xFFFF,
    ) -> None:
        """Ask a component for a report again and again, and ask anew when none comes any more."""
        request = CreateServiceConnection(report.code, rate_hz, presence_vector).to(of, source=self.address)
        self._subscriptions[report.code, of.jaus_id] = _Subscription(request, report, now_s + self._silence_s)
        self._send(request)

    def unsubscribe(self, report: type[Message], of: JausAddress) -> None:
        """End a subscription; without one nothing happens."""
        ended = self._subscriptions.pop((report.code, of.jaus_id), None)
        if ended is not None and ended.instance_id is not None:
            self._send(TerminateServiceConnection(report.code, ended.instance_id).to(of, source=self.address))

    def receive_datagram(self, datagram: bytes, source: Hashable, now_s: float) -> None:
        """Take a datagram; what comes from elsewhere than the vehicles' place is not listened to."""
        if source != self._vehicles:
            self._events.append(DatagramRefused(source, "it does not come from where the vehicles are"))
            return
        self._port.receive_datagram(datagram, source, now_s)
        while (event := self._port.next_event()) is not None:
            if not isinstance(event, MessageReceived) or not self._took(event.message, now_s):
                self._events.append(event)

    def next_event(self) -> ControllerEvent | None:
        """Return what has happened, one by one, None when that was all."""
        return self._events.popleft() if self._events else None

    def datagrams_to_send(self, now_s: float) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams to send now, each with where it goes."""
        for key, pending in list(self._pending.items()):
            if pending.due_s > now_s:
                continue
            if pending.attempts_left == 0:
                del self._pending[key]
                self._events.append(NotAcknowledged(pending.command))
                continue
            pending.attempts_left -= 1
            pending.due_s = now_s + self._acknowledgement_timeout_s
            self._send(pending.command)
        for subscription in self._subscriptions.values():
            if subscription.try_s <= now_s:
                subscription.try_s = now_s + self._silence_s
                self._send(subscription.request)
        return self._port.datagrams_to_send(now_s)

    def next_deadline_s(self) -> float:
        """Return when ``datagrams_to_send`` has something to send."""
        deadlines = [pending.due_s for pending in self._pending.values()]
        deadlines += [subscription.try_s for subscription in self._subscriptions.values()]
        return min([*deadlines, self._port.next_deadline_s() or 0.0])

    def _send(self, message: Message) -> None:
        self._port.send(message, Client(message.header.destination, self._vehicles))

    def _took(self, message: object, now_s: float) -> bool:
        """Deal with acknowledgements and confirmations; return whether that was all to it."""
        if isinstance(message, Ack):
            pending = self._pending.get((message.code, message.header.source_id))
            if pending is not None and pending.command.header.sequence == message.sequence:
                del self._pending[message.code, message.header.source_id]
                self._events.append(Acknowledged(pending.command, message.positive))
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
            if subscription is not None:
                subscription.instance_id = message.instance_id
                return
            # Nobody here wants it (any more): its sender would go on for ever.
            ended = TerminateServiceConnection(message.command_code, message.instance_id)
            self._send(ended.to(source, source=self.address))
        elif subscription is not None:
            del self._subscriptions[key]
            self._events.append(SubscriptionRefused(source, subscription.report, message.response))


def _no_report(component: int, code: int) -> Message:
    raise LocalProtocolError(f"controller: component {component} has no report {code:#06x}")
