"""What keeps a vehicle in a node manager's system tree: heartbeats and answers (jaus-wire 4.1)."""

from __future__ import annotations

import pytest

from jaus.address import JausAddress
from jaus.codec import decode, encode
from jaus.discovery import ComponentDescription, Heartbeat, NodeDescription, answer, fitting_name
from jaus.messages import Message
from jaus.messages.core import QueryComponentStatus, QueryHeartbeatPulse, ReportHeartbeatPulse
from jaus.messages.discovery import (
    ComponentEntry,
    IdentificationType,
    NodeEntry,
    QueryConfiguration,
    QueryIdentification,
    QueryLevel,
    QueryServices,
    QuerySubsystemList,
    ReportConfiguration,
    ReportIdentification,
    ReportServices,
    ReportSubsystemList,
    ServiceEntry,
    ServiceMessage,
    SubsystemEntry,
)
from jaus.messages.events import (
    CancelEvent,
    CreateEvent,
    EventResponse,
    QueryEvents,
    RejectEventRequest,
    ReportEvents,
    UpdateEvent,
)

MANAGER = ComponentDescription(1, "Node Manager")
SERVICES = (ServiceEntry(33, (ServiceMessage(0x0405, 0x61),), (ServiceMessage(0x4405, 0x61),)),)
DRIVER = ComponentDescription(33, "Primitive Driver", SERVICES, authority=6)
NODE = NodeDescription(7, "SIMULATED XGV veh0", (MANAGER, DRIVER))
ASKER = JausAddress(1, 2, 1, 1)


def asked(query: Message, component: ComponentDescription = MANAGER) -> Message | None:
    """Return the answer, and see that it goes to who asked and passes the wire."""
    own = NODE.address(component.component)
    reply = answer(query.to(own, source=ASKER, sequence=5), NODE, component)
    if reply is not None:
        assert (reply.header.destination, reply.header.source) == (ASKER, own)
        assert decode(encode(reply)) == reply
    return reply


def body(message: Message | None) -> dict[str, object]:
    assert message is not None
    return {field.name: getattr(message, field.name) for field in message.fields}


@pytest.mark.parametrize(
    ("level", "component", "kind", "name", "authority"),
    [
        (QueryLevel.SYSTEM, MANAGER, IdentificationType.VEHICLE, "SIMULATED XGV veh0", 0),
        (QueryLevel.SUBSYSTEM, MANAGER, IdentificationType.VEHICLE, "SIMULATED XGV veh0", 0),
        (QueryLevel.NODE, MANAGER, IdentificationType.NODE, "SIMULATED XGV veh0", 0),
        (QueryLevel.COMPONENT, MANAGER, IdentificationType.COMPONENT, "Node Manager", 0),
        (QueryLevel.COMPONENT, DRIVER, IdentificationType.COMPONENT, "Primitive Driver", 6),
        (9, DRIVER, IdentificationType.VEHICLE, "SIMULATED XGV veh0", 6),
    ],
)
def test_identification(
    level: int, component: ComponentDescription, kind: IdentificationType, name: str, authority: int
) -> None:
    reply = asked(QueryIdentification(level), component)
    assert isinstance(reply, ReportIdentification)
    assert body(reply) == body(ReportIdentification(level, authority, kind, name))


@pytest.mark.parametrize(
    ("query", "report"),
    [
        (QueryHeartbeatPulse(), ReportHeartbeatPulse()),
        (QuerySubsystemList(), ReportSubsystemList((SubsystemEntry(7, 1, 1, 1),))),
        (
            QueryConfiguration(QueryLevel.SUBSYSTEM),
            ReportConfiguration((NodeEntry(1, (ComponentEntry(1, 1), ComponentEntry(33, 1))),)),
        ),
        (QueryServices(), ReportServices(())),
        (CreateEvent(9, 0x4B01, 1), RejectEventRequest(9, EventResponse.MESSAGE_NOT_SUPPORTED)),
        (UpdateEvent(9, 0x4B01, 1), RejectEventRequest(9, EventResponse.MESSAGE_NOT_SUPPORTED)),
        (CancelEvent(9), RejectEventRequest(9, EventResponse.INVALID)),
        (QueryEvents(), ReportEvents(0)),
    ],
    ids=lambda message: type(message).__name__,
)
def test_answers(query: Message, report: Message) -> None:
    reply = asked(query)
    assert type(reply) is type(report)
    assert body(reply) == body(report)


def test_a_component_tells_its_own_services() -> None:
    assert body(asked(QueryServices(), DRIVER)) == {"services": SERVICES}


def test_other_messages_are_not_answered_here() -> None:
    assert asked(QueryComponentStatus()) is None


@pytest.mark.parametrize(
    ("parts", "component"),
    [
        ((7, 1, 33, 1), DRIVER),
        ((7, 1, 1, 1), MANAGER),
        ((7, 1, 255, 255), MANAGER),
        ((255, 255, 1, 1), MANAGER),
        ((255, 255, 255, 255), MANAGER),
        ((7, 255, 33, 255), DRIVER),
        ((8, 1, 33, 1), None),
        ((7, 2, 33, 1), None),
        ((7, 1, 42, 1), None),
        ((7, 1, 33, 2), None),
    ],
)
def test_whom_an_address_means(
    parts: tuple[int, int, int, int], component: ComponentDescription | None
) -> None:
    assert NODE.component_at(JausAddress(*parts)) is component


def test_a_name_fits_into_its_message() -> None:
    """Vehicle ids are anybody's words."""
    assert fitting_name("é" * 90) == "é" * 80
    assert fitting_name("車 1") == "? 1"


def test_a_heartbeat_per_period_with_a_number_each() -> None:
    heartbeat = Heartbeat(begin_s=2.0)
    everyone = JausAddress(255, 255, 1, 1)
    assert heartbeat.due(1.99, NODE, everyone) is None
    found = []
    for step in range(301):
        pulse = heartbeat.due(2.0 + step * 0.01, NODE, everyone)
        found += [] if pulse is None else [pulse]
    assert [pulse.header.sequence for pulse in found] == [0, 1, 2, 3]
    assert {pulse.header.source for pulse in found} == {NODE.address()}
    assert not found[0].header.properties.service_connection
    assert heartbeat.next_deadline_s() == 6.0


def test_missed_heartbeats_are_not_made_up_for() -> None:
    heartbeat = Heartbeat()
    everyone = JausAddress(255, 255, 1, 1)
    assert heartbeat.due(10.5, NODE, everyone) is not None
    assert heartbeat.due(10.6, NODE, everyone) is None
    assert heartbeat.next_deadline_s() == 11.0
