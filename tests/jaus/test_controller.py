"""A controller and vehicles, over a fake wire that can lose datagrams, in steps of 10 ms."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from jaus.address import JausAddress
from jaus.codec import decode, encode
from jaus.controller import Acknowledged, Controller, NotAcknowledged, SubscriptionRefused
from jaus.header import UNADDRESSED, Header
from jaus.messages import Ack, Message
from jaus.messages.core import (
    ConfirmServiceConnection,
    CreateServiceConnection,
    QueryComponentControl,
    ReportComponentStatus,
    ReportHeartbeatPulse,
    Resume,
    TerminateServiceConnection,
)
from jaus.messages.discovery import QueryIdentification, ReportIdentification
from jaus.messages.platform import ReportGlobalPose, ReportVelocityState
from jaus.messages.torc import Motion, SetMotionProfile
from jaus.node import EVERYONE
from jaus.packet import Framing, pack_datagrams, unpack_datagram
from jaus.port import DatagramRefused, MessageNotSent, MessageReceived, Port
from tests.jaus.test_port import MPD, PD, VSS, at, node

CAR, OWN = ("127.0.0.1", 3794), ("127.0.0.1", 40000)
ADDRESS = JausAddress(1, 2, 4, 1)


def profile(speed_mps: float = 5.0) -> SetMotionProfile:
    return SetMotionProfile(motions=(Motion(speed_mps, 2.0, 0.1, 0.06, 200),))


class Pair:
    """A controller and a port with two vehicles; ``loses`` says which datagrams do not arrive."""

    def __init__(self) -> None:
        self.controller = Controller(ADDRESS, CAR)
        self.port = Port([node(1), node(2)])
        self.now_s = 0.0
        self.loses: Callable[[Message | Ack], bool] = lambda _message: False
        self.to_car: list[object] = []
        self.to_controller: list[object] = []

    def exchange(self) -> None:
        for datagram, _ in self.controller.datagrams_to_send(self.now_s):
            if self._arrives(datagram, self.to_car):
                self.port.receive_datagram(datagram, OWN, self.now_s)
        for datagram, _ in self.port.datagrams_to_send(self.now_s):
            if self._arrives(datagram, self.to_controller):
                self.controller.receive_datagram(datagram, CAR, self.now_s)

    def _arrives(self, datagram: bytes, log: list[object]) -> bool:
        message = decode(unpack_datagram(datagram)[1][0])
        log.append(message)
        return not self.loses(message)  # type: ignore[arg-type]

    def run(self, seconds: float) -> list[object]:
        """Let time pass; return the controller's events, heartbeats aside."""
        events: list[object] = []
        for _ in range(round(seconds * 100)):
            self.exchange()
            self.now_s += 0.01
            while (event := self.controller.next_event()) is not None:
                if not isinstance(getattr(event, "message", None), ReportHeartbeatPulse):
                    events.append(event)
        return events

    def sent(self, kind: type[Message]) -> int:
        return sum(isinstance(message, kind) for message in self.to_car)


@pytest.fixture
def pair() -> Pair:
    return Pair()


def test_a_command_is_sent_once_and_acknowledged(pair: Pair) -> None:
    command = pair.controller.command(profile(), at(MPD), pair.now_s, acknowledged=True)
    assert pair.run(1.0) == [Acknowledged(command, positive=True)]
    assert pair.sent(SetMotionProfile) == 1


def test_a_command_stays_the_callers(pair: Pair) -> None:
    """It can be used again for another car at once, and changed while the first is repeated."""
    pair.loses = lambda message: isinstance(message, Ack)
    command = profile(5.0)
    for subsystem in (1, 2):
        pair.controller.command(command, at(MPD, subsystem), pair.now_s, acknowledged=True)
    assert command.header == UNADDRESSED
    command.motions[0].speed_mps = 1.0
    pair.run(0.2)
    sent = [message for message in pair.to_car if isinstance(message, SetMotionProfile)]
    assert [message.header.destination for message in sent] == [at(MPD, 1), at(MPD, 2)] * 5
    assert {round(message.motions[0].speed_mps) for message in sent} == {5}


def test_a_command_without_acknowledgement_is_sent_once(pair: Pair) -> None:
    pair.controller.command(Resume(), at(PD), pair.now_s)
    assert pair.run(1.0) == []
    assert pair.sent(Resume) == 1


def test_a_command_is_repeated_until_it_is_acknowledged(pair: Pair) -> None:
    lost = iter([True, True, False])
    pair.loses = lambda message: isinstance(message, Ack) and next(lost)
    command = pair.controller.command(profile(), at(MPD), pair.now_s, acknowledged=True)
    assert pair.run(1.0) == [Acknowledged(command, positive=True)]
    assert pair.sent(SetMotionProfile) == 3
    sequences = {message.header.sequence for message in pair.to_car if isinstance(message, SetMotionProfile)}
    assert sequences == {0}


def test_after_five_attempts_it_gives_up(pair: Pair) -> None:
    pair.loses = lambda message: isinstance(message, SetMotionProfile)
    command = pair.controller.command(profile(), at(MPD), pair.now_s, acknowledged=True)
    assert pair.run(0.09) == []
    assert pair.run(1.0) == [NotAcknowledged(command)]
    assert pair.sent(SetMotionProfile) == 5


def test_a_newer_command_takes_the_place_of_an_older(pair: Pair) -> None:
    """An old motion must not be repeated after a new one."""
    pair.loses = lambda message: isinstance(message, Ack)
    older = pair.controller.command(profile(5.0), at(MPD), pair.now_s, acknowledged=True)
    pair.run(0.03)
    newer = pair.controller.command(profile(0.0), at(MPD), pair.now_s, acknowledged=True)
    assert pair.run(1.0) == [NotAcknowledged(older), NotAcknowledged(newer)]
    sequences = [message.header.sequence for message in pair.to_car if isinstance(message, SetMotionProfile)]
    assert sequences == sorted(sequences)


def test_a_late_acknowledgement_of_an_older_command_counts_for_that_one(pair: Pair) -> None:
    older = pair.controller.command(profile(5.0), at(MPD), pair.now_s, acknowledged=True)
    newer = pair.controller.command(profile(1.0), at(MPD), pair.now_s, acknowledged=True)
    pair.loses = lambda message: isinstance(message, Ack) and message.sequence == 1
    assert pair.run(1.0) == [Acknowledged(older, positive=True), NotAcknowledged(newer)]


@pytest.mark.parametrize("is_heard", [True, False])
def test_a_command_renewed_faster_than_its_time_out_ends_too(pair: Pair, is_heard: bool) -> None:
    """A motion every 10 ms, acknowledgements 30 ms old or none at all; repeats are needed of none."""
    late: list[bytes] = []
    pair.loses = lambda message: isinstance(message, Ack) and (late.append(encode(message)) or True)
    sent, events = [], []
    for _ in range(100):
        sent.append(pair.controller.command(profile(), at(MPD), pair.now_s, acknowledged=True))
        events += pair.run(0.01)
        if is_heard and len(late) > 3:
            pair.controller.receive_datagram(pack_datagrams(Framing.JUDP1, [late.pop(0)])[0], CAR, pair.now_s)
    assert pair.sent(SetMotionProfile) == 100
    expected = [Acknowledged(each, True) if is_heard else NotAcknowledged(each) for each in sent]
    assert len(events) >= 85
    assert events == expected[: len(events)]
    assert len(pair.controller._pending) <= 15
    pair.run(1.0)
    assert not pair.controller._pending
    assert not pair.controller._newest


def test_a_command_whose_number_is_given_anew_has_ended() -> None:
    """Sequence numbers begin anew after 65535; who waits still has waited long enough."""
    controller = Controller(ADDRESS, CAR, acknowledgement_timeout_s=1e9)
    first = controller.command(profile(), at(MPD), 0.0, acknowledged=True)
    controller._sequence = 0
    controller.command(profile(), at(MPD), 0.0, acknowledged=True)
    assert controller.next_event() == NotAcknowledged(first)


def test_an_acknowledgement_of_another_component_counts_for_nothing(pair: Pair) -> None:
    pair.controller.command(profile(), at(MPD), pair.now_s, acknowledged=True)
    wrong = [Ack(0xE328, 0, header=Header(ADDRESS, at(PD))), Ack(0x0004, 0, header=Header(ADDRESS, at(MPD)))]
    for ack in wrong:
        pair.controller.receive_datagram(pack_datagrams(Framing.JUDP1, [encode(ack)])[0], CAR, 0.0)
    assert pair.controller.next_event() is None


def test_a_subscription_brings_reports_at_its_rate(pair: Pair) -> None:
    pair.controller.subscribe(ReportVelocityState, at(VSS, 2), 50.0, pair.now_s, presence_vector=1)
    reports = [event.message for event in pair.run(2.0) if isinstance(event, MessageReceived)]
    assert len(reports) == pytest.approx(100, abs=2)
    assert all(isinstance(report, ReportVelocityState) for report in reports)
    assert {report.header.source for report in reports} == {at(VSS, 2)}
    assert pair.sent(CreateServiceConnection) == 1


@pytest.mark.parametrize("lost", [CreateServiceConnection, ConfirmServiceConnection])
def test_a_subscription_that_got_lost_is_asked_for_again(pair: Pair, lost: type[Message]) -> None:
    first = iter([True])
    pair.loses = lambda message: isinstance(message, lost) and next(first, False)
    pair.controller.subscribe(ReportComponentStatus, at(PD), 5.0, pair.now_s)
    assert len(pair.run(5.0)) >= 9


def test_a_car_that_comes_back_is_asked_again(pair: Pair) -> None:
    pair.controller.subscribe(ReportComponentStatus, at(PD), 10.0, pair.now_s)
    assert len(pair.run(1.0)) == 10
    pair.port = Port([node(1)])
    assert pair.run(2.8) == []
    assert len(pair.run(1.2)) >= 9


def test_what_a_component_does_not_report_is_told(pair: Pair) -> None:
    pair.controller.subscribe(ReportGlobalPose, at(VSS), 5.0, pair.now_s)
    assert pair.run(4.0) == [SubscriptionRefused(at(VSS), ReportGlobalPose, 2)]
    assert pair.sent(CreateServiceConnection) == 1


def test_a_subscription_ends(pair: Pair) -> None:
    pair.controller.subscribe(ReportComponentStatus, at(PD), 10.0, pair.now_s)
    assert len(pair.run(0.5)) == 5
    pair.controller.unsubscribe(ReportComponentStatus, at(PD))
    pair.controller.unsubscribe(ReportComponentStatus, at(MPD))
    assert pair.run(1.0) == []
    assert pair.sent(TerminateServiceConnection) == 1


def test_another_presence_vector_ends_the_connection_before(pair: Pair) -> None:
    pair.controller.subscribe(ReportVelocityState, at(VSS), 10.0, pair.now_s, presence_vector=1)
    pair.run(0.5)
    pair.controller.subscribe(ReportVelocityState, at(VSS), 20.0, pair.now_s, presence_vector=1)
    pair.run(0.5)
    assert pair.sent(TerminateServiceConnection) == 0
    pair.controller.subscribe(ReportVelocityState, at(VSS), 10.0, pair.now_s, presence_vector=0x100)
    reports = [event.message for event in pair.run(1.0) if isinstance(event, MessageReceived)]
    assert {report.presence_vector for report in reports if isinstance(report, Message)} == {0x100}
    assert len(reports) == pytest.approx(10, abs=1)
    assert pair.sent(TerminateServiceConnection) == 1


def test_a_change_of_mind_before_the_confirmation_leaves_one_connection(pair: Pair) -> None:
    for presence_vector in (1, 0x100):
        pair.controller.subscribe(
            ReportVelocityState, at(VSS), 10.0, pair.now_s, presence_vector=presence_vector
        )
    pair.run(0.1)
    reports = [event.message for event in pair.run(1.0) if isinstance(event, MessageReceived)]
    assert {report.presence_vector for report in reports if isinstance(report, Message)} == {0x100}
    assert pair.sent(TerminateServiceConnection) == 1


def test_a_connection_that_nobody_asked_for_is_ended(pair: Pair) -> None:
    confirmed = ConfirmServiceConnection(0x4404, 3, 5.0).to(ADDRESS, source=at(VSS))
    pair.controller.receive_datagram(pack_datagrams(Framing.JUDP1, [encode(confirmed)])[0], CAR, 0.0)
    pair.run(0.01)
    (ended,) = (message for message in pair.to_car if isinstance(message, TerminateServiceConnection))
    assert (ended.command_code, ended.instance_id, ended.header.destination) == (0x4404, 3, at(VSS))


def test_answers_arrive_as_messages(pair: Pair) -> None:
    pair.controller.command(QueryComponentControl(), at(PD), pair.now_s)
    (event,) = pair.run(0.1)
    assert isinstance(event, MessageReceived)
    assert event.message.header.source == at(PD)


def test_it_can_be_found(pair: Pair) -> None:
    """A vehicle's node manager forgets controllers that send no heartbeat and say not who they are."""
    pair.run(2.5)
    assert pair.sent(ReportHeartbeatPulse) == 3
    query = QueryIdentification(4).to(ADDRESS, source=at(1))
    pair.controller.receive_datagram(pack_datagrams(Framing.JUDP1, [encode(query)])[0], CAR, 2.5)
    pair.run(0.01)
    (identification,) = (message for message in pair.to_car if isinstance(message, ReportIdentification))
    assert (identification.identification, identification.identification_type) == ("controller", 60001)


def test_strangers_are_not_listened_to(pair: Pair) -> None:
    pulse = ReportHeartbeatPulse().to(EVERYONE, source=at(1))
    datagram = pack_datagrams(Framing.JUDP1, [encode(pulse)])[0]
    pair.controller.receive_datagram(datagram, ("127.0.0.1", 666), 0.0)
    assert isinstance(pair.controller.next_event(), DatagramRefused)


def test_refusals_push_out_no_events() -> None:
    controller = Controller(ADDRESS, CAR, max_events=3, max_notices=5)
    datagrams = [
        pack_datagrams(Framing.JUDP1, [encode(ReportComponentStatus(number).to(ADDRESS, source=at(PD)))])[0]
        for number in range(5)
    ]
    for datagram in datagrams:
        controller.receive_datagram(datagram, CAR, 0.0)
    for _ in range(100):
        controller.receive_datagram(b"nothing", ("127.0.0.1", 666), 0.0)
    events = []
    while (event := controller.next_event()) is not None:
        events.append(event)
    kinds = [type(event) for event in events]
    assert kinds == [MessageReceived] * 3 + [DatagramRefused] * 5
    controller.receive_datagram(datagrams[4], CAR, 0.0)
    assert isinstance(controller.next_event(), MessageReceived)


def test_what_cannot_be_sent_is_told_at_once() -> None:
    controller = Controller(ADDRESS, CAR)
    controller.command(SetMotionProfile(version=300), at(MPD), 0.0)
    controller.datagrams_to_send(0.0)
    event = controller.next_event()
    assert isinstance(event, MessageNotSent)
    assert "SetMotionProfile.version: got 300" in event.reason


def test_deadlines_are_those_of_what_is_waited_for(pair: Pair) -> None:
    pair.run(0.01)
    assert pair.controller.next_deadline_s() == 1.0
    pair.controller.subscribe(ReportComponentStatus, at(PD), 10.0, 0.01)
    assert pair.controller.next_deadline_s() == -math.inf
    pair.controller.datagrams_to_send(0.01)
    assert pair.controller.next_deadline_s() == 1.0
    pair.controller.command(Resume(), at(PD), 0.5, acknowledged=True)
    assert pair.controller.next_deadline_s() == -math.inf
    pair.controller.datagrams_to_send(0.5)
    assert pair.controller.next_deadline_s() == pytest.approx(0.52)
