"""Service connections: reports that a component sends again and again to whoever asked for them.

The providing side of one component. A request is answered at once with a confirmation, and the first report
is due at once; then one per period, whatever the delays of the caller: late reports move none of the later
ones, and those missed altogether are left out. Who asks again for the same thing keeps the connection.

Time is what the caller passes in, in seconds; what is due when is handed out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass

from jaus.address import JausAddress
from jaus.messages import Message
from jaus.messages.core import (
    MAX_RATE_HZ,
    ActivateServiceConnection,
    ConfirmServiceConnection,
    CreateServiceConnection,
    ServiceConnectionResponse,
    SuspendServiceConnection,
    TerminateServiceConnection,
)

SEQUENCE_NUMBERS = 1 << 16


@dataclass(frozen=True, slots=True)
class Client:
    """Who asked: the JAUS address, and where its datagrams come from (XGV-65)."""

    address: JausAddress
    transport: Hashable = None


@dataclass(slots=True)
class ServiceConnection:
    """One connection, as its provider sees it."""

    client: Client
    report_code: int
    instance_id: int
    requested_presence_vector: int
    presence_vector: int
    """Requested and supported; 0 for a report without one."""
    rate_hz: float
    due_s: float
    """When the next report is due."""
    sequence: int = 0
    """Sequence number of the next report."""
    suspended: bool = False


@dataclass(slots=True)
class ReportDue:
    """A report that shall be sent now."""

    client: Client
    report_code: int
    presence_vector: int
    """Which optional fields it shall have."""
    sequence: int


def nobody(_: Client) -> bool:
    """Prefer no client."""
    return False


class ServiceConnections:
    """The service connections that a component provides.

    Args:
        reports: Supported presence vector of each report by its code, None for a report without one.
        max_rate_hz: Greatest rate that is granted; who asks for more gets this.
        max_per_client: How many connections a client may have; one more is refused.
        max_clients_per_place: How many clients of one place may have connections, so that whoever invents
            addresses does not lock the others out; one more is refused.
        max_clients: How many clients may have connections altogether; one more is refused.
    """

    def __init__(
        self,
        reports: Mapping[int, int | None],
        *,
        max_rate_hz: float = MAX_RATE_HZ,
        max_per_client: int = 16,
        max_clients_per_place: int = 4,
        max_clients: int = 64,
    ) -> None:
        self._reports = reports
        self._max_rate_hz = max_rate_hz
        self._max_per_client = max_per_client
        self._max_clients_per_place = max_clients_per_place
        self._max_clients = max_clients
        self._by_client: dict[Client, dict[tuple[int, int], ServiceConnection]] = {}
        self._next_s = math.inf

    def __iter__(self) -> Iterator[ServiceConnection]:
        """Return the connections, client by client."""
        return (each for connections in self._by_client.values() for each in connections.values())

    def receive(
        self, message: Message, client: Client, now_s: float, *, prefers: Callable[[Client], bool] = nobody
    ) -> ConfirmServiceConnection | None:
        """Take a message about service connections; return the answer, if it has one.

        Suspend, Activate and Terminate are not answered; without a connection they do nothing.

        Args:
            message: From the client, to this component.
            client: Who has sent it.
            now_s: When.
            prefers: Who is not to be kept from being told anything: there is always room for him, whatever
                his place has already, and where there is none, another who is not preferred now gives way.
        """
        if isinstance(message, CreateServiceConnection):
            return self._create(message, client, now_s, prefers)
        if isinstance(
            message, ActivateServiceConnection | SuspendServiceConnection | TerminateServiceConnection
        ):
            self._change(message, client, now_s)
        return None

    def due(self, now_s: float) -> list[ReportDue]:
        """Return the reports to send now, and set when the next ones are due."""
        if now_s < self._next_s:
            return []
        found = []
        for each in self:
            if each.suspended or each.due_s > now_s:
                continue
            found.append(ReportDue(each.client, each.report_code, each.presence_vector, each.sequence))
            each.sequence = (each.sequence + 1) % SEQUENCE_NUMBERS
            each.due_s += (math.floor((now_s - each.due_s) * each.rate_hz) + 1) / each.rate_hz
        self._reckon()
        return found

    def next_deadline_s(self) -> float | None:
        """Return when the next report is due, None for never."""
        return None if self._next_s == math.inf else self._next_s

    def drop(self, transport: Hashable) -> None:
        """Forget the connections of the clients whose datagrams came from ``transport``."""
        for client in [each for each in self._by_client if each.transport == transport]:
            del self._by_client[client]
        self._reckon()

    def terminate(self) -> list[tuple[Client, TerminateServiceConnection]]:
        """End all connections, and return what their clients are to be told."""
        told = [
            (each.client, TerminateServiceConnection(each.report_code, each.instance_id)) for each in self
        ]
        self._by_client.clear()
        self._reckon()
        return told

    def _create(
        self,
        message: CreateServiceConnection,
        client: Client,
        now_s: float,
        prefers: Callable[[Client], bool],
    ) -> ConfirmServiceConnection:
        code = message.command_code
        kept = self._like(message, client)
        refusal = self._refusal(message, client, prefers) if kept is None else None
        if message.rate_hz <= 0.0:
            refusal = ServiceConnectionResponse.INVALID_PARAMETER
        if refusal is not None:
            return ConfirmServiceConnection(code, 0, 0.0, refusal)
        connections = self._by_client.setdefault(client, {})
        requested = message.requested_presence_vector
        instance_id = _free_id(connections, code) if kept is None else kept.instance_id
        rate_hz = min(message.rate_hz, self._max_rate_hz)
        connections[code, instance_id] = ServiceConnection(
            client,
            code,
            instance_id,
            requested,
            requested & (self._reports[code] or 0),
            rate_hz,
            # Asked for again, the next report comes when it would have come: repeats do not add any.
            now_s if kept is None or kept.suspended else min(kept.due_s, now_s + 1.0 / rate_hz),
        )
        self._reckon()
        return ConfirmServiceConnection(code, instance_id, rate_hz, ServiceConnectionResponse.SUCCESSFUL)

    def _like(self, message: CreateServiceConnection, client: Client) -> ServiceConnection | None:
        """Return the connection that the client asks for again."""
        code, requested = message.command_code, message.requested_presence_vector
        one_kind = self._reports.get(code) is None
        for each in self._by_client.get(client, {}).values():
            if each.report_code == code and (one_kind or each.requested_presence_vector == requested):
                return each
        return None

    def _refusal(
        self, message: CreateServiceConnection, client: Client, prefers: Callable[[Client], bool]
    ) -> ServiceConnectionResponse | None:
        if message.command_code not in self._reports:
            return ServiceConnectionResponse.COMPONENT_NOT_CAPABLE
        has = len(self._by_client.get(client, {}))
        has_room = has < self._max_per_client if has else self._has_room(client, prefers)
        return None if has_room else ServiceConnectionResponse.REFUSED

    def _has_room(self, newcomer: Client, prefers: Callable[[Client], bool]) -> bool:
        """Return whether there is room for one more client, and make it for one who is preferred."""
        is_full = len(self._by_client) >= self._max_clients
        if not prefers(newcomer):
            of_place = sum(client.transport == newcomer.transport for client in self._by_client)
            return of_place < self._max_clients_per_place and not is_full
        if is_full:
            gives_way = next((client for client in self._by_client if not prefers(client)), None)
            if gives_way is None:
                return False
            del self._by_client[gives_way]
        return True

    def _change(
        self,
        message: ActivateServiceConnection | SuspendServiceConnection | TerminateServiceConnection,
        client: Client,
        now_s: float,
    ) -> None:
        connections = self._by_client.get(client, {})
        key = message.command_code, message.instance_id
        connection = connections.get(key)
        if connection is None:
            return
        if isinstance(message, TerminateServiceConnection):
            del connections[key]
            if not connections:
                del self._by_client[client]
        elif isinstance(message, SuspendServiceConnection):
            connection.suspended = True
        elif connection.suspended:
            connection.suspended = False
            connection.due_s = now_s
        self._reckon()

    def _reckon(self) -> None:
        self._next_s = min((each.due_s for each in self if not each.suspended), default=math.inf)


def _free_id(connections: Mapping[tuple[int, int], ServiceConnection], code: int) -> int:
    return next(number for number in range(len(connections) + 1) if (code, number) not in connections)
