"""Every declared message with every value, there and back; and bytes that nobody meant."""

from __future__ import annotations

import struct
from copy import deepcopy

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaus.address import JausAddress
from jaus.codec import decode, decode_body, encode, encode_body
from jaus.errors import DecodeError, EncodeError
from jaus.fields import (
    Counted,
    Integer,
    Kind,
    Nested,
    RestOfBody,
    Scaled,
    SizedBytes,
    Tagged,
    TerminatedText,
    Text,
)
from jaus.header import UNADDRESSED, Acknowledgement, Header, MessageProperties
from jaus.messages import MESSAGES, Ack, Message, MessagePart, UnknownMessage
from jaus.messages.core import RequestComponentControl, Resume
from jaus.messages.platform import ReportVelocityState
from jaus.messages.torc import Motion, SetMotionProfile

OWN = JausAddress(1, 1, 33, 1)
CLIENT = JausAddress(1, 2, 4, 1)


def values(kind: Kind) -> st.SearchStrategy[object]:  # noqa: PLR0911 - one per kind
    """Return every value that has a representation on the wire."""
    match kind:
        case Integer():
            size = 8 * struct.calcsize(kind.format)
            low = -(1 << size - 1) if kind.format.islower() else 0
            return st.integers(low, low + (1 << size) - 1)
        case Scaled():
            return st.integers(*kind.raw_bounds).map(lambda raw: raw * kind.scale + kind.bias)
        case Text():
            return st.text(LETTERS, max_size=kind.size)
        case TerminatedText():
            return st.text(LETTERS, max_size=20)
        case SizedBytes() | RestOfBody():
            return st.binary(max_size=20)
        case Tagged():
            return st.one_of([tagged(tag, format_) for tag, format_ in enumerate(kind.formats)])
        case Counted():
            return st.lists(values(kind.item), max_size=4).map(tuple)
        case Nested():
            return st.builds(kind.record, **{field.name: values(field.kind) for field in kind.fields})


LETTERS = st.characters(min_codepoint=1, max_codepoint=255)


def tagged(tag: int, format_: str) -> st.SearchStrategy[object]:
    size = struct.calcsize("<" + format_)
    numbers = st.binary(min_size=size, max_size=size).map(lambda data: struct.unpack("<" + format_, data))
    single = numbers.map(lambda found: (tag, found if len(found) > 1 else found[0]))
    # NaN is not equal to itself.
    return single.filter(lambda pair: pair[1] == pair[1])


def messages(kind: type[Message]) -> st.SearchStrategy[Message]:
    fields = {
        field.name: values(field.kind) if field.bit is None else st.none() | values(field.kind)
        for field in kind.fields
    }
    return st.builds(kind, **fields)


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.__name__)
@settings(max_examples=15)
@given(data=st.data())
def test_every_message_goes_there_and_back(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(kind)).to(OWN, source=CLIENT, sequence=data.draw(st.integers(0, 65535)))
    there = encode(message)
    back = decode(there)
    assert back == message
    assert encode(back) == there


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.__name__)
@settings(max_examples=25)
@given(body=st.binary(max_size=70))
def test_any_body_is_a_message_or_a_decode_error(kind: type[Message], body: bytes) -> None:
    try:
        message = decode_body(kind.code, body, UNADDRESSED)
    except DecodeError:
        return
    again = encode_body(message)
    assert encode_body(decode_body(kind.code, again, UNADDRESSED)) == again


@settings(max_examples=200)
@given(data=st.binary(max_size=60))
def test_any_bytes_are_a_message_or_a_decode_error(data: bytes) -> None:
    try:
        message = decode(data)
    except DecodeError:
        return
    assert encode(message) == data


@given(
    word=st.integers(0, 0xFFFF),
    addresses=st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1)),
    sequence=st.integers(0, 65535),
    code=st.integers(0, 0xFFFF).filter(lambda code: code not in MESSAGES),
    flag=st.sampled_from([0, 1, 2, 4, 8]),
    body=st.binary(max_size=30),
)
def test_every_header_is_kept(
    word: int, addresses: tuple[int, int], sequence: int, code: int, flag: int, body: bytes
) -> None:
    is_answer = bool(word & 0x20)
    body, flag = (b"", 0) if is_answer else (body, flag)
    data = struct.pack("<HHIIHH", word, code, *addresses, len(body) | flag << 12, sequence) + body
    message = decode(data)
    assert isinstance(message, Ack if is_answer else MessagePart if flag else UnknownMessage)
    assert encode(message) == data
    header = message.header
    again = Header(header.destination, header.source, sequence, header.properties)
    assert (again.destination_id, again.source_id) == addresses
    assert again.properties_word == word & 0x3FFF


def test_a_signed_value_below_its_range_is_held_at_the_bound() -> None:
    """The one integer of a signed field that lies outside: -100 % is -32767."""
    message = decode_body(0x0405, bytes.fromhex("0100 0080"), UNADDRESSED)
    assert message.propulsive_linear_x_percent == -100.0  # type: ignore[union-attr]


def test_values_are_held_within_their_range() -> None:
    motion = Motion(1e9, -5.0, float("inf"), 3.0, 400)
    body = encode_body(SetMotionProfile(motions=(motion,)))
    assert body == bytes.fromhex("0101 ffff 0000 ffff cd4c 9001")


def test_unknown_presence_bits_are_passed_over_where_nothing_belongs_to_them() -> None:
    """A sender may set reserved bits; bytes of fields that are not declared are an error."""
    assert decode_body(0x4406, bytes.fromhex("f4 02"), UNADDRESSED).gear == 2  # type: ignore[union-attr]
    with pytest.raises(DecodeError, match="1 bytes more"):
        decode_body(0x4406, bytes.fromhex("f4 02 00"), UNADDRESSED)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (RequestComponentControl(256), r"RequestComponentControl\.authority: got 256, expected .* 0 to 255"),
        (RequestComponentControl(None), r"authority: got None, expected an integer"),  # type: ignore[arg-type]
        (RequestComponentControl("6"), r"authority: got '6', expected an integer"),  # type: ignore[arg-type]
        (ReportVelocityState(velocity_x_mps=float("nan")), r"velocity_x_mps: got nan, expected a number"),
        (
            SetMotionProfile(motions=(Motion(1.0, 1.0, 0.0, 1.0, 400), Motion(1.0, 1.0, 0.0, 1.0, 65536))),
            r"SetMotionProfile\.motions: item 1: duration_ms: got 65536",
        ),
        (SetMotionProfile(motions=(Motion(1.0, 1.0, 0.0, 1.0, 4),) * 256), r"motions: .* at most 255"),
        (UnknownMessage(0x2801, bytes(4081)), r"4081 bytes, expected 4080 at most"),
        (UnknownMessage(0x12801, b""), r"UnknownMessage: code or sequence number"),
    ],
)
def test_what_does_not_fit_is_told_by_name(message: Message, text: str) -> None:
    message.header = Header(OWN, CLIENT)
    with pytest.raises(EncodeError, match=text):
        encode(message)


def test_a_message_without_address_is_not_encoded() -> None:
    with pytest.raises(EncodeError, match=r"Resume: it has no header; address it with to"):
        encode(deepcopy(Resume()))
    with pytest.raises(EncodeError, match=r"Resume: it has no header; address it with to"):
        encode(Resume())


@pytest.mark.parametrize("sequence", [-1, 65536])
def test_a_sequence_number_that_does_not_fit_is_told(sequence: int) -> None:
    with pytest.raises(EncodeError, match="Resume: code or sequence number"):
        encode(Resume().to(OWN, source=CLIENT, sequence=sequence))


def test_what_is_no_message_is_not_encoded() -> None:
    with pytest.raises(EncodeError, match="str: not a declared message"):
        encode("Resume")  # type: ignore[arg-type]


def test_an_acknowledgement_is_empty() -> None:
    with pytest.raises(DecodeError, match="expected an empty one"):
        decode(bytes.fromhex("36020400010402020121010201000701 00"))


def test_a_nak_is_told_from_an_ack() -> None:
    answer = Ack(0x0004, 7, positive=False, header=Header(CLIENT, OWN))
    again = decode(encode(answer))
    assert isinstance(again, Ack)
    assert (again.positive, again.sequence, again.header.sequence) == (False, 7, 7)


def test_an_undefined_data_flag_is_an_error() -> None:
    with pytest.raises(DecodeError, match="got data flag 3, expected 0, 1, 2, 4, 8"):
        decode(bytes.fromhex("06020400010402020121010200300701"))


def test_experimental_and_service_connection_messages_say_so_by_default() -> None:
    marked = {kind.code for kind in MESSAGES.values() if kind.properties.service_connection}
    assert marked == {0x0008, 0x0009, 0x000A, 0x000B, 0x000C}
    experimental = {kind.code for kind in MESSAGES.values() if kind.properties.experimental}
    assert experimental == {code for code in MESSAGES if code >= 0xE000}
    assert MessageProperties().word == 0x0206
    assert MessageProperties(acknowledgement=Acknowledgement.REQUESTED, experimental=True).word == 0x0296
