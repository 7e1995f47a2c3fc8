"""Framings, several messages per datagram, acknowledgements, large messages (XGV-56)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaus.address import JausAddress
from jaus.codec import decode, encode, encode_parts
from jaus.errors import DecodeError, EncodeError
from jaus.header import Acknowledgement, DataFlag, Header
from jaus.messages import Ack, MessagePart, UnknownMessage
from jaus.messages.core import ReportHeartbeatPulse, RequestComponentControl, Resume
from jaus.messages.discovery import QueryIdentification, ReportIdentification
from jaus.messages.events import Event
from jaus.packet import (
    Framing,
    acknowledgement,
    decode_packet,
    pack_datagrams,
    unpack_datagram,
    unpack_until_flaw,
)
from jaus.reassembly import Reassembly
from tests.jaus.golden import GOLDEN

PD = JausAddress(1, 1, 33, 1)
CLIENT = JausAddress(1, 2, 4, 1)
EVERYWHERE = JausAddress(255, 255, 1, 1)
RA_FRAMINGS = [Framing.JUDP1, Framing.OPC]

RESUME = bytes.fromhex("06020400012101020104020200000701")
JUDP1 = "01 0000 0010"
OPC = "4a41555330312e30"
QUERY_IDENTIFICATION = "00 1100 01 01015a00 01010300 002b 02 0100"
"""As a node manager of SAE JAUS sends it: from 3.1.1 to 90.1.1, sequence number 1."""


@pytest.mark.parametrize(
    ("framing", "text"),
    [(Framing.JUDP1, f"{JUDP1} {RESUME.hex()}"), (Framing.OPC, OPC + RESUME.hex())],
)
def test_a_message_in_its_framing(framing: Framing, text: str) -> None:
    """The bytes are those of an independent implementation."""
    datagram = bytes.fromhex(text)
    assert unpack_datagram(datagram) == (framing, [RESUME])
    assert pack_datagrams(framing, [RESUME]) == [datagram]


def test_an_sae_message_in_its_framing() -> None:
    datagram = bytes.fromhex("02" + QUERY_IDENTIFICATION)
    framing, (packet,) = unpack_datagram(datagram)
    assert framing is Framing.AS5669A
    expected = QueryIdentification(2).to(JausAddress(90, 1, 1, 1), source=JausAddress(3, 1, 1, 1), sequence=1)
    assert decode_packet(framing, packet) == expected
    assert pack_datagrams(framing, [packet]) == [datagram]


@pytest.mark.parametrize("framing", RA_FRAMINGS)
def test_every_golden_message_passes_every_framing(framing: Framing) -> None:
    packets = [golden.data for golden in GOLDEN]
    for count in (1, 5):
        datagrams = pack_datagrams(framing, packets, max_messages=count)
        assert len(datagrams) == -(-len(packets) // count)
        unpacked = [unpack_datagram(datagram) for datagram in datagrams]
        assert {found for found, _ in unpacked} == {framing}
        assert [packet for _, several in unpacked for packet in several] == packets


def test_messages_share_a_datagram_only_while_there_is_room() -> None:
    packet = encode(UnknownMessage(0x2801, bytes(300), header=Header(PD, CLIENT)))
    datagrams = pack_datagrams(Framing.JUDP1, [packet] * 7, max_messages=5)
    assert [len(unpack_datagram(datagram)[1]) for datagram in datagrams] == [3, 3, 1]
    assert max(map(len, datagrams)) < 996
    alone = encode(UnknownMessage(0x2801, bytes(4080), header=Header(PD, CLIENT)))
    sizes = [len(datagram) for datagram in pack_datagrams(Framing.JUDP1, [packet, alone], max_messages=5)]
    assert sizes == [321, 4101]


def test_zeros_behind_the_last_judp_message_are_padding() -> None:
    """A public client sends and reads zero-filled buffers."""
    datagram = pack_datagrams(Framing.JUDP1, [RESUME, RESUME], max_messages=2)[0]
    for zeros in (1, 2, 3, 4, 500):
        assert unpack_datagram(datagram + bytes(zeros)) == (Framing.JUDP1, [RESUME, RESUME])


def test_a_length_of_zero_ends_a_judp_datagram() -> None:
    """A public client of the XGV reads until there: what lies behind in its buffer is left from before."""
    datagram = bytes.fromhex(f"{JUDP1} {RESUME.hex()} 0000 0000") + b"left from before"
    assert unpack_datagram(datagram) == (Framing.JUDP1, [RESUME])
    with pytest.raises(DecodeError, match="JUDP1 datagram without a message"):
        unpack_datagram(bytes.fromhex(f"01 0000 0000 0000 0010 {RESUME.hex()}"))


@pytest.mark.parametrize("framing", list(Framing))
def test_what_lies_before_a_flaw_can_be_had(framing: Framing) -> None:
    packets = [encode(ReportHeartbeatPulse().to(PD, source=CLIENT, sequence=number)) for number in range(5)]
    (datagram,) = pack_datagrams(framing, packets, max_messages=5)
    assert unpack_until_flaw(datagram, 5) == (framing, packets, None)
    _, before, flaw = unpack_until_flaw(datagram[:-1])
    assert before == packets[:4]
    assert flaw is not None
    assert unpack_until_flaw(datagram, 3) == (
        framing,
        packets[:3],
        f"{framing.name} datagram: more than 3 messages",
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "begins with nothing, expected 01, 02 or JAUS01.0"),
        ("03 00", "begins with 03 00"),
        ("4a41555330322e30", "begins with 4a 41 55 53 30 32 2e 30"),
        ("01", "JUDP1 datagram without a message"),
        ("02", "AS5669A datagram without a message"),
        (OPC, "OPC datagram without a message"),
        (f"01 0100 0010 {RESUME.hex()}", "header compression 0x0100 is not supported"),
        (f"01 0000 0011 {RESUME.hex()}", "a message of 17 bytes where 16 are left"),
        (f"01 0000 000f {RESUME.hex()}", "a message of 15 bytes where 16 are left"),
        (f"01 0000 1000 {RESUME.hex()}", "a message of 4096 bytes where 16 are left"),
        (f"{JUDP1} {RESUME.hex()} 00 00 01", "3 bytes behind the last message"),
        (OPC + RESUME.hex()[:-2], "a message of 16 bytes where 15 are left"),
        (OPC + RESUME.hex() + "06", "a message of 16 bytes where 1 are left"),
        ("02 00 1200 01 01015a00 01010300 002b 02 0100", "a message of 18 bytes where 17 are left"),
        ("02 01 1100 01 01015a00 01010300 002b 02 0100", "header compression 0x01 are not supported"),
        ("02 00 1100 01 01012c01 01010300 002b 02 0100", "subsystem 300 has no address in RA JAUS"),
    ],
)
def test_a_datagram_that_is_none(text: str, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        unpack_datagram(bytes.fromhex(text))


@given(st.sampled_from(Framing), st.binary(max_size=80))
def test_any_datagram_is_packets_or_a_decode_error(framing: Framing, rest: bytes) -> None:
    try:
        found, packets = unpack_datagram(framing.value + rest)
    except DecodeError:
        return
    assert found is framing
    for packet in packets:
        try:
            decode_packet(framing, packet)
            acknowledgement(packet)
        except DecodeError:
            continue


def test_what_means_something_else_in_sae_is_never_decoded_as_ra() -> None:
    """Efforts are unsigned there: read as RA's, no throttle would be full throttle."""
    datagram = bytes.fromhex("02 00 1400 01 21015a00 01010300 0504 0100 ff7f 0100")
    framing, (packet,) = unpack_datagram(datagram)
    message = decode_packet(framing, packet)
    assert isinstance(message, UnknownMessage)
    assert (message.code, message.body) == (0x0405, bytes.fromhex("0100 ff7f"))
    assert message.header.destination == JausAddress(90, 1, 33, 1)
    with pytest.raises(EncodeError, match=r"0x0405: its body in SAE JAUS is another one"):
        pack_datagrams(framing, [packet])


def test_a_large_message_that_means_something_else_in_sae_stays_in_parts() -> None:
    """Its first part is not the whole message; put together it still is not read as RA's."""
    head = "01010100 04020100 0544"
    frames = [
        f"02 00 1400 41 {head} 0100 0000 0000",
        f"02 00 1200 81 {head} ff7f 0100",
        f"02 00 1200 c1 {head} aabb 0200",
    ]
    found = [decode_packet(Framing.AS5669A, unpack_datagram(bytes.fromhex(each))[1][0]) for each in frames]
    assert [part.data_flag for part in found if isinstance(part, MessagePart)] == [
        *(DataFlag.FIRST, DataFlag.NORMAL, DataFlag.LAST)
    ]
    reassembly = Reassembly()
    *none, whole = (reassembly.add(part) for part in found if isinstance(part, MessagePart))
    assert none == [None, None]
    assert isinstance(whole, UnknownMessage)
    assert (whole.code, whole.body) == (0x4405, bytes.fromhex("0100 0000 ff7f aabb"))


def test_a_data_flag_that_is_none_is_a_decode_error() -> None:
    packet = bytes.fromhex("06020544012101020104020200300701 0000")
    with pytest.raises(DecodeError, match="3 is not a valid DataFlag"):
        decode_packet(Framing.AS5669A, packet)
    with pytest.raises(EncodeError, match="0x0004: got data flag 3, expected"):
        pack_datagrams(Framing.AS5669A, [RESUME[:13] + b"\x30" + RESUME[14:]])


@pytest.mark.parametrize(
    ("destination", "bits"), [(PD, 0), (JausAddress(1, 255, 1, 1), 1), (JausAddress(255, 255, 1, 1), 2)]
)
def test_sae_broadcasts_are_marked(destination: JausAddress, bits: int) -> None:
    packet = encode(ReportHeartbeatPulse().to(destination, source=CLIENT, sequence=5))
    (datagram,) = pack_datagrams(Framing.AS5669A, [packet])
    assert datagram[4] >> 2 & 3 == bits
    message = decode_packet(*[Framing.AS5669A, unpack_datagram(datagram)[1][0]])
    assert message == ReportHeartbeatPulse().to(destination, source=CLIENT, sequence=5)


def test_acknowledgements_in_every_framing() -> None:
    """The same code, sequence number and priority, addresses swapped, nothing behind."""
    request = RequestComponentControl(6).to(
        PD, source=CLIENT, sequence=9, acknowledgement=Acknowledgement.REQUESTED
    )
    for framing in Framing:
        (datagram,) = pack_datagrams(framing, [encode(request)])
        packet = unpack_datagram(datagram)[1][0]
        for positive in (True, False):
            answer = acknowledgement(packet, positive=positive)
            assert answer is not None
            (back,) = pack_datagrams(framing, [answer])
            ack = decode_packet(framing, unpack_datagram(back)[1][0])
            assert isinstance(ack, Ack)
            assert (ack.code, ack.sequence, ack.positive) == (0x000D, 9, positive)
            assert (ack.header.destination, ack.header.source) == (CLIENT, PD)


def test_an_sae_message_that_is_not_declared_can_be_acknowledged() -> None:
    datagram = bytes.fromhex("02 00 1000 11 21015a00 01010300 5afe 0300")
    framing, (packet,) = unpack_datagram(datagram)
    answer = acknowledgement(packet)
    assert answer is not None
    (back,) = pack_datagrams(framing, [answer])
    assert isinstance(decode_packet(framing, unpack_datagram(back)[1][0]), Ack)


def test_who_wants_no_acknowledgement_gets_none() -> None:
    assert acknowledgement(RESUME) is None
    for acknowledged in (Acknowledgement.POSITIVE, Acknowledgement.NEGATIVE):
        assert acknowledgement(encode(Resume().to(PD, source=CLIENT, acknowledgement=acknowledged))) is None


def test_a_broadcast_is_not_acknowledged() -> None:
    wanted = Acknowledgement.REQUESTED
    packet = encode(Resume().to(EVERYWHERE, source=CLIENT, acknowledgement=wanted))
    assert acknowledgement(packet) is None


def test_a_message_that_cannot_be_decoded_gets_a_nak() -> None:
    packet = bytes.fromhex("16020d00012101020104020202000701 0600")
    with pytest.raises(DecodeError):
        decode(packet)
    answer = acknowledgement(packet, positive=False)
    assert answer == bytes.fromhex("26020d00010402020121010200000701")


def test_without_a_header_there_is_nobody_to_answer() -> None:
    with pytest.raises(DecodeError, match="got 15 bytes"):
        acknowledgement(RESUME[:15])


LARGE = Event(1, 0x4002, 0, bytes(range(256)) * 40)


def parts(size: int = 4080, message: Event = LARGE) -> list[MessagePart]:
    found = [decode(packet) for packet in encode_parts(message.to(CLIENT, source=PD), size)]
    assert all(isinstance(part, MessagePart) for part in found)
    return found  # type: ignore[return-value]


def test_a_large_message_goes_in_parts() -> None:
    found = parts()
    assert [len(part.body) for part in found] == [4080, 4080, 2088]
    assert [part.data_flag for part in found] == [DataFlag.FIRST, DataFlag.NORMAL, DataFlag.LAST]
    assert [part.header.sequence for part in found] == [0, 1, 2]
    reassembly = Reassembly()
    assert [reassembly.add(part) for part in found[:-1]] == [None, None]
    assert reassembly.add(found[-1]) == LARGE
    assert len(reassembly) == 0


def test_a_message_that_fits_is_one_packet() -> None:
    message = Resume().to(PD, source=CLIENT)
    assert encode_parts(message) == [encode(message)]


@pytest.mark.parametrize("lost", [1, 2, 3])
def test_a_gap_drops_the_message(lost: int) -> None:
    found = parts(2000)
    reassembly = Reassembly()
    assert [reassembly.add(part) for part in found[:lost]] == [None] * lost
    with pytest.raises(DecodeError, match=f"large message 0x41f1: part {lost + 1} .*, expected part {lost} "):
        reassembly.add(found[lost + 1])
    assert [reassembly.add(part) for part in found[lost + 2 :]] == [None] * (4 - lost)
    assert (len(reassembly), reassembly.dropped) == (0, 1)
    assert [reassembly.add(part) for part in parts(2000)][-1] == LARGE


def test_a_part_that_comes_twice_is_taken_once() -> None:
    found = parts()
    found[1:1] = [MessagePart(0x41F1, found[0].body, DataFlag.RETRANSMITTED, header=found[0].header)]
    reassembly = Reassembly()
    assert [reassembly.add(part) for part in found][-1] == LARGE


def test_parts_of_two_senders_do_not_mix() -> None:
    other = parts()
    for part in other:
        part.header = Header(CLIENT, JausAddress(2, 1, 33, 1), part.header.sequence)
    reassembly = Reassembly()
    both = [reassembly.add(part) for pair in zip(parts(), other, strict=True) for part in pair]
    assert [message is not None for message in both] == [False] * 4 + [True] * 2


def test_parts_to_two_destinations_do_not_mix() -> None:
    other = parts()
    for part in other:
        part.header = Header(JausAddress(1, 3, 4, 1), PD, part.header.sequence)
    reassembly = Reassembly()
    both = [reassembly.add(part) for pair in zip(parts(), other, strict=True) for part in pair]
    whole = [message.header.destination for message in both if message is not None]
    assert whole == [CLIENT, JausAddress(1, 3, 4, 1)]


def test_a_message_that_begins_anew_takes_the_place_of_the_one_before() -> None:
    reassembly = Reassembly()
    assert [reassembly.add(part) for part in [parts()[0], *parts()]][-1] == LARGE
    assert reassembly.dropped == 1


def test_sequence_numbers_run_on_over_their_end() -> None:
    found = parts()
    for number, part in enumerate(found):
        part.header = part.header.with_sequence((65534 + number) & 0xFFFF)
    reassembly = Reassembly()
    assert [reassembly.add(part) is None for part in found] == [True, True, False]


def test_limits_bound_what_a_stranger_can_make_it_keep() -> None:
    reassembly = Reassembly(max_size=9000, max_messages=2)
    assert [reassembly.add(part) for part in parts()[:2]] == [None] * 2
    with pytest.raises(DecodeError, match="with 10248 bytes so far, expected part 2 and 9000 bytes at most"):
        reassembly.add(parts()[2])
    assert (len(reassembly), reassembly.size) == (0, 0)
    for subsystem in range(1, 6):
        (first, *_) = parts()
        first.header = Header(CLIENT, JausAddress(subsystem, 1, 33, 1))
        reassembly.add(first)
        assert len(reassembly) <= 2
        assert reassembly.size <= 2 * 4080
    assert reassembly.dropped == 1 + 3


def test_a_large_message_with_a_wrong_body_is_a_decode_error() -> None:
    whole = ReportIdentification(2, 0, 10001, "SIMULATED").to(CLIENT, source=PD)
    found = [decode(packet) for packet in encode_parts(whole, 40)]
    reassembly = Reassembly()
    for part in found:
        assert isinstance(part, MessagePart)
    found[-1].body += b"\0"  # type: ignore[union-attr, operator]
    assert [reassembly.add(part) for part in found[:-1]] == [None, None]  # type: ignore[arg-type]
    with pytest.raises(DecodeError, match=r"ReportIdentification \(0x4b00\) with a body of 85 bytes"):
        reassembly.add(found[-1])  # type: ignore[arg-type]


def test_a_part_without_a_beginning_is_passed_over() -> None:
    assert Reassembly().add(parts()[-1]) is None
