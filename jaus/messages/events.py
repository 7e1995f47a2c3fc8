"""Events of RA 3.3."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

from jaus.fields import Byte, Integer, RestOfBody, SizedBytes, Tagged, TerminatedText, UnsignedShort
from jaus.messages.base import Message, message
from jaus.messages.core import Rate


class EventType(IntEnum):
    """When an event is sent."""

    PERIODIC = 0
    EVERY_CHANGE = 1
    FIRST_CHANGE = 2
    FIRST_CHANGE_IN_AND_OUT = 3
    PERIODIC_NO_REPEAT = 4
    ONE_TIME = 5


class EventBoundary(IntEnum):
    """How a value is compared with the limits."""

    EQUAL = 0
    NOT_EQUAL = 1
    INSIDE_INCLUSIVE = 2
    INSIDE_EXCLUSIVE = 3
    OUTSIDE_INCLUSIVE = 4
    OUTSIDE_EXCLUSIVE = 5
    GREATER_OR_EQUAL = 6
    GREATER = 7
    LESS_OR_EQUAL = 8
    LESS = 9


class EventResponse(IntEnum):
    """Answer to a request for an event."""

    SUCCESSFUL = 0
    PERIODIC_NOT_SUPPORTED = 1
    CHANGE_NOT_SUPPORTED = 2
    REFUSED = 3
    INVALID = 4
    MESSAGE_NOT_SUPPORTED = 5


Limit = Annotated[
    tuple[int, float | tuple[int, ...]], Tagged(("B", "h", "i", "q", "H", "I", "Q", "f", "d", "BBB"))
]
Response = Annotated[int, Integer("B", EventResponse)]
Type = Annotated[int, Integer("B", EventType)]
Boundary = Annotated[int, Integer("B", EventBoundary)]
QueryBody = Annotated[bytes, SizedBytes()]


@dataclass(slots=True)
class _EventRequest(Message):
    request_id: Byte
    command_code: UnsignedShort
    event_type: Type
    boundary: Boundary | None = None
    limit_field: Byte | None = None
    lower_limit: Limit | None = None
    upper_limit: Limit | None = None
    state_limit: Limit | None = None
    minimum_rate_hz: Rate | None = None
    rate_hz: Rate | None = None


@message(0x01F0, presence="B")
class CreateEvent(_EventRequest):
    """Ask for a report when something happens."""

    query_body: QueryBody | None = None
    """Body of the query that the reports answer, without its header."""


@message(0x01F1, presence="B")
class UpdateEvent(_EventRequest):
    """Change what was asked for with Create Event."""

    event_id: Byte = 0
    query_body: QueryBody | None = None


@message(0x01F2, presence="B")
class CancelEvent(Message):
    """End an event."""

    request_id: Byte
    command_code: UnsignedShort | None = None
    event_id: Byte | None = None


@message(0x01F3, presence="B")
class ConfirmEventRequest(Message):
    """The event will be sent."""

    request_id: Byte
    command_code: UnsignedShort
    event_id: Byte
    rate_hz: Rate | None = None
    response: Response = EventResponse.SUCCESSFUL


@message(0x01F4, presence="B")
class RejectEventRequest(Message):
    """The event will not be sent."""

    request_id: Byte
    response: Response
    explanation: Annotated[str, TerminatedText()] | None = None


@message(0x21F0, presence="B")
class QueryEvents(Message):
    """Ask which events there are."""

    command_code: UnsignedShort | None = None
    event_type: Type | None = None
    event_id: Byte | None = None


@message(0x41F0)
class ReportEvents(Message):
    """The events there are."""

    count: Byte
    records: Annotated[bytes, RestOfBody()] = b""
    """As they lie on the wire."""


@message(0x41F1)
class Event(Message):
    """Something happened."""

    event_id: Byte
    command_code: UnsignedShort
    sequence: Byte
    report_body: Annotated[bytes, SizedBytes()] = b""
    """Body of the report, without its header."""
