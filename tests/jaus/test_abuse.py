"""Fuzzed datagrams into a port: no exception, nothing delivered that nobody can have sent, bounded memory.

Random bytes, mutated messages of another implementation, sizes that lie, sources that nobody has, parts of
large messages, and datagrams full of messages; from far more places than may be peers. The application and
the way out do not always keep up.
"""

from __future__ import annotations

import gc
import random
import sys
from collections import Counter
from types import FunctionType, MethodType, ModuleType

import pytest

from jaus.address import BROADCAST
from jaus.errors import EncodeError
from jaus.header import ACKNOWLEDGEMENT_BITS, HEADER_SIZE, Acknowledgement
from jaus.messages.core import QueryComponentStatus, ReportComponentStatus
from jaus.packet import Framing, pack_datagrams, unpack_datagram
from jaus.port import DatagramRefused, MessageReceived, Port
from tests.jaus.golden import GOLDEN
from tests.jaus.test_port import MPD, NM, OWN, PD, VSS, Wire, assert_bounded, at, node

SUBSYSTEMS = (1, 2, 3)
PLACES = 300
STEP_S = 0.002
NAMED = ("127.0.0.1", 1)
MOST_BYTES = 10_000_000
"""What a port may keep at any time: most of it are messages that the application does not take."""
SETTLED_BYTES = 200_000
"""And what it may keep when it is over and all events are taken: little more than its nodes."""


class Fuzz:
    """Makes datagrams that nobody meant."""

    def __init__(self, seed: int) -> None:
        self._dice = random.Random(seed)
        self._packets = [golden.data for golden in GOLDEN]
        often = self._noise, self._mutated, self._sized, self._forged, self._part
        self._kinds = (*often * 6, self._crowd)

    def datagram(self) -> bytes:
        return self._dice.choice(self._kinds)()

    def source(self) -> tuple[str, int]:
        return "127.0.0.1", self._dice.randrange(PLACES)

    def _packet(self) -> bytearray:
        """Return a message to one of the nodes, from one of a few thousand invented clients."""
        dice = self._dice
        packet = bytearray(dice.choice(self._packets))
        subsystem = BROADCAST if dice.random() < 0.05 else dice.choice(SUBSYSTEMS)
        component = BROADCAST if dice.random() < 0.05 else dice.choice((NM, PD, MPD, VSS))
        packet[4:8] = bytes((1, component, 1, subsystem))
        packet[8:12] = bytes((1, dice.randrange(1, 9), dice.randrange(2, 9), dice.randrange(1, 99)))
        if dice.random() < 0.3:
            packet[0] = packet[0] & ~ACKNOWLEDGEMENT_BITS | Acknowledgement.REQUESTED << 4
        return packet

    def _framed(self, *packets: bytes | bytearray) -> bytes:
        framing = self._dice.choice(list(Framing))
        try:
            return pack_datagrams(framing, map(bytes, packets), max_messages=len(packets), max_size=65_000)[0]
        except EncodeError:  # no form in SAE JAUS
            return pack_datagrams(Framing.OPC, map(bytes, packets), max_messages=len(packets))[0]

    def _noise(self) -> bytes:
        begin = self._dice.choice([b"", *(framing.value for framing in Framing)])
        return begin + self._dice.randbytes(self._dice.choice((0, 1, 3, 19, 40, 200)))

    def _mutated(self) -> bytes:
        data = bytearray(self._framed(self._packet()))
        for _ in range(self._dice.randrange(1, 5)):
            data[self._dice.randrange(len(data))] = self._dice.randrange(256)
        return bytes(data[: self._dice.randrange(len(data))] if self._dice.random() < 0.2 else data)

    def _sized(self) -> bytes:
        """Return a message whose lengths are other ones than it has: in the header, in the framing, in it."""
        packet = self._packet()
        size = self._dice.choice((0, 1, len(packet), 4080, 4095, 0xFFFF))
        where = self._dice.choice((12, HEADER_SIZE, HEADER_SIZE + 1, 3))
        if where == 12:
            packet[12:14] = size.to_bytes(2, "little")
        elif where < len(packet):
            packet[where] = 0xFF
        data = bytearray(self._framed(packet))
        if where == 3:
            data[1:5] = self._dice.choice((0, 16, 0xFFFF, 0x100_0010)).to_bytes(4, "big")
        return bytes(data) + bytes(self._dice.choice((0, 0, 1, 500, 4000)))

    def _forged(self) -> bytes:
        packet = self._packet()
        own = bytes((1, PD, 1, self._dice.choice(SUBSYSTEMS)))
        packet[8:12] = self._dice.choice((own, bytes(4), b"\xff" * 4, b"\1\4\0\1", b"\1\4\xff\1"))
        return self._framed(packet)

    def _part(self) -> bytes:
        packet = self._packet() + bytes(self._dice.choice((0, 10, 4000)))
        flag = self._dice.choice((1, 1, 2, 4, 8, 15))
        packet[12:14] = (len(packet) - HEADER_SIZE | flag << 12).to_bytes(2, "little")
        packet[14:16] = self._dice.randrange(3).to_bytes(2, "little")
        return Framing.OPC.value + bytes(packet)

    def _crowd(self) -> bytes:
        return self._framed(*(self._packet() for _ in range(self._dice.choice((1, 2, 5, 64, 100)))))


def abuse(port: Port, datagrams: int, seed: int) -> Counter[str]:
    """Send fuzzed datagrams; return how many events of which kind came of them."""
    fuzz, found = Fuzz(seed), Counter[str]()
    for number in range(datagrams):
        now_s = number * STEP_S
        port.receive_datagram(fuzz.datagram(), fuzz.source(), now_s)
        if number % 500 == 0:
            assert_bounded(port)
        if number % 50_000 == 39_999:  # the application has stood still for a while
            assert kept_bytes(port) < MOST_BYTES
        # Each in turn stands still for a while: the application, and the way out.
        if number % 40_000 < 30_000:
            found += events_of(port)
        if number % 30_000 < 28_000 and number % 100 == 0:
            for datagram, _ in port.datagrams_to_send(now_s):
                unpack_datagram(datagram)
    assert_bounded(port)
    return found + events_of(port)


def events_of(port: Port) -> Counter[str]:
    found = Counter[str]()
    while (event := port.next_event()) is not None:
        found[type(event).__name__] += 1
        if isinstance(event, MessageReceived):
            header = event.message.header
            source = (header.source_id >> 24, header.source_id >> 16 & 0xFF)
            assert {0, BROADCAST}.isdisjoint(header.source_id.to_bytes(4, "big"))
            assert source not in {(subsystem, 1) for subsystem in SUBSYSTEMS}
            assert event.node.component_at(header.destination_id) is not None
        elif isinstance(event, DatagramRefused):
            assert event.reason.isprintable()
    return found


def kept_bytes(root: object) -> int:
    """Return the size of everything that an object holds, however deep."""
    waiting, seen, total = [root], {id(root)}, 0
    while waiting:
        each = waiting.pop()
        total += sys.getsizeof(each)
        for held in gc.get_referents(each):
            if id(held) not in seen and not isinstance(held, type | ModuleType | FunctionType | MethodType):
                seen.add(id(held))
                waiting.append(held)
    return total


def settled(port: Port, now_s: float) -> None:
    """See that after a silence nothing is left of it all, and that the port does its work."""
    port.datagrams_to_send(now_s)
    assert port._peers.keys() == {NAMED}
    assert not port._reassembly
    assert not port._outgoing
    assert all(not list(each) for node_ in port._nodes.values() for each in node_._connections.values())
    wire = Wire(port)
    wire.now_s = now_s
    (report,) = wire.asked(QueryComponentStatus().to(at(PD), source=OWN))
    assert isinstance(report, ReportComponentStatus)
    assert kept_bytes(port) < SETTLED_BYTES


def test_twenty_thousand_fuzzed_datagrams() -> None:
    port = Port([node(number) for number in SUBSYSTEMS], peers=[NAMED])
    found = abuse(port, 20_000, seed=1)
    assert found["MessageReceived"] > 1000
    assert found["DatagramRefused"] > 1000
    settled(port, 20_000 * STEP_S + 60.1)


@pytest.mark.slow
def test_a_million_fuzzed_datagrams() -> None:
    """Nothing grows: not the port, and not the number of objects that there are."""
    port = Port([node(number) for number in SUBSYSTEMS], peers=[NAMED])
    abuse(port, 50_000, seed=2)
    settled(port, 50_000 * STEP_S + 60.1)
    gc.collect()
    objects = len(gc.get_objects())
    port = Port([node(number) for number in SUBSYSTEMS], peers=[NAMED])
    found = abuse(port, 1_000_000, seed=3)
    assert found["MessageReceived"] > 100_000
    assert found["DatagramRefused"] > 100_000
    settled(port, 1_000_000 * STEP_S + 60.1)
    gc.collect()
    assert len(gc.get_objects()) < objects + 10_000
