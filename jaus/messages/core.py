"""Core messages of RA 3.3: life cycle, control, authority, status, time, service connections, heartbeat.

Codes and numbers: XGV-20, XGV-21, XGV-25, XGV-57.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from jaus.address import JausAddress
from jaus.fields import Byte, Date, Integer, Scaled, Time, UnsignedLong, UnsignedShort
from jaus.messages.base import Message, message
from jaus.status import ComponentStatus

MAX_RATE_HZ = 1092.0


class ControlResponse(IntEnum):
    """Answer to a request for control."""

    ACCEPTED = 0
    NOT_SUPPORTED = 1
    NOT_ACCEPTED = 2


class ServiceConnectionResponse(IntEnum):
    """Answer to a request for a service connection."""

    SUCCESSFUL = 0
    NODE_NOT_CAPABLE = 1
    COMPONENT_NOT_CAPABLE = 2
    INSUFFICIENT_AUTHORITY = 3
    REFUSED = 4
    INVALID_PARAMETER = 5
    COMMAND_NOT_SUPPORTED = 6


class EmergencyBit(IntEnum):
    """Bits of Set and Clear Emergency."""

    EMERGENCY = 0


Rate = Annotated[float, Scaled("H", 0.0, MAX_RATE_HZ, "Hz")]
EmergencyBits = Annotated[int, Integer("H", EmergencyBit, bits=True)]


@dataclass(slots=True)
class _ServiceConnectionCommand(Message):
    command_code: UnsignedShort
    """Code of the report."""
    instance_id: Byte


@dataclass(slots=True)
class _Time(Message):
    time_stamp: Time | None = None
    date_stamp: Date | None = None


@message(0x0001)
class SetComponentAuthority(Message):
    """The sender's authority over the component from now on."""

    authority: Byte


@message(0x0002)
class Shutdown(Message):
    """Go to status shutdown."""


@message(0x0003)
class Standby(Message):
    """Go from ready to standby."""


@message(0x0004)
class Resume(Message):
    """Go from standby to ready."""


@message(0x0005)
class Reset(Message):
    """Go to status initialize."""


@message(0x0006)
class SetEmergency(Message):
    """Go to status emergency."""

    emergency_bits: EmergencyBits = 1


@message(0x0007)
class ClearEmergency(Message):
    """Leave status emergency."""

    emergency_bits: EmergencyBits = 1


@message(0x0008, service_connection=True)
class CreateServiceConnection(Message):
    """Ask for a report again and again."""

    command_code: UnsignedShort
    """Code of the report."""
    rate_hz: Rate
    requested_presence_vector: UnsignedLong = 0
    """Which optional fields the report shall have."""


@message(0x0009, service_connection=True)
class ConfirmServiceConnection(Message):
    """Answer to Create Service Connection."""

    command_code: UnsignedShort
    instance_id: Byte
    rate_hz: Rate
    """What is granted."""
    response: Annotated[int, Integer("B", ServiceConnectionResponse)] = ServiceConnectionResponse.SUCCESSFUL


@message(0x000A, service_connection=True)
class ActivateServiceConnection(_ServiceConnectionCommand):
    """Go on with a suspended service connection."""


@message(0x000B, service_connection=True)
class SuspendServiceConnection(_ServiceConnectionCommand):
    """Keep a service connection, but send nothing."""


@message(0x000C, service_connection=True)
class TerminateServiceConnection(_ServiceConnectionCommand):
    """End a service connection."""


@message(0x000D)
class RequestComponentControl(Message):
    """Ask for control of the component."""

    authority: Byte


@message(0x000E)
class ReleaseComponentControl(Message):
    """Give up control of the component."""


@message(0x000F)
class ConfirmComponentControl(Message):
    """Answer to Request Component Control."""

    response: Annotated[int, Integer("B", ControlResponse)] = ControlResponse.ACCEPTED


@message(0x0010)
class RejectComponentControl(Message):
    """Control is refused, or was taken away."""


@message(0x0011, presence="B")
class SetTime(_Time):
    """Set the clock."""


@message(0x2001)
class QueryComponentAuthority(Message):
    """Ask for the component's authority."""


@message(0x2002)
class QueryComponentStatus(Message):
    """Ask for the component's status."""


@message(0x200D)
class QueryComponentControl(Message):
    """Ask who controls the component."""


@message(0x2011)
class QueryTime(Message):
    """Ask for the time."""

    requested_presence_vector: Byte


@message(0x2202)
class QueryHeartbeatPulse(Message):
    """Ask for a sign of life."""


@message(0x4001)
class ReportComponentAuthority(Message):
    """The component's authority."""

    authority: Byte


@message(0x4002)
class ReportComponentStatus(Message):
    """The component's status (XGV-21, XGV-46)."""

    primary_status: Annotated[int, Integer("B", ComponentStatus)]
    secondary_status: UnsignedLong = 0
    """Meaning is the component's own; of an XGV: ``jaus.messages.torc.SecondaryStatusBit``."""


@message(0x400D)
class ReportComponentControl(Message):
    """Who controls the component; all zero is nobody."""

    subsystem: Byte = 0
    node: Byte = 0
    component: Byte = 0
    instance: Byte = 0
    authority: Byte = 0

    @property
    def controller(self) -> JausAddress | None:
        """Return the controller's address, None for nobody."""
        parts = (self.subsystem, self.node, self.component, self.instance)
        return JausAddress(*parts) if any(parts) else None


@message(0x4011, presence="B")
class ReportTime(_Time):
    """The time."""


@message(0x4202)
class ReportHeartbeatPulse(Message):
    """A sign of life."""
