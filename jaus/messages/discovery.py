"""Dynamic configuration: who is there, and what it understands."""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated

from jaus.fields import Byte, Integer, Text, UnsignedLong, UnsignedShort
from jaus.messages.base import Message, message, record

NAME_SIZE = 80
"""Characters that an identification has room for."""


class QueryLevel(IntEnum):
    """Which level of the address a query is about."""

    SYSTEM = 1
    SUBSYSTEM = 2
    NODE = 3
    COMPONENT = 4


class IdentificationType(IntEnum):
    """What kind of thing answers."""

    UNKNOWN = 0
    VEHICLE = 10001
    OPERATOR_CONTROL_UNIT = 20001
    OTHER_SUBSYSTEM = 30001
    NODE = 40001
    PAYLOAD = 50001
    COMPONENT = 60001


Level = Annotated[int, Integer("B", QueryLevel)]


@record
class ComponentEntry:
    """One component of a node."""

    component: Byte
    instance: Byte


@record
class NodeEntry:
    """One node and its components."""

    node: Byte
    components: tuple[ComponentEntry, ...] = ()


@record
class SubsystemEntry:
    """One component of a subsystem in the list of subsystems."""

    subsystem: Byte
    node: Byte
    component: Byte
    instance: Byte


@record
class ServiceMessage:
    """One message that a service takes or sends."""

    command_code: UnsignedShort
    supported_presence_vector: UnsignedLong = 0


@record
class ServiceEntry:
    """One service of a component."""

    service_type: UnsignedShort
    """Component id of the standard; 0 for the core service."""
    inputs: tuple[ServiceMessage, ...] = ()
    outputs: tuple[ServiceMessage, ...] = ()


@message(0x2B00)
class QueryIdentification(Message):
    """Ask for a name."""

    query_type: Level


@message(0x2B01)
class QueryConfiguration(Message):
    """Ask for the components of a subsystem or node."""

    query_type: Level


@message(0x2B02)
class QuerySubsystemList(Message):
    """Ask which subsystems are known."""


@message(0x2B03)
class QueryServices(Message):
    """Ask which messages the component understands."""


@message(0x4B00)
class ReportIdentification(Message):
    """A name."""

    query_type: Level
    authority: Byte
    identification_type: Annotated[int, Integer("H", IdentificationType)]
    identification: Annotated[str, Text(NAME_SIZE)] = ""


@message(0x4B01)
class ReportConfiguration(Message):
    """The components of a subsystem or node."""

    nodes: tuple[NodeEntry, ...] = ()


@message(0x4B02)
class ReportSubsystemList(Message):
    """The subsystems that are known."""

    subsystems: tuple[SubsystemEntry, ...] = ()


@message(0x4B03)
class ReportServices(Message):
    """The messages that the component understands."""

    services: tuple[ServiceEntry, ...] = ()
