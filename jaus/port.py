"""Datagrams of many nodes behind one UDP port: routed, framed as each peer frames them, acknowledged.

The caller owns the socket and the clock::

    port.receive_datagram(data, source, now_s)     # for each that has arrived
    while (event := port.next_event()) is not None: ...
    for data, destination in port.datagrams_to_send(now_s): ...
    sleep until port.next_deadline_s()

A peer is where datagrams come from; answers go there, address and port. Whoever has sent a message gets
heartbeats, and so do peers that were named beforehand.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from operator import itemgetter

from jaus.address import BROADCAST
from jaus.codec import Decoded, encode_parts
from jaus.errors import DecodeError, EncodeError, LocalProtocolError
from jaus.header import Header
from jaus.messages import Message, MessagePart
from jaus.node import Node
from jaus.packet import (
    Framing,
    acknowledgement,
    decode_packet,
    destination_of,
    pack_datagrams,
    unpack_datagram,
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
    """A datagram, or one message of it, that is none."""

    source: Hashable
    reason: str


@dataclass(frozen=True, slots=True)
class MessageNotSent:
    """A message that cannot go out: it has no form in the peer's framing, or a value does not fit."""

    destination: Hashable
    reason: str


_MISSED_HEARTBEATS_S = 5.0
_MAX_CLIENTS_KEPT = 512

Event = MessageReceived | DatagramRefused | MessageNotSent


@dataclass(slots=True)
class _Peer:
    framing: Framing
    heard_s: float
    is_named: bool
    is_heard: bool = False
    clients: dict[int, Client] = field(default_factory=dict)
    """By JAUS id, so that not each message makes a new one."""


class Port:
    """Many nodes behind one port; give each a subsystem of its own, or a node number.

    Args:
        nodes: The nodes.
        peers: Who gets heartbeats from the beginning, in the XGV's own framing until it is heard in another.
        peer_timeout_s: After so long a silence a peer is forgotten, with its service connections.
        max_peers: How many may be known at once. When one more comes, the longest silent gives way if it has
            missed five heartbeats; otherwise the new one is refused.
        max_events: How many events may wait; the oldest give way.

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
    ) -> None:
        self._nodes: dict[tuple[int, int], Node] = {}
        for node in nodes:
            self.add(node)
        self._peers = {peer: _Peer(Framing.JUDP1, 0.0, is_named=True) for peer in peers}
        self._peer_timeout_s = peer_timeout_s
        self._max_peers = max_peers
        self._events: deque[Event] = deque(maxlen=max_events)
        self._outgoing: list[tuple[bytes, Hashable]] = []
        self._reassembly: dict[Hashable, Reassembly] = {}

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
        """Let a node leave; its clients are told that their service connections end."""
        del self._nodes[node.description.subsystem, node.description.node]
        for client, message in node.terminate():
            self.send(message, client)

    def receive_datagram(self, datagram: bytes, source: Hashable, now_s: float) -> None:
        """Take a datagram; acknowledgements and answers wait for ``datagrams_to_send``."""
        try:
            framing, packets = unpack_datagram(datagram)
        except DecodeError as error:
            self._events.append(DatagramRefused(source, str(error)))
            return
        for packet in packets:
            self._receive_packet(packet, framing, source, now_s)

    def next_event(self) -> Event | None:
        """Return what has happened, one by one, None when that was all."""
        return self._events.popleft() if self._events else None

    def send(self, message: Message, client: Client) -> None:
        """Send an addressed message to a client, in its framing."""
        peer = self._peers.get(client.transport)
        self._post(message, client.transport, Framing.JUDP1 if peer is None else peer.framing)

    def heard_s(self, transport: Hashable) -> float:
        """Return when a message to one of the nodes came from there last, ``-inf`` for never."""
        peer = self._peers.get(transport)
        return peer.heard_s if peer is not None and peer.is_heard else -math.inf

    def datagrams_to_send(self, now_s: float) -> list[tuple[bytes, Hashable]]:
        """Return the datagrams to send now, each with where it goes."""
        self._forget_silent(now_s - self._peer_timeout_s)
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
        return outgoing

    def next_deadline_s(self) -> float | None:
        """Return when ``datagrams_to_send`` has something to send; None without nodes."""
        return min((node.next_deadline_s() for node in self._nodes.values()), default=None)

    def _receive_packet(self, packet: bytes, framing: Framing, source: Hashable, now_s: float) -> None:
        nodes = self._addressed(destination_of(packet))
        if not nodes:
            return
        try:
            message = decode_packet(framing, packet)
            if not self._knows(source, framing, now_s):
                self._events.append(DatagramRefused(source, f"{self._max_peers} peers are known already"))
                return
            whole = self._whole(message, source)
        except DecodeError as error:
            self._events.append(DatagramRefused(source, str(error)))
            self._acknowledge(packet, framing, source, positive=False)
            return
        self._acknowledge(packet, framing, source, positive=True)
        if whole is None:
            return
        client = self._client(whole.header, source)
        for node in nodes:
            answers = node.receive(whole, client, now_s) if isinstance(whole, Message) else None
            if answers is None:
                self._events.append(MessageReceived(node, client, whole))
            for each in answers or ():
                self._post(each, source, framing)

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
        if isinstance(message, MessagePart):
            return self._reassembly.setdefault(source, Reassembly()).add(message)
        return message

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
            self._outgoing += [(each, source) for each in pack_datagrams(framing, [answer])]

    def _post(self, message: Message, transport: Hashable, framing: Framing) -> None:
        try:
            datagrams = pack_datagrams(framing, encode_parts(message))
        except EncodeError as error:
            self._events.append(MessageNotSent(transport, str(error)))
            return
        self._outgoing += [(each, transport) for each in datagrams]

    def _knows(self, source: Hashable, framing: Framing, now_s: float) -> bool:
        """Take note of a peer that sends messages; return whether there is room for it."""
        peer = self._peers.get(source)
        if peer is None and len(self._peers) >= self._max_peers:
            self._forget_silent(now_s - _MISSED_HEARTBEATS_S, at_most=1)
            if len(self._peers) >= self._max_peers:
                return False
        if peer is None:
            self._peers[source] = _Peer(framing, now_s, is_named=False, is_heard=True)
        else:
            peer.framing, peer.heard_s, peer.is_heard = framing, now_s, True
        return True

    def _forget_silent(self, since_s: float, at_most: int | None = None) -> None:
        """Forget the peers that were not heard since then, the longest silent first."""
        silent = [
            (peer.heard_s, transport)
            for transport, peer in self._peers.items()
            if peer.heard_s < since_s and not peer.is_named
        ]
        for _, transport in sorted(silent, key=itemgetter(0))[:at_most]:
            del self._peers[transport]
            self._reassembly.pop(transport, None)
            for node in self._nodes.values():
                node.forget(transport)
