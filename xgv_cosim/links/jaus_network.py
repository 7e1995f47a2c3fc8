"""Vehicles on a JAUS network: the ports that they are behind, and what carries the datagrams.

A port has room for 254 subsystems; who is past that is behind the next one. Datagrams travel over UDP, or
within the process in lockstep; the nodes do not know which.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from ipaddress import IPv4Address
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from jaus.capture import Recorder
from jaus.errors import TransportError
from jaus.messages import UnknownMessage
from jaus.port import DatagramRefused, Event, MessageNotSent, MessageReceived, Port
from jaus.transports import UdpTransport
from xgv_cosim.errors import LinkError

if TYPE_CHECKING:
    from jaus.messages import Message
    from jaus.node import Node
    from jaus.service_connection import Client

MOST_AT_ONCE = 10_000
"""A port reads no more datagrams than this at one look, and takes no more messages of them, each place its
share, so that a flood neither keeps the run from going on nor mutes others; further messages are refused."""
_MAX_WAITING = 8192
"""Datagrams to one peer between two looks: all reports of 254 vehicles at once, and as much again."""
_MAX_PEERS = 512
"""Clients of a port, each vehicle's own and as many again."""
_MAX_PARTS_SIZE = 1 << 17
"""Bytes of large messages that are not whole, of all places: none that vehicles take is large."""
MOST_OF_ONE_PEER = 4096
"""So many messages of one place are taken at one look, however many lie in a datagram; further ones are
refused. A datagram without any counts as one."""
STANDARD_PORT = 3794
"""UDP port of JAUS (XGV-56)."""


class Transport(Protocol):
    """Carries datagrams between places; ``jaus.transports`` has two, each with places of its own kind."""

    @property
    def not_sent(self) -> int:
        """Return how many datagrams nobody took."""
        ...

    @property
    def place(self) -> Any:  # noqa: ANN401 - what it knows places by
        """Return where it listens."""
        ...

    def receive(self, at_most: int = MOST_AT_ONCE) -> list[tuple[bytes, Any]]:
        """Return the datagrams that have arrived, each with where it came from."""
        ...

    def send(self, datagrams: Iterable[tuple[bytes, Any]]) -> None:
        """Send datagrams, each to its place."""
        ...

    def close(self) -> None:
        """Give the place back."""
        ...


@dataclass(slots=True)
class WireCounts:
    """What went over the network, and what did not."""

    datagrams_received: int = 0
    datagrams_sent: int = 0
    refused: int = 0
    """Datagrams, or messages of them, that are none."""
    unknown: int = 0
    """Messages with a code that nobody here knows."""
    not_sent: int = 0
    """Messages without a form in the peer's framing, or too many at once, and datagrams that nobody took."""
    first_refusal: str = ""
    """Why the first one was refused."""


class _Line(NamedTuple):
    port: Port
    transport: Transport


class JausNetwork:
    """The ports of a run.

    Args:
        open_transport: Makes the transport of a port, given its number from 0 on.
        peers: Who gets heartbeats from the beginning.
    """

    def __init__(self, open_transport: Callable[[int], Transport], peers: Iterable[Hashable] = ()) -> None:
        self._open_transport = open_transport
        self._recorder: Recorder | None = None
        self._peers = tuple(peers)
        self._lines: list[_Line] = []
        self.counts = WireCounts()
        self._line(0)

    @property
    def places(self) -> tuple[Any, ...]:
        """Return where its ports listen."""
        return tuple(line.transport.place for line in self._lines)

    def add(self, node: Node, number: int) -> None:
        """Put a node behind a port, which is opened when it is first asked for.

        Raises:
            TransportError: Its place is taken, or none of this machine's.
        """
        self._line(number).port.add(node)

    def remove(self, node: Node, number: int) -> None:
        """Take a node away; its clients are told that their service connections end."""
        self._lines[number].port.remove(node)

    def receive(self, now_s: float) -> Iterator[MessageReceived]:
        """Take what has arrived, and return the messages that are the vehicles' business."""
        for line in self._lines:
            datagrams = line.transport.receive(MOST_AT_ONCE)
            self.counts.datagrams_received += len(datagrams)
            of_source = Counter[Hashable]()
            # Everybody gets the same share of what is taken at a look: a few cannot mute the others.
            share = min(MOST_OF_ONE_PEER, MOST_AT_ONCE // max(1, len({source for _, source in datagrams})))
            for datagram, source in datagrams:
                self._record(datagram, source, line.transport.place, now_s)
                at_most = share - of_source[source]
                if at_most <= 0:
                    self._count(DatagramRefused(source, "too many messages at once"))
                    continue
                of_source[source] += max(1, line.port.receive_datagram(datagram, source, now_s, at_most))
                yield from self._events_of(line.port)

    def send(self, message: Message, client: Client, number: int) -> None:
        """Send an addressed message to a client of a port."""
        self._lines[number].port.send(message, client)

    def heard_s(self, transport: Hashable, number: int) -> float:
        """Return when a port last heard anything from there, ``-inf`` for never."""
        return self._lines[number].port.heard_s(transport)

    def flush(self, now_s: float) -> None:
        """Send answers, reports and heartbeats that are due."""
        for line in self._lines:
            datagrams = line.port.datagrams_to_send(now_s)
            destination: Any
            for datagram, destination in datagrams:
                self._record(datagram, line.transport.place, destination, now_s)
            before = line.transport.not_sent
            line.transport.send(datagrams)
            failed = line.transport.not_sent - before
            self.counts.not_sent += failed
            self.counts.datagrams_sent += len(datagrams) - failed
            while (event := line.port.next_event()) is not None:
                self._count(event)

    def close(self) -> None:
        """Give the ports back."""
        for line in self._lines:
            line.transport.close()
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            self._or_link_error(recorder.close)

    def record_with(self, recorder: Recorder) -> None:
        """Record every datagram from now on; it is closed with the network."""
        self._recorder = recorder

    def _record(self, datagram: bytes, source: Any, destination: Any, now_s: float) -> None:  # noqa: ANN401 - places
        if self._recorder is not None:
            record = partial(self._recorder.record, datagram, source, destination, max(0.0, now_s))
            self._or_link_error(record)

    @staticmethod
    def _or_link_error(write: Callable[[], None]) -> None:
        try:
            write()
        except OSError as error:
            raise LinkError(f"--jaus-record: {error.strerror or error}; the run cannot be recorded") from None

    def _line(self, number: int) -> _Line:
        while len(self._lines) <= number:
            transport = self._open_transport(len(self._lines))
            self._lines.append(
                _Line(
                    Port(
                        (),
                        peers=self._peers,
                        max_waiting=_MAX_WAITING,
                        max_peers=_MAX_PEERS,
                        max_parts_size=_MAX_PARTS_SIZE,
                    ),
                    transport,
                )
            )
        return self._lines[number]

    def _events_of(self, port: Port) -> Iterator[MessageReceived]:
        while (event := port.next_event()) is not None:
            if isinstance(event, MessageReceived) and not isinstance(event.message, UnknownMessage):
                yield event
            else:
                self._count(event)

    def _count(self, event: Event) -> None:
        """Count what is nobody's business here."""
        match event:
            case DatagramRefused():
                self.counts.refused += 1
                self.counts.first_refusal = self.counts.first_refusal or f"{event.source}: {event.reason}"
            case MessageNotSent():
                self.counts.not_sent += 1
            case MessageReceived():
                self.counts.unknown += 1


@dataclass(frozen=True, slots=True)
class JausOptions:
    """Where a run is to be reached by clients that speak JAUS.

    Raises:
        LinkError: An address is not of the loopback, and others are not allowed.
    """

    host: str = "127.0.0.1"
    """IPv4 address of this machine."""
    port: int = STANDARD_PORT
    """UDP port, 0 takes a free one; a second port, where it is needed, has the next number."""
    peers: tuple[tuple[str, int], ...] = ()
    """Who gets heartbeats from the beginning."""
    allow_network: bool = False
    """Allow other addresses than those of the loopback."""
    record: Path | None = None
    """File for every datagram, in the pcap format; times are those of the simulation."""

    def __post_init__(self) -> None:
        for place in (self.host, *(name for name, _ in self.peers)):
            try:
                is_loopback = IPv4Address(place).is_loopback
            except ValueError:
                raise LinkError(
                    f"--jaus: got {place!r}, expected an IPv4 address such as 127.0.0.1"
                ) from None
            if not (self.allow_network or is_loopback):
                raise LinkError(
                    f"--jaus: got {place}, an address of a network, expected one of the loopback such as "
                    "127.0.0.1; a real vehicle may listen there, so add --allow-network if you mean it"
                )

    def open(self) -> JausNetwork:
        """Return the network, its first port open.

        Raises:
            LinkError: The port is taken, the address is not ours, or the record cannot be written.
        """

        def transport(number: int) -> UdpTransport:
            try:
                port = self.port + number if self.port else 0
                return UdpTransport(self.host, port, may_broadcast=self.allow_network)
            except TransportError as error:
                raise LinkError(f"--jaus: {error}") from None

        network = JausNetwork(transport, self.peers)
        if self.record is not None:
            try:
                network.record_with(Recorder(self.record))
            except OSError as error:
                network.close()
                raise LinkError(f"--jaus-record: {self.record}: {error.strerror}") from None
        return network
