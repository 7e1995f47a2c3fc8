"""Datagrams: which messages lie in them, and how they are framed (XGV-56).

Three framings share UDP port 3794, and the first byte tells which one a datagram has. Whatever the framing, a
*packet* here is one RA 3.3 message with its header, as ``jaus.decode`` takes it and ``jaus.encode`` makes it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from enum import Enum
from struct import Struct
from typing import NamedTuple

from jaus.as5669a import SAME_IN_SAE, framed, ra_packet
from jaus.codec import Decoded, decode
from jaus.errors import DecodeError
from jaus.header import (
    ACKNOWLEDGEMENT_BITS,
    ANSWER_BIT,
    HEADER_LAYOUT,
    HEADER_SIZE,
    Acknowledgement,
    DataFlag,
    Header,
)
from jaus.messages import MessagePart, UnknownMessage

PORT = 3794
"""The UDP port of all three framings."""
MAX_DATAGRAM_SIZE = 995
"""A public client of the XGV reads datagrams into a buffer of 1000 bytes and looks for a zero behind."""


class Framing(Enum):
    """How a datagram begins."""

    JUDP1 = b"\x01"
    """AS5669: before each message four bytes, the last two its length, big endian. The XGV's own."""
    OPC = b"JAUS01.0"
    """Before all messages this text, then one behind the other."""
    AS5669A = b"\x02"
    """SAE JAUS: a header of another form; not every code means the same, see ``decode_packet``."""


class Unpacked(NamedTuple):
    """What lies in a datagram."""

    framing: Framing
    packets: list[bytes]
    """The messages before what is wrong."""
    flaw: str | None
    """What is wrong, None for nothing."""


def unpack_datagram(datagram: bytes) -> tuple[Framing, list[bytes]]:
    """Return the framing of a datagram and its packets; in JUDP, a length of zero ends the datagram.

    Raises:
        DecodeError: No known framing, a message that is cut short, or header compression.
    """
    framing, packets, flaw = unpack_until_flaw(datagram)
    if flaw is not None:
        raise DecodeError(flaw)
    return framing, packets


def unpack_until_flaw(datagram: bytes, max_messages: int | None = None) -> Unpacked:
    """Return the packets of a datagram that lie before the first that is none.

    Args:
        datagram: As it arrived.
        max_messages: How many it may hold; one more is a flaw.

    Raises:
        DecodeError: No known framing.
    """
    framing = next((each for each in Framing if datagram.startswith(each.value)), None)
    if framing is None:
        raise DecodeError(
            f"datagram begins with {datagram[:8].hex(' ') or 'nothing'}, expected 01, 02 or JAUS01.0"
        )
    packets: list[bytes] = []
    try:
        for packet in _UNPACK[framing](datagram, len(framing.value)):
            if len(packets) == max_messages:
                return Unpacked(
                    framing, packets, f"{framing.name} datagram: more than {max_messages} messages"
                )
            packets.append(packet)
    except DecodeError as error:
        return Unpacked(framing, packets, str(error))
    return Unpacked(framing, packets, None if packets else f"{framing.name} datagram without a message")


def pack_datagrams(
    framing: Framing, packets: Iterable[bytes], *, max_messages: int = 1, max_size: int = MAX_DATAGRAM_SIZE
) -> list[bytes]:
    """Return datagrams with the packets, in order.

    Args:
        framing: How to frame them: as the peer does.
        packets: Messages with their headers.
        max_messages: How many may share a datagram; all framings allow several, not all peers do.
        max_size: How many bytes several of them may fill; one larger message goes alone.

    Raises:
        EncodeError: A message has no form in this framing.
    """
    datagrams: list[bytes] = []
    room = 0
    for packet in packets:
        framed = _PACK[framing](packet)
        if room > 0 and len(datagrams[-1]) + len(framed) <= max_size:
            datagrams[-1] += framed
            room -= 1
        else:
            datagrams.append(framing.value + framed)
            room = max_messages - 1
    return datagrams


def decode_packet(framing: Framing, packet: bytes) -> Decoded:
    """Return what a packet says that came with ``framing``.

    In SAE JAUS many codes have another body than in RA. They become ``UnknownMessage``, never a message with
    wrong values; what has the same body in both is decoded. A part of a large one says that it is one of
    those.

    Raises:
        DecodeError: As with ``jaus.decode``.
    """
    if framing is Framing.AS5669A:
        code, header = _header_of(packet)
        if code not in SAME_IN_SAE and not header.properties_word & ANSWER_BIT:
            flag = _data_flag_of(packet)
            if flag:
                return MessagePart(code, packet[HEADER_SIZE:], flag, is_sae=True, header=header)
            return UnknownMessage(code, packet[HEADER_SIZE:], header=header)
    return decode(packet)


def acknowledgement(packet: bytes, *, positive: bool = True) -> bytes | None:
    """Return the packet that acknowledges ``packet``, None if its sender wants none.

    It works for messages that cannot be decoded too, as long as their header is there: those deserve a NAK.
    Messages to more than one are never acknowledged.

    Raises:
        DecodeError: There is no whole header.
    """
    if len(packet) >= HEADER_SIZE and packet[0] & ACKNOWLEDGEMENT_BITS != _REQUESTED_BITS:
        return None
    code, header = _header_of(packet)
    if header.destination.is_broadcast:
        return None
    answer = header.reply(Acknowledgement.POSITIVE if positive else Acknowledgement.NEGATIVE)
    words = answer.destination_id, answer.source_id, 0, answer.sequence
    return HEADER_LAYOUT.pack(answer.properties_word, code, *words)


def destination_of(packet: bytes) -> int:
    """Return the JAUS id of whom a packet is for, whether or not it can be decoded."""
    return int.from_bytes(packet[4:8], "little")


def _header_of(packet: bytes) -> tuple[int, Header]:
    try:
        word, code, destination, source, _, sequence = HEADER_LAYOUT.unpack_from(packet)
    except struct.error:
        raise DecodeError(f"message: got {len(packet)} bytes, expected {HEADER_SIZE} or more") from None
    return code, Header.from_words(word, destination, source, sequence)


def _data_flag_of(packet: bytes) -> DataFlag:
    try:
        return DataFlag(packet[_CONTROL_HIGH_BYTE] >> 4)
    except ValueError as error:
        raise DecodeError(f"message: {error}") from None


def _unpack_judp1(datagram: bytes, begin: int) -> Iterator[bytes]:
    while begin < len(datagram):
        try:
            compression, length = _JUDP1_PREFIX.unpack_from(datagram, begin)
        except struct.error:
            if not any(datagram[begin:]):
                return
            raise DecodeError(
                f"JUDP1 datagram: {len(datagram) - begin} bytes behind the last message"
            ) from None
        if length == 0:  # A public client of the XGV reads until there; what lies behind is its old buffer.
            return
        if compression:
            raise DecodeError(f"JUDP1 datagram: header compression {compression:#06x} is not supported")
        begin += _JUDP1_PREFIX.size
        yield _piece(datagram, begin, length, "JUDP1")
        begin += length


def _unpack_opc(datagram: bytes, begin: int) -> Iterator[bytes]:
    while begin < len(datagram):
        control = int.from_bytes(datagram[begin + 12 : begin + 14], "little")
        length = HEADER_SIZE + (control & 0xFFF)
        yield _piece(datagram, begin, length, "OPC")
        begin += length


def _unpack_as5669a(datagram: bytes, begin: int) -> Iterator[bytes]:
    while begin < len(datagram):
        length = int.from_bytes(datagram[begin + 1 : begin + 3], "little")
        yield ra_packet(_piece(datagram, begin, length, "AS5669A"))
        begin += length


def _piece(datagram: bytes, begin: int, length: int, framing: str) -> bytes:
    if not HEADER_SIZE <= length <= len(datagram) - begin:
        raise DecodeError(
            f"{framing} datagram: a message of {length} bytes where {len(datagram) - begin} are left, "
            f"expected {HEADER_SIZE} or more and not more than are left"
        )
    return datagram[begin : begin + length]


def _framed_judp1(packet: bytes) -> bytes:
    return _JUDP1_PREFIX.pack(0, len(packet)) + packet


def _framed_opc(packet: bytes) -> bytes:
    return packet


_REQUESTED_BITS = Acknowledgement.REQUESTED << 4
_CONTROL_HIGH_BYTE = 13
"""Where in the header the data flag lies, in the four high bits."""
_JUDP1_PREFIX = Struct(">HH")
"""Header compression, length."""
_UNPACK: dict[Framing, Callable[[bytes, int], Iterator[bytes]]] = {
    Framing.JUDP1: _unpack_judp1,
    Framing.OPC: _unpack_opc,
    Framing.AS5669A: _unpack_as5669a,
}
_PACK: dict[Framing, Callable[[bytes], bytes]] = {
    Framing.JUDP1: _framed_judp1,
    Framing.OPC: _framed_opc,
    Framing.AS5669A: framed,
}
