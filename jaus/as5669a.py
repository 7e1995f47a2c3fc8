"""Messages framed as AS5669A has it, which SAE JAUS uses, to RA packets and back.

Addresses have 16 bits for the subsystem and none for an instance; there are four priorities, and no flags for
service connections and experimental codes.
"""

from __future__ import annotations

from struct import Struct

from jaus.errors import DecodeError, EncodeError
from jaus.header import ANSWER_BIT, HEADER_LAYOUT, HEADER_SIZE, MAX_BODY_SIZE, DataFlag, MessageProperties

SAME_IN_SAE = frozenset(
    {0x0001, 0x0002, 0x0003, 0x0004, 0x0005, 0x0006, 0x0007, 0x000D, 0x000E, 0x000F, 0x0011}
    | {0x2001, 0x2002, 0x200D, 0x2011, 0x2202, 0x2402, 0x2403, 0x2404, 0x2405, 0x2B00}
    | {0x4001, 0x4002, 0x4011, 0x4202}
)
"""Codes whose body is the same in SAE JAUS."""

_HEADER = Struct("<BHBIIH")
"""Type and header compression, length, control, destination, source, command code."""
_RA_DATA_FLAGS = (DataFlag.SINGLE, DataFlag.FIRST, DataFlag.NORMAL, DataFlag.LAST)
"""By the data flag of AS5669A."""
_DATA_FLAGS: dict[int, int] = {flag.value: number for number, flag in enumerate(_RA_DATA_FLAGS)}
_DATA_FLAGS[DataFlag.RETRANSMITTED.value] = 2
_BROADCAST_PART = 255
_BROADCAST_SUBSYSTEM = 0xFFFF


def ra_packet(frame: bytes) -> bytes:
    """Return the RA packet of one message framed as AS5669A has it; the body is not touched.

    Raises:
        DecodeError: It has no form in RA: too large, header compression, or a subsystem beyond 254.
    """
    kind, _, control, destination, source, code = _HEADER.unpack_from(frame)
    if kind:
        raise DecodeError(f"AS5669A message: type and header compression {kind:#04x} are not supported")
    body = frame[_HEADER.size : -2]
    if len(body) > MAX_BODY_SIZE:
        raise DecodeError(f"AS5669A message: a body of {len(body)} bytes, expected {MAX_BODY_SIZE} at most")
    flag = _RA_DATA_FLAGS[control >> 6]
    word = (control & 3) * 3 + 3 | control & 0x30 | MessageProperties().word & 0xFF00
    size = len(body) | flag << 12
    sequence = int.from_bytes(frame[-2:], "little")
    return HEADER_LAYOUT.pack(word, code, _ra_id(destination), _ra_id(source), size, sequence) + body


def _ra_id(jaus_id: int) -> int:
    subsystem = jaus_id >> 16
    if subsystem >= _BROADCAST_PART and subsystem != _BROADCAST_SUBSYSTEM:
        raise DecodeError(
            f"AS5669A message: subsystem {subsystem} has no address in RA JAUS, expected 254 at most"
        )
    return (subsystem & 0xFF) << 24 | (jaus_id >> 8 & 0xFF) << 16 | (jaus_id & 0xFF) << 8 | 1


def _sae_id(jaus_id: int) -> int:
    subsystem = jaus_id >> 24
    if subsystem == _BROADCAST_PART:
        subsystem = _BROADCAST_SUBSYSTEM
    return subsystem << 16 | jaus_id >> 8 & 0xFFFF


def framed(packet: bytes) -> bytes:
    """Return an RA packet framed as AS5669A has it.

    Raises:
        EncodeError: The body would mean something else in SAE JAUS, or the data flag is none.
    """
    word, code, destination, source, size, sequence = HEADER_LAYOUT.unpack_from(packet)
    if code not in SAME_IN_SAE and not word & ANSWER_BIT:
        raise EncodeError(f"message {code:#06x}: its body in SAE JAUS is another one, not declared here")
    flag = _DATA_FLAGS.get(size >> 12)
    if flag is None:
        raise EncodeError(f"message {code:#06x}: got data flag {size >> 12}, expected {[*_DATA_FLAGS]}")
    priority = max(0, min(3, (word & 15) // 3 - 1))
    everywhere = destination >> 24 == _BROADCAST_PART
    several = _BROADCAST_PART in (destination >> 16 & 0xFF, destination >> 8 & 0xFF)
    broadcast = 2 if everywhere else 1 if several else 0
    control = priority | broadcast << 2 | word & 0x30 | flag << 6
    body = packet[HEADER_SIZE:]
    length = _HEADER.size + len(body) + 2
    header = _HEADER.pack(0, length, control, _sae_id(destination), _sae_id(source), code)
    return b"".join((header, body, sequence.to_bytes(2, "little")))
