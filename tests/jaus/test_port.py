"""Nodes behind a port: what real clients do, over a fake wire and a clock that the test moves."""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Hashable

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.codec import Decoded, decode, encode, encode_parts
from jaus.discovery import ComponentDescription, NodeDescription
from jaus.errors import LocalProtocolError
from jaus.header import Acknowledgement
from jaus.messages import Ack, Message, UnknownMessage
from jaus.messages.core import (
    ConfirmServiceConnection,
    CreateServiceConnection,
    QueryComponentStatus,
    ReportComponentControl,
    ReportComponentStatus,
    ReportHeartbeatPulse,
    RequestComponentControl,
    Resume,
    TerminateServiceConnection,
)
from jaus.messages.discovery import QueryIdentification, ReportIdentification
from jaus.messages.events import CancelEvent, Event
from jaus.messages.platform import (
    QueryVelocityState,
    QueryWrenchEffort,
    ReportDiscreteDevices,
    ReportVelocityState,
    ReportWrenchEffort,
    SetWrenchEffort,
)
from jaus.messages.torc import Motion, QueryVehicleMode, ReportVehicleMode, SetMotionProfile
from jaus.node import EVERYONE, Node, report_code_of
from jaus.packet import Framing, decode_packet, pack_datagrams, unpack_datagram
from jaus.port import MAX_BROADCAST_DELIVERIES, DatagramRefused, MessageNotSent, MessageReceived, Port
from jaus.service_connection import Client
from tests.jaus.golden import GOLDEN

NM, PD, MPD, VSS = (
    ComponentId.NODE_MANAGER,
    ComponentId.PRIMITIVE_DRIVER,
    ComponentId.MOTION_PROFILE_DRIVER,
    ComponentId.VELOCITY_STATE_SENSOR,
)
REPORTS = {
    NM: {0xE456: None},
    PD: {0x4002: None, 0x400D: None, 0x4405: 0x61, 0x4406: 0x07},
    MPD: {0x4002: None, 0x400D: None},
    VSS: {0x4404: 0x0101},
}
OWN = JausAddress(1, 2, 4, 1)
CLIENT, OTHER = ("127.0.0.1", 40000), ("127.0.0.1", 40001)


def reporter(_component: int, code: int) -> Message:
    """Return reports with more in them than an XGV supports: the node takes away what does not belong."""
    return {
        0xE456: ReportVehicleMode(0, 1, 1, 2, 0, 0x10),
        0x4002: ReportComponentStatus(1),
        0x400D: ReportComponentControl(),
        0x4404: ReportVelocityState(velocity_x_mps=3.0, velocity_y_mps=9.0, time_stamp=7),
        0x4405: ReportWrenchEffort(25.0, resistive_linear_x_percent=10.0),
        0x4406: ReportDiscreteDevices(0x43, 1, 2, 9),
    }[code]


def node(subsystem: int, heartbeat_begin_s: float = 0.0) -> Node:
    components = tuple(ComponentDescription(each, each.name) for each in (NM, PD, MPD, VSS))
    description = NodeDescription(subsystem, f"SIMULATED XGV {subsystem}", components)
    return Node(description, REPORTS, reporter, heartbeat_begin_s=heartbeat_begin_s)


class Wire:
    """A client at one place, and the port that it talks to."""

    def __init__(self, port: Port, transport: Hashable = CLIENT, framing: Framing = Framing.JUDP1) -> None:
        self.port, self.transport, self.framing = port, transport, framing
        self.now_s = 0.0

    def send(self, *messages: Message | bytes) -> None:
        packets = [each if isinstance(each, bytes) else encode(each) for each in messages]
        for datagram in pack_datagrams(self.framing, packets, max_messages=5):
            self.port.receive_datagram(datagram, self.transport, self.now_s)

    def heard(self) -> list[Decoded]:
        """Return what the port sends to this client now, heartbeats aside."""
        found: list[Decoded] = []
        for datagram, destination in self.port.datagrams_to_send(self.now_s):
            if destination == self.transport:
                framing, packets = unpack_datagram(datagram)
                assert framing is self.framing
                found += [decode_packet(framing, packet) for packet in packets]
        return [message for message in found if not isinstance(message, ReportHeartbeatPulse)]

    def asked(self, message: Message) -> list[Decoded]:
        self.send(message)
        return self.heard()

    def events(self) -> list[object]:
        found = []
        while (event := self.port.next_event()) is not None:
            found.append(event)
        return found


@pytest.fixture
def port() -> Port:
    return Port([node(1), node(2)])


@pytest.fixture
def wire(port: Port) -> Wire:
    return Wire(port)


def at(component: int, subsystem: int = 1) -> JausAddress:
    return JausAddress(subsystem, 1, component, 1)


def create(code: int, component: int, rate_hz: float, presence: int) -> CreateServiceConnection:
    return CreateServiceConnection(code, rate_hz, presence).to(at(component), source=OWN)


@pytest.mark.parametrize("framing", [Framing.JUDP1, Framing.OPC])
def test_a_query_is_answered_in_kind_to_where_it_came_from(port: Port, framing: Framing) -> None:
    wire = Wire(port, framing=framing)
    (report,) = wire.asked(QueryVelocityState(0xFFFF).to(at(VSS, 2), source=OWN, sequence=3))
    assert isinstance(report, ReportVelocityState)
    assert (report.header.source, report.header.destination) == (at(VSS, 2), OWN)
    assert report.presence_vector == 0x0101
    assert report.velocity_x_mps == pytest.approx(3.0, abs=1e-6)
    assert not report.header.properties.service_connection


def test_queries_of_torc_are_answered(wire: Wire) -> None:
    (report,) = wire.asked(QueryVehicleMode().to(at(NM), source=OWN))
    assert isinstance(report, ReportVehicleMode)
    assert report.header.properties.experimental


def test_what_a_component_does_not_report_is_the_applications_business(wire: Wire) -> None:
    """XGV-53: a firmware without Report Vehicle Mode simply does not list it."""
    assert wire.asked(QueryWrenchEffort(0x61).to(at(MPD), source=OWN)) == []
    (event,) = wire.events()
    assert isinstance(event, MessageReceived)
    assert isinstance(event.message, QueryWrenchEffort)


def test_commands_go_to_the_application_with_who_sent_them_from_where(wire: Wire) -> None:
    profile = SetMotionProfile(motions=(Motion(5.0, 2.0, 0.1, 0.06, 400),)).to(at(MPD, 2), source=OWN)
    assert wire.asked(profile) == []
    (event,) = wire.events()
    assert isinstance(event, MessageReceived)
    assert event.node.description.subsystem == 2
    assert event.client == Client(OWN, CLIENT)
    assert encode(event.message) == encode(profile)


def test_torcs_eight_service_connections(wire: Wire) -> None:
    """The rates and presence vectors that TORC's client asks for; all first reports come at once."""
    wanted = [
        (0x4404, VSS, 50.0, 0x01, 50),
        (0xE456, NM, 5.0, 0xFF, 5),
        (0x4405, PD, 50.0, 0x61, 50),
        (0x400D, PD, 1.0, 0, 1),
        (0x400D, MPD, 1.0, 0, 1),
        (0x4406, PD, 10.0, 0xFF, 10),
        (0x4002, PD, 5.0, 0, 5),
        (0x4002, MPD, 5.0, 0, 5),
    ]
    for code, component, rate_hz, presence, _ in wanted:
        (confirmed,) = [
            message
            for message in wire.asked(create(code, component, rate_hz, presence))
            if isinstance(message, ConfirmServiceConnection)
        ]
        assert (confirmed.command_code, confirmed.response) == (code, 0)
        assert confirmed.header.properties.service_connection
    reports: list[Decoded] = []
    for step in range(1, 1001):
        wire.now_s = step * 0.01
        reports += wire.heard()
    for code, component, _, presence, per_second in wanted:
        own = [
            message for message in reports if (message.code, message.header.source) == (code, at(component))
        ]
        assert len(own) == pytest.approx(10 * per_second, rel=0.02, abs=1)
        assert all(message.header.properties.service_connection for message in own)
        assert [message.header.sequence for message in own] == list(range(1, len(own) + 1))
        supported = REPORTS[component][code]
        if supported is not None:
            first = own[0]
            assert isinstance(first, Message)
            assert first.presence_vector == presence & supported & {0x4405: 0x41}.get(code, ~0)


def test_everyone_heard_or_named_gets_a_heartbeat_per_second() -> None:
    """A client that waits for one before it speaks is named; XGVs beat before anybody speaks."""
    port = Port([node(1), node(2, 0.5)], peers=[OTHER])
    beats: list[tuple[Hashable, JausAddress, int]] = []
    for step in range(200):
        if step == 100:
            port.receive_datagram(pack_datagrams(Framing.OPC, [encode(pulse())])[0], CLIENT, step * 0.01)
        for datagram, destination in port.datagrams_to_send(step * 0.01):
            framing, (packet,) = unpack_datagram(datagram)
            assert framing is (Framing.JUDP1 if destination == OTHER else Framing.OPC)
            message = decode(packet)
            assert isinstance(message, ReportHeartbeatPulse)
            assert message.header.destination == EVERYONE
            beats.append((destination, message.header.source, message.header.sequence))
    first, second = at(NM, 1), at(NM, 2)
    assert [beat for beat in beats if beat[0] == OTHER] == [
        (OTHER, first, 0),
        (OTHER, second, 0),
        (OTHER, first, 1),
        (OTHER, second, 1),
    ]
    assert [beat for beat in beats if beat[0] == CLIENT] == [(CLIENT, first, 1), (CLIENT, second, 1)]


def pulse() -> ReportHeartbeatPulse:
    return ReportHeartbeatPulse().to(EVERYONE, source=OWN)


def test_a_broadcast_reaches_every_node(wire: Wire) -> None:
    """A node manager identifies the subsystems that it hears."""
    found = wire.asked(QueryIdentification(2).to(JausAddress(255, 255, 1, 1), source=OWN))
    assert all(isinstance(message, ReportIdentification) for message in found)
    assert [message.header.source for message in found] == [at(NM, 1), at(NM, 2)]
    assert found[0].identification == "SIMULATED XGV 1"  # type: ignore[union-attr]


@pytest.mark.parametrize("destination", [at(PD, 3), JausAddress(1, 2, 33, 1), JausAddress(1, 1, 99, 1)])
def test_what_is_for_somebody_else_is_passed_over(wire: Wire, destination: JausAddress) -> None:
    request = Resume().to(destination, source=OWN, acknowledgement=Acknowledgement.REQUESTED)
    assert wire.asked(request) == []
    assert wire.events() == []


@pytest.mark.parametrize("framing", list(Framing))
def test_a_command_is_acknowledged_on_receipt(port: Port, framing: Framing) -> None:
    """Glidepath tries five times, 20 ms apart, until it has the ACK."""
    wire = Wire(port, framing=framing)
    request = RequestComponentControl(6).to(
        at(PD), source=OWN, sequence=8, acknowledgement=Acknowledgement.REQUESTED
    )
    (ack,) = wire.asked(request)
    assert isinstance(ack, Ack)
    assert (ack.code, ack.sequence, ack.positive) == (0x000D, 8, True)
    assert len(wire.events()) == 1


def test_a_command_that_cannot_be_decoded_gets_a_nak(wire: Wire) -> None:
    good = encode(Resume().to(at(PD), source=OWN))
    bad = bytes.fromhex("16020d00012101010104020102000900 0600")
    wire.send(bad, good)
    (nak,) = wire.heard()
    assert isinstance(nak, Ack)
    assert (nak.code, nak.sequence, nak.positive) == (0x000D, 9, False)
    refused, resumed = wire.events()
    assert isinstance(refused, DatagramRefused)
    assert "RequestComponentControl (0x000d)" in refused.reason
    assert isinstance(resumed, MessageReceived)


def test_a_forged_source_cannot_end_the_reports_of_another(port: Port, wire: Wire) -> None:
    wire.asked(create(0x4002, PD, 10.0, 0))
    forger = Wire(port, OTHER)
    forger.send(TerminateServiceConnection(0x4002, 0).to(at(PD), source=OWN))
    wire.now_s = forger.now_s = 0.2
    datagrams = port.datagrams_to_send(0.2)
    reports = [destination for datagram, destination in datagrams if b"\x02\x40" in datagram[:9]]
    assert reports == [CLIENT]


def test_a_large_message_arrives_whole(wire: Wire) -> None:
    large = Event(1, 0x4002, 0, bytes(range(256)) * 30).to(at(PD), source=OWN)
    wire.send(*encode_parts(large))
    (event,) = wire.events()
    assert isinstance(event, MessageReceived)
    assert event.message == large


def test_who_is_silent_for_long_is_forgotten() -> None:
    port = Port([node(1)], peer_timeout_s=10.0, max_peers=1)
    wire = Wire(port)
    wire.asked(create(0x4002, PD, 1.0, 0))
    wire.now_s = 9.0
    assert len(wire.heard()) == 1
    wire.now_s = 10.1
    assert wire.heard() == []
    wire.now_s = 20.0
    assert port.datagrams_to_send(20.0) == []
    assert Wire(port, OTHER).asked(QueryComponentStatus().to(at(PD), source=OWN)) != []


def test_a_named_peer_that_is_silent_keeps_its_heartbeats_only() -> None:
    port = Port([node(1)], peers=[CLIENT], peer_timeout_s=10.0)
    wire = Wire(port)
    wire.asked(create(0x4002, PD, 5.0, 0))
    wire.now_s = 9.9
    assert len(wire.heard()) == 1
    assert port.heard_s(CLIENT) == 0.0
    for step in range(1, 6):
        found = port.datagrams_to_send(10.0 + step)
        messages = [decode(packet) for datagram, _ in found for packet in unpack_datagram(datagram)[1]]
        assert [type(message) for message in messages] == [ReportHeartbeatPulse]
    assert port.heard_s(CLIENT) == -math.inf
    assert port.next_deadline_s() == 16.0
    wire.now_s = 15.0
    (confirmed, report) = wire.asked(create(0x4002, PD, 5.0, 0))
    assert isinstance(confirmed, ConfirmServiceConnection)
    assert report.header.sequence == 0


def test_a_named_peer_does_not_give_way() -> None:
    port = Port([node(1)], peers=[CLIENT], max_peers=1)
    late = Wire(port, OTHER)
    late.now_s = 100.0
    assert late.asked(QueryComponentStatus().to(at(PD), source=OWN)) == []


def test_one_peer_too_many_is_refused_until_another_is_silent() -> None:
    port = Port([node(1)], max_peers=2)
    for number in range(4):
        Wire(port, number).send(Resume().to(at(PD), source=OWN))
    kinds = [type(event).__name__ for event in Wire(port).events()]
    assert kinds == ["MessageReceived"] * 2 + ["DatagramRefused"] * 2
    late = Wire(port, 4)
    late.now_s = 5.1
    assert len(late.asked(QueryComponentStatus().to(at(PD), source=OWN))) == 1


def test_what_is_no_message_makes_nobody_known() -> None:
    port = Port([node(1)], max_peers=1)
    port.receive_datagram(b"nothing", 1, 0.0)
    Wire(port, 2).send(bytes.fromhex("06020d00012101010104020102000900 0600"))
    Wire(port, 3).send(Resume().to(at(PD, 9), source=OWN))
    assert port.datagrams_to_send(0.0) == []
    assert len(Wire(port, 4).asked(QueryComponentStatus().to(at(PD), source=OWN))) == 1


def test_beginnings_of_large_messages_from_anywhere_are_not_kept() -> None:
    port = Port([node(1)], max_peers=3)
    first = encode_parts(Event(1, 0x4002, 0, bytes(9000)).to(at(PD), source=OWN))[0]
    for number in range(100):
        Wire(port, number).send(first)
    assert len(port._reassembly) <= 3


def test_parts_of_large_messages_have_one_bound_for_all_peers_together() -> None:
    """Who keeps the most loses his own; others' messages become whole."""
    port = Port([node(1)], max_peers=100, max_parts_size=60_000)
    own, *parts = encode_parts(Event(1, 0x4002, 0, bytes(9000)).to(at(PD), source=OWN))
    wire = Wire(port)
    wire.send(own)
    large = encode_parts(Event(1, 0x4002, 0, bytes(30_000)).to(at(PD), source=OWN))
    for number in range(50):
        for part in large[:-1]:
            Wire(port, number).send(part)
            assert sum(each.size for each in port._reassembly.values()) == port._parts_size <= 60_000
    wire.send(*parts)
    (whole,) = wire.events()
    assert isinstance(whole, MessageReceived)
    port.datagrams_to_send(100.0)
    assert port._parts_size == 0


def test_events_that_nobody_takes_do_not_pile_up() -> None:
    port = Port([node(1)], max_notices=10)
    for _ in range(100):
        port.receive_datagram(b"nothing", CLIENT, 0.0)
    assert len(Wire(port).events()) == 10
    assert port.notices_dropped == 90


def test_refusals_push_out_no_message_that_was_acknowledged() -> None:
    port = Port([node(1)], max_events=10, max_notices=10)
    wire = Wire(port)
    wire.send(resume(0))
    for number in range(100):
        port.receive_datagram(b"nothing", number, 0.0)
    wire.send(resume(1))
    found = wire.events()
    assert [type(event).__name__ for event in found] == (
        ["MessageReceived"] + ["DatagramRefused"] * 10 + ["MessageReceived"]
    )


def resume(sequence: int) -> Resume:
    return Resume().to(at(PD), source=OWN, sequence=sequence, acknowledgement=Acknowledgement.REQUESTED)


def test_what_there_is_no_room_for_is_not_acknowledged() -> None:
    """Its sender tries again, when the application has taken what waits."""
    port = Port([node(1)], max_events=3)
    wire = Wire(port)
    wire.send(*[resume(number) for number in range(10)])
    assert [ack.sequence for ack in wire.heard() if isinstance(ack, Ack)] == [0, 1, 2]
    kinds = [type(event).__name__ for event in wire.events()]
    assert kinds == ["MessageReceived"] * 3 + ["DatagramRefused"] * 2  # two datagrams of five messages
    assert len(wire.asked(resume(3))) == 1


def test_a_datagram_holds_so_many_messages_and_no_more(port: Port, wire: Wire) -> None:
    packets = [encode(resume(number)) for number in range(100)]
    (datagram,) = pack_datagrams(Framing.JUDP1, packets, max_messages=100, max_size=65_000)
    port.receive_datagram(datagram, CLIENT, 0.0)
    assert len(wire.heard()) == 64
    *_, refused = found = wire.events()
    assert len(found) == 65
    assert refused == DatagramRefused(CLIENT, "JUDP1 datagram: more than 64 messages")


def test_good_messages_before_a_bad_one_are_taken(port: Port, wire: Wire) -> None:
    (datagram,) = pack_datagrams(
        Framing.JUDP1, [encode(resume(number)) for number in range(3)], max_messages=3
    )
    port.receive_datagram(datagram[:-1], CLIENT, 0.0)
    assert [ack.sequence for ack in wire.heard() if isinstance(ack, Ack)] == [0, 1]
    assert [type(event).__name__ for event in wire.events()] == ["MessageReceived"] * 2 + ["DatagramRefused"]


def test_what_waits_for_one_peer_is_bounded() -> None:
    port = Port([node(1)], max_waiting=100)
    wire = Wire(port)
    query = encode(QueryComponentStatus().to(at(PD), source=OWN))
    (datagram,) = pack_datagrams(Framing.JUDP1, [query] * 60, max_messages=60, max_size=65_000)
    for _ in range(2):
        port.receive_datagram(datagram, CLIENT, 0.0)
    Wire(port, OTHER).send(query)
    sent = [destination for _, destination in port.datagrams_to_send(0.0)]
    assert (sent.count(CLIENT), sent.count(OTHER)) == (100, 2)  # for the other with a heartbeat
    assert port.messages_not_sent == 20 + 1
    assert wire.events()[-1] == MessageNotSent(CLIENT, "100 datagrams wait for it already")
    wire.now_s = 0.1
    assert len(wire.asked(QueryComponentStatus().to(at(PD), source=OWN))) == 1


@pytest.mark.parametrize(
    "destination", [JausAddress(255, 255, 1, 1), JausAddress(1, 1, 255, 1), JausAddress(1, 1, 1, 255)]
)
def test_a_service_connection_is_asked_for_of_one(wire: Wire, destination: JausAddress) -> None:
    """One short message to all would start reports of every vehicle."""
    assert wire.asked(CreateServiceConnection(0xE456, 50.0, 0).to(destination, source=OWN)) == []
    (event,) = wire.events()
    assert isinstance(event, DatagramRefused)
    assert "more than one component" in event.reason


@pytest.mark.parametrize(
    "source",
    [
        *(JausAddress(0, 2, 4, 1), JausAddress(1, 0, 4, 1), JausAddress(1, 2, 0, 1), JausAddress(1, 2, 4, 0)),
        *(JausAddress(255, 2, 4, 1), JausAddress(1, 255, 4, 1), JausAddress(1, 2, 255, 1)),
        *(JausAddress(1, 2, 4, 255), JausAddress(1, 1, 10, 1), JausAddress(2, 1, 99, 7)),
    ],
)
def test_nobody_can_speak_as_a_broadcast_or_as_a_node_of_this_port(wire: Wire, source: JausAddress) -> None:
    for message in (
        Resume().to(at(PD), source=source, acknowledgement=Acknowledgement.REQUESTED),
        CreateServiceConnection(0x4002, 50.0, 0).to(at(PD), source=source),
    ):
        assert wire.asked(message) == []
        (event,) = wire.events()
        assert event == DatagramRefused(CLIENT, f"nobody can send from address {source}")
    assert wire.port.heard_s(CLIENT) == -math.inf


def test_a_gap_in_a_large_message_is_told(wire: Wire) -> None:
    first, _, last = encode_parts(Event(1, 0x4002, 0, bytes(9000)).to(at(PD), source=OWN))
    wire.send(first, last)
    (event,) = wire.events()
    assert isinstance(event, DatagramRefused)
    assert event.reason.startswith("large message 0x41f1: part 2 ")


def test_two_nodes_cannot_have_one_address(port: Port) -> None:
    with pytest.raises(LocalProtocolError, match=r"node 2\.1 is there already"):
        port.add(node(2))


def test_a_node_that_is_not_here_cannot_leave(port: Port) -> None:
    for stranger in (node(3), node(2)):
        with pytest.raises(LocalProtocolError, match=r"node [23]\.1 is not here"):
            port.remove(stranger)


def test_nodes_come_and_go(port: Port, wire: Wire) -> None:
    """A vehicle that leaves the simulation tells its clients."""
    port.add(third := node(3))
    status = QueryComponentStatus().to(at(PD, 3), source=OWN)
    assert len(wire.asked(status)) == 1
    wire.asked(CreateServiceConnection(0x4002, 1.0, 0).to(at(PD, 3), source=OWN))
    port.remove(third)
    (ended,) = wire.asked(status)
    assert isinstance(ended, TerminateServiceConnection)
    assert (ended.command_code, ended.header.source) == (0x4002, at(PD, 3))


def test_what_has_no_form_in_sae_jaus_is_told(port: Port) -> None:
    wire = Wire(port, framing=Framing.AS5669A)
    assert wire.asked(QueryWrenchEffort(0x61).to(at(PD), source=OWN)) == []
    (event,) = wire.events()
    assert isinstance(event, MessageNotSent)
    assert "0x4405: its body in SAE JAUS is another one" in event.reason


def test_an_sae_effort_is_never_taken_for_one_of_ra(port: Port) -> None:
    wire = Wire(port)
    datagram = bytes.fromhex("02 00 1400 01 21010100 04020100 0504 0100 ff7f 0100")
    port.receive_datagram(datagram, CLIENT, 0.0)
    (event,) = wire.events()
    assert isinstance(event, MessageReceived)
    assert isinstance(event.message, UnknownMessage)


def test_deadlines_are_those_of_reports_and_heartbeats(port: Port, wire: Wire) -> None:
    assert Port([]).next_deadline_s() is None
    wire.heard()
    assert port.next_deadline_s() == 1.0
    wire.send(create(0x4002, PD, 10.0, 0))
    assert port.next_deadline_s() == -math.inf  # the confirmation waits
    wire.heard()
    assert port.next_deadline_s() == pytest.approx(0.1, abs=1e-3)


def test_a_port_without_nodes_has_something_to_send_still(port: Port, wire: Wire) -> None:
    wire.asked(create(0x4002, PD, 10.0, 0))
    for each in list(port._nodes.values()):
        port.remove(each)
    assert port.next_deadline_s() == -math.inf
    assert len(wire.heard()) == 1
    assert port.next_deadline_s() is None


def test_reports_of_a_component_that_is_not_there_are_a_mistake() -> None:
    description = NodeDescription(1, "SIMULATED", (ComponentDescription(1, "Node Manager"),))
    with pytest.raises(LocalProtocolError, match=r"reports of components \[33\], expected \[1\]"):
        Node(description, {33: {}}, reporter)


def test_a_node_has_one_instance_of_each_component() -> None:
    twice = (ComponentDescription(33, "PD"), ComponentDescription(33, "PD", instance=2))
    with pytest.raises(LocalProtocolError, match=r"components \[33, 33\], expected one instance of each"):
        Node(NodeDescription(1, "SIMULATED", twice), {}, reporter)


@pytest.mark.parametrize(
    ("query", "report"), [(0x2404, 0x4404), (0xE256, 0xE456), (0x0405, None), (0xE328, None), (0x4404, None)]
)
def test_reports_lie_behind_their_queries(query: int, report: int | None) -> None:
    assert report_code_of(query) == report


def test_ten_thousand_mutated_datagrams(port: Port, wire: Wire) -> None:
    """Nothing but events comes of them, and what is kept stays within its limits."""
    dice = random.Random(5)
    datagrams = [
        pack_datagrams(framing, [golden.data])[0]
        for golden in GOLDEN
        for framing in (Framing.JUDP1, Framing.OPC)
    ]
    most_sent = 0
    for step in range(10_000):
        data = bytearray(dice.choice(datagrams))
        for _ in range(dice.randrange(4)):
            data[dice.randrange(len(data))] = dice.randrange(256)
        if dice.random() < 0.2:
            data = data[: dice.randrange(len(data))]
        port.receive_datagram(bytes(data), ("127.0.0.1", dice.randrange(100)), step * 0.01)
        if step % 50 == 0:
            assert_bounded(port)
            most_sent = max(most_sent, len(port.datagrams_to_send(step * 0.01)))
            assert len(wire.events()) <= 100
    assert 0 < most_sent < 50 * (64 + 10)
    wire.now_s = 110.0
    assert len(wire.asked(QueryComponentStatus().to(at(PD), source=OWN))) >= 1


def assert_bounded(port: Port) -> None:
    """See that a port with its usual limits keeps no more than they allow."""
    assert len(port._peers) <= 64
    assert all(len(peer.clients) <= 512 for peer in port._peers.values())
    assert port._reassembly.keys() <= port._peers.keys()
    assert all(len(each) <= 4 and each.size <= 4 << 18 for each in port._reassembly.values())
    assert sum(each.size for each in port._reassembly.values()) == port._parts_size <= 1 << 22
    assert sum(port._waiting.values()) == len(port._outgoing)
    assert all(number <= 4096 for number in port._waiting.values())
    assert len(port._events) <= 10_000 + 1_000 + len(port._nodes)
    for node_ in port._nodes.values():
        for connections in node_._connections.values():
            clients = Counter(each.client for each in connections)
            places = Counter(client.transport for client in clients)
            assert len(clients) <= 64
            assert all(number <= 4 for number in places.values())
            assert all(number <= 16 for number in clients.values())
            assert places.keys() <= port._peers.keys()


def test_the_application_sends_by_itself(port: Port, wire: Wire) -> None:
    wire.framing = Framing.OPC
    wire.asked(Resume().to(at(PD), source=OWN))
    port.send(SetWrenchEffort(10.0).to(OWN, source=at(PD)), Client(OWN, CLIENT))
    (message,) = wire.heard()
    assert isinstance(message, SetWrenchEffort)


def asked_of_everybody(wire: Wire, number: int, now_s: float) -> tuple[int, set[str]]:
    """Return how many answers queries to everybody draw in one datagram, and why some are refused."""
    everybody = JausAddress(255, 255, 1, 1)
    packets = [encode(QueryIdentification(2).to(everybody, source=OWN)) for _ in range(number)]
    (datagram,) = pack_datagrams(Framing.JUDP1, packets, max_messages=number)
    wire.port.receive_datagram(datagram, wire.transport, now_s)
    wire.now_s = now_s
    refused = {event.reason for event in wire.events() if isinstance(event, DatagramRefused)}
    return sum(isinstance(message, ReportIdentification) for message in wire.heard()), refused


def test_few_messages_that_everybody_answers_are_taken_of_one_peer(port: Port, wire: Wire) -> None:
    """Not so many in each datagram, but in a second: all nodes answer, to wherever it seems to come from."""
    refusal = "more than 4 queries to more than one component in a second"
    assert asked_of_everybody(wire, 10, 0.0) == (4 * 2, {refusal})
    for late_s in (0.0, 0.3, 0.99):
        assert asked_of_everybody(wire, 1, late_s) == (0, {refusal})
    assert asked_of_everybody(Wire(port, OTHER), 1, 0.99) == (2, set())
    assert asked_of_everybody(wire, 4, 1.0) == (4 * 2, set())
    wire.send(QueryComponentStatus().to(at(PD), source=OWN))
    assert len(wire.heard()) == 1


def test_all_peers_together_too_ask_only_so_much_of_everybody() -> None:
    """A source is easily invented."""
    port = Port([node(1), node(2)])
    answers = [asked_of_everybody(Wire(port, number), 2, 0.5) for number in range(60)]
    assert sum(number for number, _ in answers) == 64 * 2
    refusal = "more than 64 queries of all peers to more than one component in a second"
    assert answers[-1] == (0, {refusal})
    pulse = ReportHeartbeatPulse().to(EVERYONE, source=OWN)  # which is not answered
    late = Wire(port, 59)
    late.now_s = 0.5
    late.send(pulse)
    assert [type(event) for event in late.events()] == [MessageReceived]
    assert asked_of_everybody(Wire(port, 59), 2, 1.5) == (2 * 2, set())


def test_a_place_may_say_that_many_live(wire: Wire) -> None:
    """254 cars behind one port, each with a heartbeat to everybody, and a client who listens."""
    for number in range(1, 255):
        wire.send(ReportHeartbeatPulse().to(EVERYONE, source=JausAddress(number, 7, 1, 1)))
    heard = wire.events()
    assert [type(event) for event in heard] == [MessageReceived] * 254  # by one node for all
    assert len({event.client.address for event in heard if isinstance(event, MessageReceived)}) == 254


def test_what_is_not_answered_has_a_limit_too(wire: Wire) -> None:
    each = MAX_BROADCAST_DELIVERIES // 2
    for _ in range(each + 5):
        wire.send(ReportComponentStatus(1).to(EVERYONE, source=OWN))
    events = wire.events()
    assert sum(isinstance(event, MessageReceived) for event in events) == 2 * each
    refused = [event.reason for event in events if isinstance(event, DatagramRefused)]
    assert refused == [f"more than {each} messages to more than one component in a second"] * 5


def test_requests_for_events_of_everybody_are_answered_by_all_and_count(wire: Wire) -> None:
    for _ in range(6):
        wire.send(CancelEvent(1).to(EVERYONE, source=OWN))
    assert len(wire.heard()) == 4 * 2
    assert len([event for event in wire.events() if isinstance(event, DatagramRefused)]) == 2


def test_what_there_is_no_room_for_is_not_even_encoded(monkeypatch: pytest.MonkeyPatch) -> None:
    port = Port([node(1)], max_waiting=10)
    wire = Wire(port)
    encoded = []

    def counted(message: Message) -> list[bytes]:
        encoded.append(message)
        return encode_parts(message)

    monkeypatch.setattr("jaus.port.encode_parts", counted)
    wire.send(*[QueryComponentStatus().to(at(PD), source=OWN) for _ in range(30)])
    assert len(encoded) == 10
    assert port.messages_not_sent == 20
    assert len(wire.heard()) == 10


def test_what_a_component_has_never_heard_of_it_does_not_even_refuse_xgv_53() -> None:
    """XGV-53: old firmware, and Report Vehicle Mode."""
    made = node(1)
    old = Node(made.description, REPORTS, reporter, ignores={NM: {0xE457}})
    client = Client(OWN, CLIENT)
    for code, expected in ((0xE457, []), (0xE458, [2])):
        asked = CreateServiceConnection(code, 5.0, 0).to(at(NM), source=OWN)
        answers = old.receive(asked, client, 0.0) or []
        assert [a.response for a in answers if isinstance(a, ConfirmServiceConnection)] == expected
