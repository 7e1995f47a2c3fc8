"""Service connections as jaus-wire's section 5.3 has them, in steps of time that the test chooses."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from jaus.address import JausAddress
from jaus.messages.core import (
    ActivateServiceConnection,
    ConfirmServiceConnection,
    CreateServiceConnection,
    ServiceConnectionResponse,
    SuspendServiceConnection,
    TerminateServiceConnection,
)
from jaus.service_connection import Client, ReportDue, ServiceConnections

VELOCITY, STATUS, MODE = 0x4404, 0x4002, 0xE456
REPORTS = {VELOCITY: 0x0101, STATUS: None, MODE: None}
CLIENT = Client(JausAddress(1, 2, 4, 1), ("127.0.0.1", 40000))
OTHER = Client(JausAddress(1, 3, 4, 1), ("127.0.0.1", 40001))


def create(code: int = VELOCITY, rate_hz: float = 10.0, presence: int = 1) -> CreateServiceConnection:
    return CreateServiceConnection(code, rate_hz, presence)


def sequences(connections: ServiceConnections, until_s: float, step_s: float = 0.01) -> list[int]:
    """Return the sequence numbers of all reports while time passes."""
    steps = range(round(until_s / step_s) + 1)
    return [report.sequence for step in steps for report in connections.due(step * step_s)]


def test_a_request_is_confirmed_and_the_first_report_is_due_at_once() -> None:
    connections = ServiceConnections(REPORTS)
    assert connections.next_deadline_s() is None
    assert connections.receive(create(presence=0xFFFF), CLIENT, 5.0) == ConfirmServiceConnection(
        VELOCITY, 0, 10.0, ServiceConnectionResponse.SUCCESSFUL
    )
    assert connections.next_deadline_s() == 5.0
    assert connections.due(5.0) == [ReportDue(CLIENT, VELOCITY, 0x0101, 0)]
    assert connections.due(5.0) == []
    assert connections.next_deadline_s() == pytest.approx(5.1)


def test_a_report_has_the_bits_that_are_requested_and_supported() -> None:
    connections = ServiceConnections(REPORTS)
    for presence in (0x0001, 0x0103, 0xFFFF, 0x0000):
        connections.receive(create(presence=presence), CLIENT, 0.0)
    assert [report.presence_vector for report in connections.due(0.0)] == [0x0001, 0x0101, 0x0101, 0x0000]


@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 10.0, 20.0, 49.99, 50.0])
def test_rates_hold_with_a_communication_period_of_ten_milliseconds(rate_hz: float) -> None:
    """Within 2 % over ten seconds, though none of the steps need fall onto a due time."""
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=rate_hz), CLIENT, 0.0)
    found = sequences(connections, 10.0)
    assert found == list(range(len(found)))
    assert len(found) - 1 == pytest.approx(10.0 * rate_hz, rel=0.02)


def test_reports_missed_are_left_out_and_the_beat_is_kept() -> None:
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=10.0), CLIENT, 0.0)
    assert [report.sequence for report in connections.due(0.0)] == [0]
    assert [report.sequence for report in connections.due(0.77)] == [1]
    assert connections.next_deadline_s() == pytest.approx(0.8)


def test_who_asks_again_keeps_the_connection_at_the_new_rate() -> None:
    """Clients repeat their requests: the same number, the sequence anew, and no more reports than before."""
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=10.0), CLIENT, 0.0)
    assert [report.sequence for report in connections.due(0.0)] == [0]
    assert [report.sequence for report in connections.due(0.1)] == [1]
    again = connections.receive(create(rate_hz=20.0), CLIENT, 0.11)
    assert again == ConfirmServiceConnection(VELOCITY, 0, 20.0)
    assert connections.due(0.11) == []
    assert connections.next_deadline_s() == pytest.approx(0.16)
    assert [report.sequence for report in connections.due(0.16)] == [0]
    assert len(list(connections)) == 1


def test_repeats_at_every_step_do_not_speed_the_reports_up() -> None:
    connections = ServiceConnections(REPORTS)
    sent = 0
    for step in range(101):
        connections.receive(create(rate_hz=10.0), CLIENT, step * 0.01)
        sent += len(connections.due(step * 0.01))
    assert sent == 11


def test_another_presence_vector_is_another_connection() -> None:
    connections = ServiceConnections(REPORTS)
    answers = [connections.receive(create(presence=presence), CLIENT, 0.0) for presence in (1, 0x101, 1)]
    assert [answer.instance_id for answer in answers if answer] == [0, 1, 0]


def test_the_presence_vector_of_a_report_without_one_says_nothing() -> None:
    """TORC asks with 0xFF, others with 0."""
    connections = ServiceConnections(REPORTS)
    answers = [connections.receive(create(MODE, presence=presence), CLIENT, 0.0) for presence in (0xFF, 0)]
    assert [answer.instance_id for answer in answers if answer] == [0, 0]
    assert connections.due(0.0) == [ReportDue(CLIENT, MODE, 0, 0)]


def test_numbers_are_counted_per_client_and_report_and_given_anew() -> None:
    connections = ServiceConnections(REPORTS)
    for client in (CLIENT, OTHER):
        for code in (VELOCITY, STATUS):
            answer = connections.receive(create(code), client, 0.0)
            assert answer is not None
            assert answer.instance_id == 0
    connections.receive(create(presence=0x101), CLIENT, 0.0)
    connections.receive(TerminateServiceConnection(VELOCITY, 0), CLIENT, 0.0)
    answer = connections.receive(create(presence=3), CLIENT, 0.0)
    assert answer is not None
    assert answer.instance_id == 0


def test_suspend_keeps_activate_goes_on_terminate_ends() -> None:
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=10.0), CLIENT, 0.0)
    assert [report.sequence for report in connections.due(0.0)] == [0]
    assert connections.receive(SuspendServiceConnection(VELOCITY, 0), CLIENT, 0.05) is None
    assert connections.due(1.0) == []
    assert connections.next_deadline_s() is None
    connections.receive(ActivateServiceConnection(VELOCITY, 0), CLIENT, 2.0)
    assert [report.sequence for report in connections.due(2.0)] == [1]
    connections.receive(ActivateServiceConnection(VELOCITY, 0), CLIENT, 2.01)
    assert connections.due(2.01) == []
    connections.receive(TerminateServiceConnection(VELOCITY, 0), CLIENT, 2.02)
    assert connections.due(9.0) == []
    assert list(connections) == []


def test_a_stranger_cannot_touch_the_connection_of_another() -> None:
    """A client is its address and where its datagrams come from."""
    connections = ServiceConnections(REPORTS)
    connections.receive(create(), CLIENT, 0.0)
    forged = Client(CLIENT.address, ("127.0.0.1", 50000))
    for client in (OTHER, forged):
        for kind in (SuspendServiceConnection, TerminateServiceConnection):
            connections.receive(kind(VELOCITY, 0), client, 0.0)
    assert connections.due(0.0) == [ReportDue(CLIENT, VELOCITY, 1, 0)]


@pytest.mark.parametrize(
    ("request_", "response"),
    [
        (create(code=0x4403), ServiceConnectionResponse.COMPONENT_NOT_CAPABLE),
        (create(rate_hz=0.0), ServiceConnectionResponse.INVALID_PARAMETER),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(
    request_: CreateServiceConnection, response: ServiceConnectionResponse
) -> None:
    connections = ServiceConnections(REPORTS)
    assert connections.receive(request_, CLIENT, 0.0) == ConfirmServiceConnection(
        request_.command_code, 0, 0.0, response
    )
    assert list(connections) == []


def test_a_rate_beyond_the_limit_is_granted_at_the_limit() -> None:
    connections = ServiceConnections(REPORTS, max_rate_hz=100.0)
    answer = connections.receive(create(rate_hz=1092.0), CLIENT, 0.0)
    assert answer == ConfirmServiceConnection(VELOCITY, 0, 100.0)


def test_limits_refuse_one_too_many() -> None:
    connections = ServiceConnections(REPORTS, max_per_client=2, max_clients=2)
    answers = [
        connections.receive(create(presence=presence), client, 0.0)
        for client in (CLIENT, OTHER, Client(JausAddress(9, 9, 9, 9)))
        for presence in (1, 2, 3, 1)
    ]
    refused = ServiceConnectionResponse.REFUSED
    assert [answer.response for answer in answers if answer] == [0, 0, refused, 0] * 2 + [refused] * 4


def test_invented_addresses_do_not_lock_others_out() -> None:
    """One place may have four clients; there are sixty-four at most."""
    connections = ServiceConnections(REPORTS)

    def response(subsystem: int, place: int) -> int | None:
        answer = connections.receive(create(), Client(JausAddress(subsystem, 2, 4, 1), place), 0.0)
        return None if answer is None else answer.response

    refused = ServiceConnectionResponse.REFUSED
    assert [response(number, 0) for number in range(1, 17)] == [0] * 4 + [refused] * 12
    assert [response(1, place) for place in range(1, 62)] == [0] * 60 + [refused]
    assert response(4, 0) == 0  # who has one may ask again
    assert len(list(connections)) == 64


def test_there_is_room_for_who_is_preferred_where_there_is_none_for_others() -> None:
    """Another gives way, who is not preferred now, be it one who was before."""
    connections = ServiceConnections(REPORTS, max_clients=4, max_clients_per_place=3)
    strangers = [Client(JausAddress(2, number, 4, 1), number // 3) for number in range(6)]
    first, second = (Client(JausAddress(3, number, 4, 1), 0) for number in range(2))
    answers = [connections.receive(create(), each, 0.0) for each in strangers]
    assert [each.response for each in answers if each is not None] == [0] * 4 + [4] * 2

    def response(client: Client, preferred: Client) -> int | None:
        answer = connections.receive(create(), client, 0.0, prefers=lambda each: each == preferred)
        return None if answer is None else answer.response

    assert response(strangers[5], first) == 4
    assert response(first, first) == 0
    assert {each.client for each in connections} == {*strangers[1:4], first}
    assert response(first, second) == 0  # no longer preferred: he keeps what he has for now
    for number in range(4, 8):
        newest = Client(JausAddress(3, number, 4, 1), 0)
        assert response(newest, newest) == 0
    assert len({each.client for each in connections}) == 4
    assert first not in {each.client for each in connections}


def test_who_is_preferred_gives_way_to_nobody() -> None:
    connections = ServiceConnections(REPORTS, max_clients=2)
    for number in range(3):
        client = Client(JausAddress(2, number + 1, 4, 1), 0)
        answer = connections.receive(create(), client, 0.0, prefers=lambda _: True)
        assert answer is not None
        assert answer.response == (0 if number < 2 else 4)


def test_a_client_that_is_gone_is_forgotten() -> None:
    connections = ServiceConnections(REPORTS, max_clients=1)
    connections.receive(create(), CLIENT, 0.0)
    connections.drop(CLIENT.transport)
    assert connections.next_deadline_s() is None
    answer = connections.receive(create(), OTHER, 0.0)
    assert answer is not None
    assert answer.response == ServiceConnectionResponse.SUCCESSFUL


def test_the_end_is_told_to_every_client() -> None:
    connections = ServiceConnections(REPORTS)
    connections.receive(create(), CLIENT, 0.0)
    connections.receive(create(STATUS), OTHER, 0.0)
    assert connections.terminate() == [
        (CLIENT, TerminateServiceConnection(VELOCITY, 0)),
        (OTHER, TerminateServiceConnection(STATUS, 0)),
    ]
    assert connections.due(1.0) == []


def test_sequence_numbers_begin_anew_after_the_last() -> None:
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=1.0), CLIENT, 0.0)
    (connection,) = connections
    connection.sequence = 65535
    assert [connections.due(now_s)[0].sequence for now_s in (0.0, 1.0)] == [65535, 0]


@given(st.floats(0.02, 1092.0), st.lists(st.floats(0.0, 3.0), min_size=1, max_size=30))
def test_time_in_any_steps_never_sends_one_twice(rate_hz: float, steps: list[float]) -> None:
    connections = ServiceConnections(REPORTS)
    connections.receive(create(rate_hz=rate_hz), CLIENT, 0.0)
    now_s, sent = 0.0, 0
    for step in steps:
        now_s += step
        sent += len(connections.due(now_s))
    assert 1 <= sent <= now_s * rate_hz * (1.0 + 1e-9) + 1.0 + 1e-6
    deadline_s = connections.next_deadline_s()
    assert deadline_s is not None
    assert deadline_s >= now_s - 1e-9


class AnyMessages(RuleBasedStateMachine):
    """Whatever messages come: limits hold, numbers are unique, and deadlines are those of the connections."""

    def __init__(self) -> None:
        super().__init__()
        self.connections = ServiceConnections(REPORTS, max_per_client=3, max_clients=2)
        self.now_s = 0.0

    clients = st.sampled_from([CLIENT, OTHER, Client(JausAddress(9, 9, 9, 9))])
    codes = st.sampled_from([VELOCITY, STATUS, 0x4403])
    rates_hz = st.integers(0, 65535).map(lambda raw: raw * 1092.0 / 65535)

    @rule(client=clients, code=codes, rate_hz=rates_hz, presence=st.integers(0, 3))
    def create(self, client: Client, code: int, rate_hz: float, presence: int) -> None:
        before = {each.client for each in self.connections}
        answer = self.connections.receive(create(code, rate_hz, presence), client, self.now_s)
        assert answer is not None
        if answer.response == ServiceConnectionResponse.SUCCESSFUL:
            assert client in {each.client for each in self.connections}
        else:
            assert before == {each.client for each in self.connections}

    @rule(
        client=clients,
        code=codes,
        number=st.integers(0, 3),
        kind=st.sampled_from(
            [ActivateServiceConnection, SuspendServiceConnection, TerminateServiceConnection]
        ),
    )
    def change(
        self,
        client: Client,
        code: int,
        number: int,
        kind: type[ActivateServiceConnection | SuspendServiceConnection | TerminateServiceConnection],
    ) -> None:
        assert self.connections.receive(kind(code, number), client, self.now_s) is None

    @rule(step_s=st.floats(0.0, 5.0))
    def time_passes(self, step_s: float) -> None:
        self.now_s += step_s
        self.connections.due(self.now_s)

    @rule(client=clients)
    def client_goes(self, client: Client) -> None:
        self.connections.drop(client.transport)

    @invariant()
    def limits_hold(self) -> None:
        found = list(self.connections)
        keys = [(each.client, each.report_code, each.instance_id) for each in found]
        assert len(keys) == len(set(keys))
        clients = [each.client for each in found]
        assert len(set(clients)) <= 2
        assert all(clients.count(client) <= 3 for client in clients)

    @invariant()
    def the_deadline_is_the_first(self) -> None:
        due = [each.due_s for each in self.connections if not each.suspended]
        assert self.connections.next_deadline_s() == min(due, default=None)


TestAnyMessages = AnyMessages.TestCase
