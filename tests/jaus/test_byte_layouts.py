"""Messages that no other implementation has packed for us: their bytes by hand, from the reference's layouts.

Together with the golden vectors every declared code has bytes that this library did not make (XGV-55 to
XGV-61).
"""

from __future__ import annotations

import math

import pytest

from jaus.address import JausAddress
from jaus.codec import decode, decode_body, encode, encode_body
from jaus.fields import Scaled
from jaus.header import UNADDRESSED
from jaus.messages import MESSAGES, Message
from jaus.messages.core import SetTime
from jaus.messages.discovery import (
    ComponentEntry,
    NodeEntry,
    ReportConfiguration,
    ReportIdentification,
    ReportServices,
    ReportSubsystemList,
    ServiceEntry,
    ServiceMessage,
    SubsystemEntry,
)
from jaus.messages.events import ConfirmEventRequest, CreateEvent, Event, ReportEvents, UpdateEvent
from jaus.messages.platform import ReportGlobalPose, ReportLocalPose
from jaus.messages.torc import (
    ClearErrors,
    QueryCurvature,
    QueryErrorCount,
    QuerySignals,
    QueryVehicleMode,
    QueryWheelsSpeed,
    ReportErrorCount,
    ReportWheelsSpeed,
)
from jaus.stamps import DateStamp, TimeStamp
from tests.jaus.golden import GOLDEN

CLIENT = JausAddress(2, 2, 4, 1)
TIME = TimeStamp(31, 23, 2, 1, 999).packed
"""On the wire e7 07 c2 fd."""
DATE = DateStamp(2026, 12, 31).packed
"""On the wire 9f 35."""
VERSIONED: list[tuple[type[Message], int, str]] = [
    (QueryWheelsSpeed, 33, "2ee2"),
    (QuerySignals, 11, "45e2"),
    (QueryErrorCount, 12, "51e2"),
    (QueryCurvature, 10, "55e2"),
    (QueryVehicleMode, 1, "56e2"),
    (ClearErrors, 12, "51e3"),
]
"""With the experimental bit, and a version as their only byte."""
BODIES: list[tuple[Message, str]] = [
    (SetTime(TIME, DATE), "03 e707c2fd 9f35"),
    (SetTime(date_stamp=DATE), "02 9f35"),
    # Presence vector, request, code, type, then the optional fields by their bits.
    (CreateEvent(9, 0x4404, 1, boundary=6, lower_limit=(7, 12.5)), "05 09 0444 01 06 07 00004841"),
    (CreateEvent(9, 0x4404, 0, limit_field=2, upper_limit=(1, -2)), "0a 09 0444 00 02 01 feff"),
    (CreateEvent(9, 0x4404, 1, state_limit=(9, (1, 2, 3))), "10 09 0444 01 09 010203"),
    # As Create, with the event's id before the query, whichever of the optional fields are there.
    (UpdateEvent(9, 0x4404, 1, event_id=7), "00 09 0444 01 07"),
    (
        UpdateEvent(9, 0x4404, 1, 6, minimum_rate_hz=5.0, rate_hz=10.0, event_id=7, query_body=b"\xff\x01"),
        "e1 09 0444 01 06 2c01 5802 07 02000000 ff01",
    ),
    (ConfirmEventRequest(9, 0x4002, 7, rate_hz=10.0, response=0), "01 09 0240 07 5802 00"),
    (ConfirmEventRequest(9, 0x4002, 7, response=3), "00 09 0240 07 03"),
    (ReportEvents(1, b"\x02\x40\x00\x07"), "01 02400007"),
    (Event(7, 0x4404, 3, b"\xaa\xbb"), "07 0444 03 02000000 aabb"),
    (
        ReportGlobalPose(90.0, -180.0, 12_500.0, 100.0, math.pi, 0.0, -math.pi, math.pi, TIME, DATE),
        "ff03 ffffff7f 01000080 00000000 ffffffff ff7f 0000 0180 ffff e707c2fd 9f35",
    ),
    (ReportGlobalPose(longitude_deg=180.0, yaw_rad=math.pi), "4200 ffffff7f ff7f"),
    (
        ReportLocalPose(100_000.0, -100_000.0, 35_000.0, 0.0, 0.0, math.pi, -math.pi, 0.0, TIME),
        "ff01 ffffff7f 01000080 ffffff7f 00000000 0000 ff7f 0180 0000 e707c2fd",
    ),
    (ReportIdentification(2, 6, 10001, "XGV"), "02 06 1127" + "584756" + 77 * "00"),
    (ReportIdentification(4, 0, 60001, "a" * 80), "04 00 61ea" + 80 * "61"),
    (
        ReportConfiguration((NodeEntry(1, (ComponentEntry(1, 1), ComponentEntry(33, 2))), NodeEntry(2))),
        "02 01 02 0101 2102 02 00",
    ),
    (
        ReportSubsystemList((SubsystemEntry(7, 2, 1, 3), SubsystemEntry(8, 1, 1, 1))),
        "02 07020103 08010101",
    ),
    (
        ReportServices(
            (
                ServiceEntry(0),
                ServiceEntry(
                    33,
                    (ServiceMessage(0x0405, 0x61),),
                    (ServiceMessage(0x4405, 0x61), ServiceMessage(0x4002)),
                ),
            )
        ),
        "02 0000 00 00 2100 01 0504 61000000 02 0544 61000000 0240 00000000",
    ),
    # Right front, left front, right rear, left rear.
    (ReportWheelsSpeed(0, -65.535, 65.535, 0.001, -64.511, TIME), "00 0000 ffff 0080 0002 e707c2fd"),
    # One error more and more bytes: a signed number each.
    (ReportErrorCount(1, 0, (9157, -1)), "01 00 02 c5230000 ffffffff"),
]


def body_id(value: object) -> str:
    return type(value).__name__ if isinstance(value, Message) else ""


@pytest.mark.parametrize(("message", "text"), BODIES, ids=body_id)
def test_a_body_lies_as_the_reference_says(message: Message, text: str) -> None:
    data = bytes.fromhex(text)
    assert encode_body(message) == data
    again = decode_body(message.code, data, UNADDRESSED)
    assert encode_body(again) == data
    for field in message.fields:
        value = getattr(message, field.name)
        step = field.kind.scale if isinstance(field.kind, Scaled) else 0.0
        close = pytest.approx(value, abs=step) if isinstance(value, float) else value
        assert getattr(again, field.name) == close, field.name


@pytest.mark.parametrize(("kind", "component", "code"), VERSIONED, ids=str)
def test_torcs_proposed_messages_have_a_version_alone(kind: type[Message], component: int, code: str) -> None:
    data = bytes.fromhex(f"8602 {code} 01{component:02x}0102 01040202 0100 0701 00")
    message = kind().to(JausAddress(2, 1, component, 1), source=CLIENT, sequence=263)
    assert encode(message) == data
    assert decode(data) == message


def test_every_declared_code_has_bytes_of_somebody_else() -> None:
    by_hand = {message.code for message, _ in BODIES} | {kind.code for kind, *_ in VERSIONED}
    assert {golden.message.code for golden in GOLDEN} | by_hand >= MESSAGES.keys()
