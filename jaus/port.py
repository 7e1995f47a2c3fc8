"""Datagrams of many nodes behind one UDP port: routed, framed as each peer frames them, acknowledged.

The caller owns the socket and the clock::

    port.receive_datagram(data, source, now_s)     # for each that has arrived
    while (event := port.next_event()) is not None: ...
    for data, destination in port.datagrams_to_send(now_s): ...
    sleep until port.next_deadline_s()

A peer is where datagrams come from; answers go there, address and port. Whoever has sent a message to one of
the nodes gets heartbeats, and so do peers that were named beforehand.

Nothing that arrives makes it keep more than its limits allow, and what it acknowledges, it hands out.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from functools import partial

from jaus.address import BROADCAST
from jaus.codec import Decoded, encode_parts
from jaus.discovery import ANSWERED
from jaus.errors import DecodeError, EncodeError, LocalProtocolError
from jaus.event_queue import Allowance, EventQueue
from jaus.header import Header
from jaus.messages import Message, MessagePart, UnknownMessage
from jaus.messages.core import CreateServiceConnection, ReportHeartbeatPulse
from jaus.node import Node, report_code_of
from jaus.packet import (
    Framing,
    acknowledgement,
    decode_packet,
    destination_of,
    pack_datagrams,
    unpack_until_flaw,
)
from jaus.reassembly import Reassembly
from jaus.service_connection import Client


@dataclass(slots=True)
class MessageReceived:
    """A message that is the application's business: a command, an answer, an acknowledgement."""

    node: Node
    client: Client
    message: Decoded


@dataclass(frozen=True, slots=True)
class DatagramRefused:
    """A datagram, or one message of it, that is none, that nobody can have sent, or for which is no room."""

    source: Hashable
    reason: str


@dataclass(frozen=True, slots=True)
class MessageNotSent:
    """A message that cannot go out: no form in the peer's framing, a bad value, or too much waits already."""

    destination: Hashable
    reason: str


MAX_MESSAGES = 64
"""How many messages a datagram may hold: a short one in, and not a flood of answers out."""
MAX_BROADCAST_QUERIES = 4
"""How many messages to more than one component that are answered a peer may send in a second: all nodes
answer them, and who is answered need not be who has asked."""
MAX_BROADCAST_QUERIES_OF_ALL = 64
"""How many of them all peers together may send: a source is easily invented."""
MAX_BROADCAST_DELIVERIES = 4096
"""How often nodes take others of a peer in a second: a message that 16 nodes take counts sixteen times."""
_MISSED_HEARTBEATS_S = 5.0
_MAX_CLIENTS_KEPT = 16
"""Of a peer, at a time: most speak as one, and what many invent is to take no memory."""
_NO_SENDER = frozenset({0, BROADCAST})
"""Parts of an address that nobody has."""
_DESTINATION_BYTES, _SOURCE_BYTES = slice(4, 8), slice(8, 12)
"""Where in the header they lie: instance, component, node, subsystem."""

Event = MessageReceived | DatagramRefused | MessageNotSent


@dataclass(slots=True)
class _Peer:
    framing: Framing
    heard_s: float
    is_named: bool
    is_heard: bool = False
    clients: dict[int, Client] = field(default_factory=dict)
    """By JAUS id, so that not each message makes a new one."""
    queries: Allowance = field(default_factory=partial(Allowance, MAX_BROADCAST_QUERIES))
    """To more than one component; so the next."""
    deliveries: Allowance = field(default_factory=partial(Allowance, MAX_BROADCAST_DELIVERIES))


class Port:
    """Many nodes behind one port; give each a subsystem of its own: it says that it is its only node.

    Args:
        nodes: The nodes.
        peers: Who gets heartbeats from the beginning, in the XGV's own framing until it is heard in another.
        peer_timeout_s: After so long a silence a peer is forgotten, with its service connections; one that
            was named loses the connections, and goes on to get heartbeats.
        max_peers: How many may be known at once. When one more comes, the longest silent of those that were
            not named gives way if nothing came from it for five seconds; otherwise the new one is refused.
        max_events: How many messages may wait for ``next_event``; while so many do, whatever comes is refused
            and not acknowledged.
        max_notices: How many other events may wait; the oldest give way.
        max_waiting: How many datagrams may wait for one peer between two ``datagrams_to_send``.
        max_parts_size: How many bytes of large messages that are not whole may be kept for all peers;
            when there are more, the peer that keeps the most loses its own.

    Raises:
        LocalProtocolError: Two nodes have the same subsystem and node number.
    """

    def __init__(
        self,
        nodes: Iterable[Node],
        *,
        peers: Iterable[Hashable] = (),
        peer_timeout_s: float = 60.0,
        max_peers: int = 64,
        max_events: int = 10_000,
        max_notices: int = 1_000,
        max_waiting: int = 4096,
        max_parts_size: int = 1 << 22,
    ) -> None:
        self._nodes: dict[tuple[int, int], Node] = {}
        for node in nodes:
            self.add(node)
        self._peers = {peer: _Peer(Framing.JUDP1, 0.0, is_named=True) for peer in peers}
        self._peer_timeout_s = peer_timeout_s
        self._max_peers = max_peers
        self._crowded_until_s = -math.inf
        """Before then nobody gives way to a new peer: strangers are not to cost a search each."""
        self._max_waiting = max_waiting
        self._events: EventQueue[Event] = EventQueue(max_events, max_notices)
        self._outgoing: list[tuple[bytes, Hashable]] = []
        self._waiting: dict[Hashable, int] = {}
        """How many of them go where."""
        self._queries = Allowance(MAX_BROADCAST_QUERIES_OF_ALL)
        self.messages_not_sent = 0
        """How many messages could not go out, as ``MessageNotSent`` tells of each."""
        self._reassembly: dict[Hashable, Reassembly] = {}
        self._max_parts_size = max_parts_size
        self._parts_size = 0

    @property
    def notices_dropped(self) -> int:
        """Return how many refusals and the like gave way before anybody asked for them."""
        return self._events.dropped

    def add(self, node: Node) -> None:
        """Let a node take part.

        Raises:
            LocalProtocolError: There is one with its subsystem and node number.
        """
        key = node.description.subsystem, node.description.node
        if key in self._nodes:
            raise LocalProtocolError(f"port: node {key[0]}.{key[1]} is there already")
        self._nodes[key] = node

    def remove(self, node: Node) -> None:
        """Let a node leave; its clients are told that their service connections end.

        Raises:
            LocalProtocolError: It is not here.
        """
        key = node.description.subsystem, node.description.node
        if self._nodes.get(key) is not node:
            raise LocalProtocolError(f"port: node {key[0]}.{key[1]} is not here")
        del self._nodes[key]
        for client, message in node.terminate():
            if not node.is_silent:
                self.send(message, client)

    def receive_datagram(
        self, datagram: bytes, source: Hashable, now_s: float, at_most: int = MAX_MESSAGES
    ) -> int:
        """Take a datagram; acknowledgements and answers wait for ``datagrams_to_send``.

        Args:
            datagram: As it arrived.
            source: Where it came from.
            now_s: When.
            at_most: How many messages of it are taken, for callers who limit them.

        Returns:
            How many messages it held that were looked at.
        """
        try:
            framing, packets, flaw = unpack_until_flaw(datagram, MAX_MESSAGES)
        except DecodeError as error:
            self._refuse(source, str(error))
            return 0
        if len(packets) > at_most:
            packets, flaw = packets[:at_most], "too many messages at once"
        for packet in packets:
            if self._events.is_full:
                self._refuse(source, "as many messages wait as may")
                break
            self._receive_packet(packet, framing, source, now_s)
        else:
            if flaw is not None:
                self._refuse(source, flaw)
        return len(packets)

    def next_event(self) -> Event | None:
        """Return what has happened, one by one, None when that was all."""
        return self._events.next()

    def send(self, message: Message, client: Client) -> None:
        """Send an addressed message to a client, in its framing."""
        peer = self._peers.get(client.transport)
        self._post(message, client.transport, Framing.JUDP1 if peer is None else peer.framing)

    def heard_s(self, transport: Hashable) -> float:
        """Return when a message to one of the nodes came from there last, ``-inf`` if it is not known."""
        peer = self._peers.get(transport)
        return peer.heard_s if peer is not None and peer.is_heard else -math.inf

    def datagrams_to_send(self, now_s: float) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams to send now, each with where it goes."""
        for transport, peer in list(self._peers.items()):
            if peer.is_heard and peer.heard_s < now_s - self._peer_timeout_s:
                self._forget(transport, peer)
        for node in self._nodes.values():
            # Also of who is silent: what he missed is over when he speaks again.
            for client, report in node.due(now_s):
                if not node.is_silent:
                    self.send(report, client)
            pulse = node.heartbeat(now_s)
            if pulse is not None and not node.is_silent:
                for transport, peer in self._peers.items():
                    self._post(pulse, transport, peer.framing)
        outgoing, self._outgoing = self._outgoing, []
        self._waiting.clear()
        return outgoing

    def next_deadline_s(self) -> float | None:
        """Return when ``datagrams_to_send`` has something to send: ``-inf`` for now, None without nodes."""
        if self._outgoing:
            return -math.inf
        return min((node.next_deadline_s() for node in self._nodes.values()), default=None)

    def _receive_packet(self, packet: bytes, framing: Framing, source: Hashable, now_s: float) -> None:
        nodes = self._addressed(destination_of(packet))
        if not nodes:
            return
        if self._is_forged(packet):
            self._refuse(source, f"nobody can send from address {_dotted(packet[_SOURCE_BYTES])}")
            return
        try:
            message = decode_packet(framing, packet)
            if isinstance(message, ReportHeartbeatPulse):
                nodes = nodes[:1]  # it says that its sender lives: once is enough, whoever is addressed
            if refusal := self._why_refused(message, source, framing, now_s, len(nodes)):
                self._refuse(source, refusal)
                return
            whole = self._whole(message, source)
        except DecodeError as error:
            self._refuse(source, str(error))
            self._acknowledge(packet, framing, source, positive=False)
            return
        self._acknowledge(packet, framing, source, positive=True)
        if whole is None:
            return
        if isinstance(whole, CreateServiceConnection) and whole.header.destination.is_broadcast:
            self._refuse(source, "a service connection asked for of more than one component")
            return
        client = self._client(whole.header, source)
        for node in nodes:
            answers = node.receive(whole, client, now_s) if isinstance(whole, Message) else None
            if answers is None:
                self._events.add(MessageReceived(node, client, whole))
            for each in answers or ():
                self._post(each, source, framing)

    def _why_refused(
        self, message: Decoded, source: Hashable, framing: Framing, now_s: float, num_nodes: int
    ) -> str:
        """Return why a message is refused before anybody sees it, empty if it is not; then it is counted."""
        if not self._knows(source, framing, now_s):
            return f"{self._max_peers} peers are known already"
        if BROADCAST not in message.header.destination_id.to_bytes(4, "little"):
            return ""
        peer = self._peers[source]
        if not _is_answered(message):
            has_room = peer.deliveries.take(now_s, num_nodes)
            most = f"{MAX_BROADCAST_DELIVERIES // num_nodes} messages"
        elif not peer.queries.take(now_s):
            has_room, most = False, f"{MAX_BROADCAST_QUERIES} queries"
        else:
            has_room = self._queries.take(now_s)
            most = f"{MAX_BROADCAST_QUERIES_OF_ALL} queries of all peers"
        return "" if has_room else f"more than {most} to more than one component in a second"

    def _is_forged(self, packet: bytes) -> bool:
        """Return whether the source is no address, or one of this port's own nodes."""
        parts = packet[_SOURCE_BYTES]
        return not _NO_SENDER.isdisjoint(parts) or (parts[3], parts[2]) in self._nodes

    def _client(self, header: Header, source: Hashable) -> Client:
        known = self._peers[source].clients
        client = known.get(header.source_id)
        if client is None:
            if len(known) >= _MAX_CLIENTS_KEPT:
                known.clear()
            client = known[header.source_id] = Client(header.source, source)
        return client

    def _whole(self, message: Decoded, source: Hashable) -> Decoded | None:
        """Return the message, None while parts of it are missing."""
        if not isinstance(message, MessagePart):
            return message
        parts = self._reassembly.setdefault(source, Reassembly())
        before = parts.size
        try:
            return parts.add(message)
        finally:
            self._parts_size += parts.size - before
            while self._parts_size > self._max_parts_size:
                self._drop_parts(max(self._reassembly, key=lambda each: self._reassembly[each].size))

    def _drop_parts(self, source: Hashable) -> None:
        parts = self._reassembly.pop(source, None)
        self._parts_size -= 0 if parts is None else parts.size

    def _addressed(self, jaus_id: int) -> list[Node]:
        subsystem, number = jaus_id >> 24, jaus_id >> 16 & 0xFF
        if BROADCAST in (subsystem, number):
            nodes: Iterable[Node] = self._nodes.values()
        else:
            node = self._nodes.get((subsystem, number))
            nodes = () if node is None else (node,)
        return [node for node in nodes if not node.is_silent and node.component_at(jaus_id) is not None]

    def _acknowledge(self, packet: bytes, framing: Framing, source: Hashable, *, positive: bool) -> None:
        answer = acknowledgement(packet, positive=positive)
        if answer is not None:
            self._put(pack_datagrams(framing, [answer]), source)

    def _refuse(self, source: Hashable, reason: str) -> None:
        self._events.note(DatagramRefused(source, reason))

    def _post(self, message: Message, transport: Hashable, framing: Framing) -> None:
        if self._waiting.get(transport, 0) >= self._max_waiting:  # a flood is not to cost its encoding too
            self._no_room(transport)
            return
        try:
            datagrams = pack_datagrams(framing, encode_parts(message))
        except EncodeError as error:
            self._not_sent(transport, str(error))
            return
        self._put(datagrams, transport)

    def _put(self, datagrams: list[bytes], transport: Hashable) -> None:
        waiting = self._waiting.get(transport, 0) + len(datagrams)
        if waiting > self._max_waiting:
            self._no_room(transport)
            return
        self._waiting[transport] = waiting
        self._outgoing += [(each, transport) for each in datagrams]

    def _no_room(self, transport: Hashable) -> None:
        self._not_sent(transport, f"{self._max_waiting} datagrams wait for it already")

    def _not_sent(self, transport: Hashable, reason: str) -> None:
        self.messages_not_sent += 1
        self._events.note(MessageNotSent(transport, reason))

    def _knows(self, source: Hashable, framing: Framing, now_s: float) -> bool:
        """Take note of a peer that sends messages; return whether there is room for it."""
        peer = self._peers.get(source)
        if peer is None and len(self._peers) >= self._max_peers:
            if now_s <= self._crowded_until_s:
                return False
            silent = min(
                (known for known in self._peers.items() if not known[1].is_named),
                key=lambda known: known[1].heard_s,
                default=None,
            )
            if silent is None:
                return False
            self._crowded_until_s = silent[1].heard_s + _MISSED_HEARTBEATS_S
            if now_s <= self._crowded_until_s:
                return False
            self._forget(*silent)
        if peer is None:
            self._peers[source] = _Peer(framing, now_s, is_named=False, is_heard=True)
        else:
            peer.framing, peer.heard_s, peer.is_heard = framing, now_s, True
        return True

    def _forget(self, transport: Hashable, peer: _Peer) -> None:
        """Forget a peer with its service connections; one that was named goes on to get heartbeats."""
        if peer.is_named:
            peer.is_heard = False
            peer.clients.clear()
        else:
            del self._peers[transport]
        self._drop_parts(transport)
        for node in self._nodes.values():
            node.forget(transport)


def _is_answered(message: Decoded) -> bool:
    """Return whether nodes may answer a message."""
    if isinstance(message, UnknownMessage):
        return False
    return type(message) in ANSWERED or report_code_of(message.code) is not None


def _dotted(parts: bytes) -> str:
    return ".".join(map(str, reversed(parts)))
