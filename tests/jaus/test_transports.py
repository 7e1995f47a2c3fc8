"""One suite for both transports, and a controller that drives a port over each of them."""

from __future__ import annotations

import errno
import select
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from jaus.address import JausAddress
from jaus.controller import Acknowledged, Controller
from jaus.errors import TransportError
from jaus.messages.core import ReportComponentStatus, Resume
from jaus.port import MessageReceived, Port
from jaus.transports import LoopbackNetwork, LoopbackTransport, UdpTransport
from tests.jaus.test_port import PD, at, node

Transport = UdpTransport | LoopbackTransport
Opener = Callable[[], Transport]


@pytest.fixture(params=["udp", "loopback"])
def opened(request: pytest.FixtureRequest) -> Iterator[Opener]:
    """Return what opens transports that reach each other."""
    network = LoopbackNetwork()
    with ExitStack() as stack:

        def one() -> Transport:
            transport: Transport = (
                UdpTransport() if request.param == "udp" else network.open(("127.0.0.1", len(found)))
            )
            found.append(transport)
            stack.callback(transport.close)
            return transport

        found: list[Transport] = []
        yield one


def arrived(transport: Transport, number: int) -> list[tuple[bytes, object]]:
    """Return ``number`` datagrams, which may be on their way still."""
    found = list(transport.receive())
    while len(found) < number:
        assert isinstance(transport, UdpTransport)
        assert select.select([transport], [], [], 10.0)[0]
        found += transport.receive()
    return found


def test_datagrams_arrive_in_order_with_where_they_came_from(opened: Opener) -> None:
    one, other = opened(), opened()
    assert other.receive() == []
    one.send([(bytes([number]), other.place) for number in range(5)])
    assert arrived(other, 5) == [(bytes([number]), one.place) for number in range(5)]
    assert other.receive() == []
    other.send([(b"back", one.place)])
    assert arrived(one, 1) == [(b"back", other.place)]
    assert one.not_sent == 0


def test_no_more_are_taken_than_asked_for(opened: Opener) -> None:
    one, other = opened(), opened()
    one.send([(b"1", other.place), (b"2", other.place), (b"3", other.place)])
    if isinstance(other, UdpTransport):
        assert select.select([other], [], [], 10.0)[0]
    assert [datagram for datagram, _ in other.receive(at_most=1)] == [b"1"]
    assert [datagram for datagram, _ in arrived(other, 2)] == [b"2", b"3"]


def test_what_cannot_be_sent_is_counted(opened: Opener) -> None:
    one = opened()
    one.send([(bytes(70_000), ("127.0.0.1", 9))])  # too large for UDP; on loopback nobody is there
    one.send([(b"1", ("127.0.0.1", 70_000)), (b"2", ("127.0.0.1", -1))])
    assert one.not_sent == 3


def test_a_controller_resumes_a_car_and_hears_of_it(opened: Opener) -> None:
    car, client = opened(), opened()
    port = Port([node(1)])
    controller = Controller(JausAddress(1, 2, 4, 1), car.place)
    command = controller.command(Resume(), at(PD), 0.0, acknowledged=True)
    controller.subscribe(ReportComponentStatus, at(PD), 10.0, 0.0)
    client.send(controller.datagrams_to_send(0.0))  # type: ignore[arg-type]
    for datagram, source in arrived(car, 3):
        port.receive_datagram(datagram, source, 0.0)
    car.send(port.datagrams_to_send(0.0))  # type: ignore[arg-type]
    for datagram, source in arrived(client, 4):
        controller.receive_datagram(datagram, source, 0.0)
    events = []
    while (event := controller.next_event()) is not None:
        events.append(event)
    assert events[0] == Acknowledged(command, positive=True)
    assert any(
        isinstance(event, MessageReceived) and isinstance(event.message, ReportComponentStatus)
        for event in events
    )
    assert isinstance(port.next_event(), MessageReceived)


def test_a_port_that_is_taken_is_told() -> None:
    with (
        UdpTransport() as one,
        pytest.raises(TransportError, match="the port is taken; another node manager"),
    ):
        UdpTransport(*one.place)


@pytest.mark.parametrize(
    ("host", "port", "reason"),
    [
        ("192.0.2.1", 3794, "this machine has no such address"),
        ("127.0.0.1", 70_000, "0-65535"),
    ],
)
def test_an_address_that_is_none_is_told(host: str, port: int, reason: str) -> None:
    with pytest.raises(TransportError, match=reason):
        UdpTransport(host, port)


def test_a_way_that_is_closed_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    with UdpTransport() as one:
        monkeypatch.setattr(one, "_socket", Closed(one._socket))
        one.send([(b"1", ("127.0.0.1", 9))])
        assert one.not_sent == 1
        assert one.receive() == []


class Closed:
    """A socket whose buffer is full, and whose peer is gone."""

    def __init__(self, real: socket.socket) -> None:
        self.close = real.close

    def sendto(self, _datagram: bytes, _place: object) -> int:
        raise BlockingIOError(errno.EAGAIN, "full")

    def recvfrom(self, _size: int) -> tuple[bytes, object]:
        raise ConnectionRefusedError(errno.ECONNREFUSED, "gone")


def test_a_place_of_the_loopback_network_is_one_transports() -> None:
    network = LoopbackNetwork(max_waiting=2)
    one, other = network.open("one"), network.open("other")
    with pytest.raises(TransportError, match="loopback one: the place is taken"):
        network.open("one")
    one.send([(b"1", "other"), (b"2", "other"), (b"3", "other"), (b"4", "nobody")])
    assert one.not_sent == 2
    assert len(other.receive()) == 2
    other.close()
    one.send([(b"5", "other")])
    assert one.not_sent == 3
    assert network.open("other").receive() == []
