"""Being found: heartbeats, and answers to who is there and what it understands.

A node manager keeps in its system tree whom it hears every second and who answers these queries; who is not
in it loses control and service connections. Everything here follows from a description of the node that does
not change, so the answers are a function of the query.
"""

from __future__ import annotations

from dataclasses import dataclass

from jaus.address import BROADCAST, JausAddress
from jaus.messages import Message
from jaus.messages.core import QueryHeartbeatPulse, ReportHeartbeatPulse
from jaus.messages.discovery import (
    NAME_SIZE,
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

ANSWERED = frozenset(
    {QueryHeartbeatPulse, QueryIdentification, QueryConfiguration, QuerySubsystemList, QueryServices}
    | {CreateEvent, UpdateEvent, CancelEvent, QueryEvents}
)
"""What is answered here."""
NODE_MANAGER = 1
HEARTBEAT_PERIOD_S = 1.0


@dataclass(frozen=True, slots=True)
class ComponentDescription:
    """A component as others see it."""

    component: int
    name: str
    services: tuple[ServiceEntry, ...] = ()
    """What it takes and sends."""
    instance: int = 1
    authority: int = 0


@dataclass(frozen=True, slots=True)
class NodeDescription:
    """A node as others see it; it is its subsystem's only one."""

    subsystem: int
    name: str
    """What the subsystem is; a simulated vehicle says so here."""
    components: tuple[ComponentDescription, ...]
    node: int = 1
    kind: IdentificationType = IdentificationType.VEHICLE

    def address(self, component: int = NODE_MANAGER, instance: int = 1) -> JausAddress:
        """Return the address of a component."""
        return JausAddress(self.subsystem, self.node, component, instance)

    def component_at(self, address: JausAddress) -> ComponentDescription | None:
        """Return whom ``address`` means: for a broadcast the node manager, None for somebody else."""
        own = ((self.subsystem, address.subsystem), (self.node, address.node))
        if any(asked not in {mine, BROADCAST} for mine, asked in own):
            return None
        component = NODE_MANAGER if address.component == BROADCAST else address.component
        for each in self.components:
            if each.component == component and address.instance in {each.instance, BROADCAST}:
                return each
        return None


def answer(message: Message, node: NodeDescription, component: ComponentDescription) -> Message | None:
    """Return what ``component`` answers, addressed to who asked; None if the query is none of these.

    Events are refused: an XGV reports by service connections.
    """
    if type(message) not in ANSWERED:
        return None
    reply: Message | None = None
    match message:
        case QueryHeartbeatPulse():
            reply = ReportHeartbeatPulse()
        case QueryIdentification():
            reply = _identification(message.query_type, node, component)
        case QueryConfiguration():
            entries = tuple(ComponentEntry(each.component, each.instance) for each in node.components)
            reply = ReportConfiguration((NodeEntry(node.node, entries),))
        case QuerySubsystemList():
            reply = ReportSubsystemList((SubsystemEntry(node.subsystem, node.node, NODE_MANAGER, 1),))
        case QueryServices():
            reply = ReportServices(component.services)
        case CreateEvent() | UpdateEvent():
            reply = RejectEventRequest(message.request_id, EventResponse.MESSAGE_NOT_SUPPORTED)
        case CancelEvent():
            reply = RejectEventRequest(message.request_id, EventResponse.INVALID)
        case QueryEvents():
            reply = ReportEvents(0)
    if reply is None:
        return None
    own = node.address(component.component, component.instance)
    return reply.to(message.header.source, source=own, sequence=message.header.sequence)


def _identification(
    level: int, node: NodeDescription, component: ComponentDescription
) -> ReportIdentification:
    kinds: dict[int, tuple[IdentificationType, str]] = {
        QueryLevel.NODE: (IdentificationType.NODE, node.name),
        QueryLevel.COMPONENT: (IdentificationType.COMPONENT, component.name),
    }
    kind, name = kinds.get(level, (node.kind, node.name))
    return ReportIdentification(level, component.authority, kind, fitting_name(name))


def fitting_name(name: str) -> str:
    """Return ``name`` as far as the message has room, with ``?`` for what it has no character for."""
    return name.encode("latin-1", "replace").decode("latin-1")[:NAME_SIZE]


class Heartbeat:
    """The sign of life of a node, once per period, with its own sequence number.

    Args:
        period_s: Seconds between two.
        begin_s: When the first is due.
    """

    def __init__(self, period_s: float = HEARTBEAT_PERIOD_S, *, begin_s: float = 0.0) -> None:
        self._period_s = period_s
        self._due_s = begin_s
        self._sequence = 0

    def next_deadline_s(self) -> float:
        """Return when the next one is due."""
        return self._due_s

    def due(self, now_s: float, node: NodeDescription, to: JausAddress) -> ReportHeartbeatPulse | None:
        """Return the heartbeat to send now, None before its time; what was missed is not made up for."""
        if now_s < self._due_s:
            return None
        missed = (now_s - self._due_s) // self._period_s
        self._due_s += (missed + 1) * self._period_s
        pulse = ReportHeartbeatPulse().to(to, source=node.address(), sequence=self._sequence)
        self._sequence = (self._sequence + 1) & 0xFFFF
        return pulse
