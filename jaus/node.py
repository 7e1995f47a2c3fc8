"""One node of components: what it answers by itself, and which reports it owes.

A node answers discovery, heartbeat queries, queries for its reports, and everything about service
connections. Commands and all else are the application's business. Time is passed in and nothing is sent:
messages go in, addressed messages come out. ``jaus.port`` turns them into datagrams.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Mapping
from types import MappingProxyType

from jaus.address import BROADCAST, JausAddress
from jaus.discovery import ComponentDescription, Heartbeat, NodeDescription, answer
from jaus.errors import LocalProtocolError
from jaus.messages import Message
from jaus.messages.core import (
    ActivateServiceConnection,
    CreateServiceConnection,
    ReportHeartbeatPulse,
    SuspendServiceConnection,
    TerminateServiceConnection,
)
from jaus.service_connection import Client, ServiceConnections, nobody

EVERYONE = JausAddress(255, 255, 1, 1)
"""Where heartbeats go: the node managers of all nodes."""

Reporter = Callable[[int, int], Message]
"""Takes a component and the code of a report, and returns the report with all its fields.

Each time a new object: the node addresses it, and takes away the fields that nobody asked for.
"""
ABOUT_SERVICE_CONNECTIONS = (
    CreateServiceConnection,
    ActivateServiceConnection,
    SuspendServiceConnection,
    TerminateServiceConnection,
)


def report_code_of(query_code: int) -> int | None:
    """Return the code of the report that answers a query, None if the code is no query's.

    Queries are 2000 to 3FFF and their reports 2000 more; TORC's are proposed as 200 below their reports.
    """
    if 0x2000 <= query_code <= 0x3FFF:
        return query_code + 0x2000
    return query_code + 0x200 if 0xE200 <= query_code <= 0xE2FF else None


def query_code_of(report_code: int) -> int:
    """Return the code of the query that a report answers, see ``report_code_of``."""
    return report_code - (0x200 if report_code >= 0xE000 else 0x2000)


class Node:
    """One node, by itself.

    Args:
        description: What others see of it.
        reports: By component the supported presence vector of each of its reports by code, None for a report
            without one.
        reporter: Makes the reports.
        heartbeat_begin_s: When the first heartbeat is due.
        connections: Makes the service connections of a component from its reports; with limits of your own,
            ``partial(ServiceConnections, max_clients=4)``.
        ignores: By component codes of reports that it has never heard of: connections for them are not even
            refused.

    Raises:
        LocalProtocolError: Reports of a component that the description does not have, or one component
            described twice: a node has one instance of each.
    """

    def __init__(
        self,
        description: NodeDescription,
        reports: Mapping[int, Mapping[int, int | None]],
        reporter: Reporter,
        *,
        heartbeat_begin_s: float = 0.0,
        connections: Callable[[Mapping[int, int | None]], ServiceConnections] = ServiceConnections,
        ignores: Mapping[int, Collection[int]] = MappingProxyType({}),
    ) -> None:
        components = {each.component: each for each in description.components}
        if len(components) < len(description.components):
            numbers = [each.component for each in description.components]
            raise LocalProtocolError(f"node: components {numbers}, expected one instance of each")
        if strange := sorted(set(reports) - set(components)):
            raise LocalProtocolError(f"node: reports of components {strange}, expected {sorted(components)}")
        self.description = description
        self._reports = reports
        self._reporter = reporter
        self._own = {name: description.address(name, each.instance) for name, each in components.items()}
        self._connections = {name: connections(reports.get(name, {})) for name in components}
        self._by_id = {address.jaus_id: components[name] for name, address in self._own.items()}
        self._ignores = ignores
        self._heartbeat = Heartbeat(begin_s=heartbeat_begin_s)
        self.is_silent = False
        """Set by the application: a port hands it nothing and sends nothing of it, as if it had no power."""
        self.prefers: Callable[[Client], bool] = nobody
        """Set by the application: for whose service connections there is always room, as who has control."""

    def component_at(self, jaus_id: int) -> ComponentDescription | None:
        """Return whom a JAUS id means: for a broadcast the node manager, None for somebody else."""
        known = self._by_id.get(jaus_id)
        if known is None and BROADCAST in jaus_id.to_bytes(4, "little"):
            return self.description.component_at(JausAddress.from_jaus_id(jaus_id))
        return known

    def receive(self, message: Message, client: Client, now_s: float) -> list[Message] | None:
        """Take a message to this node; return the answers, None if it is the application's business."""
        component = self.component_at(message.header.destination_id)
        if component is None:
            return []
        if isinstance(message, ABOUT_SERVICE_CONNECTIONS):
            if message.command_code in self._ignores.get(component.component, ()):
                return []
            connections = self._connections[component.component]
            confirmed = connections.receive(message, client, now_s, prefers=self.prefers)
            return [] if confirmed is None else [self._reply(confirmed, message, component)]
        found = answer(message, self.description, component)
        if found is not None:
            return [found]
        code = report_code_of(message.code)
        supported = self._reports.get(component.component, {})
        if code is None or code not in supported:
            return None
        requested = getattr(message, "requested_presence_vector", ~0)
        report = self._reporter(component.component, code).keep(requested & (supported[code] or 0))
        return [self._reply(report, message, component)]

    def due(self, now_s: float) -> list[tuple[Client, Message]]:
        """Return the reports under service connections to send now."""
        found: list[tuple[Client, Message]] = []
        for component, connections in self._connections.items():
            for due in connections.due(now_s):
                report = self._reporter(component, due.report_code).keep(due.presence_vector)
                own, to = self._own[component], due.client.address
                report.to(to, source=own, sequence=due.sequence, service_connection=True)
                found.append((due.client, report))
        return found

    def heartbeat(self, now_s: float) -> ReportHeartbeatPulse | None:
        """Return the heartbeat to send now, None before its time."""
        return self._heartbeat.due(now_s, self.description, EVERYONE)

    def next_deadline_s(self) -> float:
        """Return when ``due`` or ``heartbeat`` has something to send."""
        deadlines = (connections.next_deadline_s() for connections in self._connections.values())
        known = (deadline for deadline in deadlines if deadline is not None)
        return min([self._heartbeat.next_deadline_s(), *known])

    def forget(self, transport: Hashable) -> None:
        """Drop the service connections of whoever sent from ``transport`` and is gone."""
        for connections in self._connections.values():
            connections.drop(transport)

    def terminate(self) -> list[tuple[Client, Message]]:
        """End all service connections; return what their clients are to be told."""
        found: list[tuple[Client, Message]] = []
        for component, connections in self._connections.items():
            for client, message in connections.terminate():
                found.append((client, message.to(client.address, source=self._own[component])))
        return found

    def _reply(self, reply: Message, query: Message, component: ComponentDescription) -> Message:
        own = self._own[component.component]
        return reply.to(query.header.source, source=own, sequence=query.header.sequence)
