"""One XGV as a node of JAUS: its six components, what they say they take and send, and their reports."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from jaus.address import ComponentId
from jaus.discovery import ComponentDescription, NodeDescription
from jaus.messages import MESSAGES, Message
from jaus.messages.core import (
    ClearEmergency,
    ReleaseComponentControl,
    RequestComponentControl,
    Reset,
    Resume,
    SetComponentAuthority,
    SetEmergency,
    Shutdown,
    Standby,
)
from jaus.messages.discovery import ServiceEntry, ServiceMessage
from jaus.messages.platform import SetDiscreteDevices, SetWrenchEffort
from jaus.messages.torc import ClearErrors, SetMotionProfile, SetSignals
from jaus.node import Node, query_code_of
from jaus.service_connection import ServiceConnections
from xgv_cosim.vehicles.xgv.wire.commands import command_of
from xgv_cosim.vehicles.xgv.wire.reports import (
    DEVICE_FIELDS,
    SIGNAL_FIELDS,
    WRENCH_FIELDS,
    XgvReporter,
    reports_of,
    unknown_to,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from xgv_cosim.endpoint import StackMessage
    from xgv_cosim.vehicles.base import VehicleReadings
    from xgv_cosim.vehicles.xgv.settings import Firmware

MAX_RATE_HZ = 100.0
"""Greatest rate of reports that is granted: once in each communication period of 10 ms."""
CORE_SERVICE = 0
"""Service type of what every component has."""
NAMES = {
    ComponentId.NODE_MANAGER: "Node Manager",
    ComponentId.PRIMITIVE_DRIVER: "Primitive Driver",
    ComponentId.MOTION_PROFILE_DRIVER: "Motion Profile Driver",
    ComponentId.VELOCITY_STATE_SENSOR: "Velocity State Sensor",
    ComponentId.SIGNALS_DRIVER: "Signals Driver",
    ComponentId.ERROR_MANAGER: "Error Manager",
}
_CONTROL: tuple[type[Message], ...] = (
    *(SetComponentAuthority, Shutdown, Standby, Resume, Reset, SetEmergency, ClearEmergency),
    *(RequestComponentControl, ReleaseComponentControl),
)
_TAKES: dict[ComponentId, dict[type[Message], int]] = {
    ComponentId.PRIMITIVE_DRIVER: {SetWrenchEffort: WRENCH_FIELDS, SetDiscreteDevices: DEVICE_FIELDS},
    ComponentId.MOTION_PROFILE_DRIVER: {SetMotionProfile: 0},
    ComponentId.SIGNALS_DRIVER: {SetSignals: SIGNAL_FIELDS},
    ComponentId.ERROR_MANAGER: {ClearErrors: 0},
}
_DRIVERS = frozenset({ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER})


class XgvOnTheWire:
    """One XGV as others on the network see it. Implements ``vehicles.base.VehicleOnTheWire``.

    Args:
        vehicle_id: Its id in the world; a client reads it in the name of the subsystem.
        subsystem: Its subsystem number, 1 to 254.
        readings: What the car knows of itself.
        firmware: Of its controller (XGV-53).
        now_s: When its heartbeats begin.
    """

    def __init__(
        self, vehicle_id: str, subsystem: int, readings: VehicleReadings, firmware: Firmware, now_s: float
    ) -> None:
        reports = reports_of(firmware)
        self.node = Node(
            description(vehicle_id, subsystem, reports),
            reports,
            XgvReporter(readings),
            heartbeat_begin_s=now_s,
            connections=partial(ServiceConnections, max_rate_hz=MAX_RATE_HZ),
            ignores=unknown_to(firmware),
        )

    def command_of(self, message: Message) -> StackMessage | None:
        """Return what a message commands, None if it is no command of the car's.

        Raises:
            CommandError: Its values mean nothing.
        """
        return command_of(message)

    def clears_errors(self, message: Message) -> bool:
        """Return whether a message has the Error Manager forget its errors (jaus-wire, 6.11)."""
        return (
            isinstance(message, ClearErrors)
            and message.header.destination.component == ComponentId.ERROR_MANAGER
        )


def description(
    vehicle_id: str, subsystem: int, reports: Mapping[int, Mapping[int, int | None]]
) -> NodeDescription:
    """Return what an XGV says of itself; that it is simulated stands first in its name."""
    return NodeDescription(
        subsystem,
        f"SIMULATED XGV {vehicle_id}",
        tuple(
            ComponentDescription(component, f"SIMULATED {name}", _services(component, reports[component]))
            for component, name in NAMES.items()
        ),
    )


def _services(component: ComponentId, reports: Mapping[int, int | None]) -> tuple[ServiceEntry, ...]:
    queries = tuple(ServiceMessage(code, 0) for code in map(query_code_of, reports) if code in MESSAGES)
    sent = tuple(ServiceMessage(code, fields or 0) for code, fields in reports.items())
    control = tuple(ServiceMessage(kind.code, 0) for kind in _CONTROL) if component in _DRIVERS else ()
    own = tuple(ServiceMessage(kind.code, fields) for kind, fields in _TAKES.get(component, {}).items())
    return (
        ServiceEntry(CORE_SERVICE, control),
        ServiceEntry(int(component), (*own, *queries), sent),
    )
