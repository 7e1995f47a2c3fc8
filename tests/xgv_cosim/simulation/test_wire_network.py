"""The network of a run: what it takes of one place at a look, how many it knows, what it counts."""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING

import pytest

from jaus.address import JausAddress
from jaus.codec import encode
from jaus.messages.core import QueryComponentStatus, ReportComponentStatus, Resume
from jaus.packet import Framing, pack_datagrams
from jaus.service_connection import Client
from jaus.transports import LoopbackNetwork, UdpTransport
from tests.jaus.test_port import node
from tests.xgv_cosim.simulation.wire_client import CARS, MPD, OWN, WireClient
from xgv_cosim.links import jaus_network
from xgv_cosim.links.jaus_network import MOST_AT_ONCE, MOST_OF_ONE_PEER, JausNetwork, JausOptions

if TYPE_CHECKING:
    from collections.abc import Hashable

    from jaus.messages import Message

AT = JausAddress(1, 1, MPD, 1)


def network_of_one() -> tuple[JausNetwork, LoopbackNetwork]:
    loopback = LoopbackNetwork()
    network = JausNetwork(lambda number: loopback.open(("cars", number)))
    network.add(node(1, heartbeat_begin_s=1000.0), 0)
    return network, loopback


def carry(
    loopback: LoopbackNetwork, message: Message, times: int, place: Hashable, *, packed: int = 64
) -> None:
    packet = encode(message.to(AT, source=OWN))
    datagrams = pack_datagrams(Framing.JUDP1, [packet] * times, max_messages=packed, max_size=65_000)
    assert all(loopback.carry(each, place, CARS) for each in datagrams)


@pytest.mark.parametrize("packed", [1, 64])
def test_messages_of_one_place_are_counted_however_they_are_packed(packed: int) -> None:
    """A flood keeps neither the run from going on, nor others from being heard in the same look."""
    network, loopback = network_of_one()
    carry(loopback, Resume(), MOST_OF_ONE_PEER + 3 * 64 - 1, "flood", packed=packed)
    carry(loopback, Resume(), 1, "other")
    taken = [event.client.transport for event in network.receive(0.0)]
    assert (taken.count("flood"), taken.count("other")) == (MOST_OF_ONE_PEER, 1)
    assert network.counts.refused >= 3
    carry(loopback, Resume(), 5, "flood")  # the next look
    assert len(list(network.receive(0.1))) == 5


def test_the_end_of_a_datagram_that_is_too_many_is_refused() -> None:
    network, loopback = network_of_one()
    carry(loopback, Resume(), MOST_OF_ONE_PEER - 2, "flood", packed=1)
    carry(loopback, Resume(), 10, "flood")
    carry(loopback, Resume(), 1, "flood")
    assert len(list(network.receive(0.0))) == MOST_OF_ONE_PEER
    assert network.counts.refused == 2
    assert network.counts.first_refusal == "flood: too many messages at once"


def test_all_places_together_have_a_limit_too_and_each_its_share() -> None:
    network, loopback = network_of_one()
    for number in range(6):
        carry(loopback, Resume(), 2048, number)
    carry(loopback, Resume(), 3, "other")
    taken = [event.client.transport for event in network.receive(0.0)]
    share = MOST_AT_ONCE // 7
    assert [taken.count(place) for place in (*range(6), "other")] == [share] * 6 + [3]
    assert network.counts.first_refusal == "0: too many messages at once"


def test_datagrams_without_a_message_count_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jaus_network, "MOST_OF_ONE_PEER", 10)
    network, loopback = network_of_one()
    for _ in range(15):
        loopback.carry(b"nothing", "junk", CARS)
    carry(loopback, Resume(), 1, "junk")
    assert list(network.receive(0.0)) == []
    assert network.counts.refused == 16


def test_a_port_knows_512_places_and_tells_the_next_one_nothing() -> None:
    network, loopback = network_of_one()
    clients = [WireClient(loopback, f"client{number}") for number in range(513)]
    for client in clients:
        client.say(QueryComponentStatus(), MPD)
    assert list(network.receive(0.0)) == []
    network.flush(0.0)
    answers = [len(client.listen(ReportComponentStatus)) for client in clients]
    assert answers == [1] * 512 + [0]
    assert network.counts.refused == 1
    assert network.counts.first_refusal == "client512: 512 peers are known already"


def test_what_is_sent_and_what_nobody_takes_is_counted() -> None:
    network, loopback = network_of_one()
    client = WireClient(loopback)
    for _ in range(3):
        client.say(QueryComponentStatus(), MPD)
    carry(loopback, QueryComponentStatus(), 2, "nobody there", packed=1)
    assert list(network.receive(0.0)) == []
    network.flush(0.0)
    assert len(client.listen(ReportComponentStatus)) == 3
    assert (network.counts.datagrams_sent, network.counts.not_sent) == (3, 2)
    network.send(ReportComponentStatus(999).to(OWN, source=AT), Client(OWN, "client"), 0)
    network.send(ReportComponentStatus(1).to(OWN, source=AT), Client(OWN, "client"), 0)
    network.flush(0.1)
    assert len(client.listen(ReportComponentStatus)) == 1
    assert (network.counts.datagrams_sent, network.counts.not_sent) == (4, 3)


@pytest.mark.parametrize("allowed", [False, True])
def test_only_a_network_that_is_allowed_is_spoken_to_all_at_once(allowed: bool) -> None:
    """The socket's own lock: without ``--allow-network`` no datagram can go to a broadcast address."""
    network = JausOptions(port=0, allow_network=allowed).open()
    ((_, transport),) = network._lines
    assert isinstance(transport, UdpTransport)
    with socket.socket(fileno=os.dup(transport.fileno())) as same:
        assert bool(same.getsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST)) is allowed
    network.close()
