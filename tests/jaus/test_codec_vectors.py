"""Bytes of two other implementations, both ways, whole, cut and with more behind them (XGV-55 to XGV-61)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from jaus.address import JausAddress
from jaus.codec import decode, encode
from jaus.errors import DecodeError
from jaus.fields import RestOfBody, Scaled
from jaus.header import HEADER_SIZE, Header
from jaus.messages import Ack, Message, UnknownMessage
from jaus.messages.torc import Motion, SetMotionProfile
from tests.jaus.golden import GOLDEN, Golden

ADDRESS = JausAddress(1, 2, 3, 4)

CAPTURE = Path(__file__).parents[3] / "shared" / "vectors" / "ra3_capture.json"


def name(golden: Golden) -> str:
    return f"{type(golden.message).__name__}-{golden.data[HEADER_SIZE:].hex()}"


def negative_values(message: object) -> int:
    fields = message.fields if isinstance(message, Message) else ()
    signed = [field for field in fields if isinstance(field.kind, Scaled) and field.kind.signed]
    return sum((getattr(message, field.name) or 0.0) < 0.0 for field in signed)


@pytest.mark.parametrize("golden", GOLDEN, ids=name)
def test_the_values_become_the_bytes(golden: Golden) -> None:
    data = encode(golden.message)
    differing = [(ours, theirs) for ours, theirs in zip(data, golden.data, strict=True) if ours != theirs]
    assert len(differing) <= negative_values(golden.message)
    assert all(abs(ours - theirs) == 1 for ours, theirs in differing)


@pytest.mark.parametrize("golden", GOLDEN, ids=name)
def test_the_bytes_become_the_values(golden: Golden) -> None:
    message = decode(golden.data)
    assert type(message) is type(golden.message)
    assert message.header == golden.message.header
    for field in message.fields if isinstance(message, Message) else ():
        value, expected = getattr(message, field.name), getattr(golden.message, field.name)
        if isinstance(field.kind, Scaled) and expected is not None:
            assert value == pytest.approx(expected, abs=1.5 * field.kind.scale), field.name
        elif field.name != "motions":
            assert value == expected, field.name


@pytest.mark.parametrize("golden", GOLDEN, ids=name)
def test_what_was_decoded_is_encoded_to_the_same_bytes(golden: Golden) -> None:
    assert encode(decode(golden.data)) == golden.data


def captured() -> list[bytes]:
    if not CAPTURE.exists():
        pytest.skip("the capture of a real RA 3.x vehicle is not part of the repository")
    return [bytes.fromhex(packet["message_hex"]) for packet in json.loads(CAPTURE.read_text())]


def test_a_real_capture_decodes_and_is_encoded_to_the_same_bytes() -> None:
    """A third implementation, with presence bits and codes that TORC does not use."""
    packets = captured()
    messages = [decode(data) for data in packets]
    assert [encode(message) for message in messages] == packets
    kinds = [type(message).__name__ for message in messages]
    assert (kinds.count("UnknownMessage"), kinds.count("Ack"), len(kinds)) == (18, 3, 44)
    unknown = {message.code for message in messages if isinstance(message, UnknownMessage)}
    assert unknown == {0x0801, 0x0802, 0x040C, 0x2801, 0x2805, 0x4401, 0x4800, 0x4801, 0x4805}


def test_a_real_vehicles_specifications_make_sense() -> None:
    (report,) = (message for message in map(decode, captured()) if message.code == 0x4400)
    assert report.name == "DEFENDER2"  # type: ignore[union-attr]
    assert report.wheel_base_m == pytest.approx(2.13)  # type: ignore[union-attr]
    assert report.track_m == pytest.approx(1.14)  # type: ignore[union-attr]
    assert report.max_velocity_x_mps == pytest.approx(14.0)  # type: ignore[union-attr]


def resized(data: bytes) -> bytes:
    """Return the message with the size in its header set to what is there."""
    control = int.from_bytes(data[12:14], "little") & 0xF000 | len(data) - HEADER_SIZE
    return data[:12] + control.to_bytes(2, "little") + data[14:]


@pytest.mark.parametrize("golden", GOLDEN, ids=name)
def test_cut_at_every_length_it_is_no_message(golden: Golden) -> None:
    for length in range(len(golden.data)):
        with pytest.raises(DecodeError):
            decode(golden.data[:length])
        if length >= HEADER_SIZE:
            with pytest.raises(DecodeError):
                decode(resized(golden.data[:length]))


@pytest.mark.parametrize("golden", GOLDEN, ids=name)
@pytest.mark.parametrize("more", [b"\0", b"\xff", bytes(17)], ids=len)
def test_with_trailing_bytes_it_is_no_message(golden: Golden, more: bytes) -> None:
    with pytest.raises(DecodeError):
        decode(golden.data + more)
    kinds = {type(field.kind) for field in getattr(golden.message, "fields", ())}
    assert RestOfBody not in kinds
    with pytest.raises(DecodeError):
        decode(resized(golden.data + more))


def test_an_acknowledgement_says_which_message_it_answers() -> None:
    request, answer = GOLDEN[4], GOLDEN[5]
    acknowledged = decode(answer.data)
    assert acknowledged == Ack(0x0004, 263, header=answer.message.header)
    assert isinstance(request.message.header, Header)
    assert request.message.header.destination == acknowledged.header.source


@pytest.mark.parametrize("count", [0, 2, 3, 255])
def test_a_body_as_long_as_one_item_needs_has_one_item(count: int) -> None:
    """Such a body is decoded all at once; one that says otherwise is wrong all the same."""
    one = encode(SetMotionProfile(motions=(Motion(5.0, 2.0, 0.1, 0.06, 400),)).to(ADDRESS, source=ADDRESS))
    wrong = one[: HEADER_SIZE + 1] + bytes([count]) + one[HEADER_SIZE + 2 :]
    with pytest.raises(DecodeError):
        decode(wrong)


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_lists_of_any_length_come_back(count: int) -> None:
    motions = tuple(Motion(float(number), 2.0, 0.1, 0.06, 400) for number in range(count))
    back = decode(encode(SetMotionProfile(motions=motions).to(ADDRESS, source=ADDRESS)))
    assert isinstance(back, SetMotionProfile)
    assert [round(motion.speed_mps) for motion in back.motions] == list(range(count))
