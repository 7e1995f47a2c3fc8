"""Captures: datagrams with their time and addresses, in the pcap format that Wireshark opens and writes.

``Recorder`` writes a file; what it is made of are bytes: ``PCAP_HEADER`` once, then ``pcap_record`` for each
datagram. Of what others have captured, UDP over IPv4 is read, from Ethernet or bare.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from ipaddress import IPv4Address
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from jaus.errors import DecodeError, EncodeError

Place = tuple[str, int]
"""IPv4 address and UDP port."""

_MAGIC = 0xA1B2C3D4
_MAGIC_NANOSECONDS = 0xA1B23C4D
_ETHERNET, _RAW_IP = 1, 101
_ETHERNET_HEADER_SIZE = 14
_IPV4_ON_ETHERNET = b"\x08\x00"
_UDP = 17
_MAX_RECORD_SIZE = 65535
_IP_HEADER = struct.Struct(">BBHHHBBH4s4s")
_UDP_HEADER = struct.Struct(">HHHH")

PCAP_HEADER = struct.pack("<IHHiIII", _MAGIC, 2, 4, 0, 0, _MAX_RECORD_SIZE, _RAW_IP)
"""What a capture begins with."""


class Captured(NamedTuple):
    """A datagram on its way."""

    time_s: float
    """Seconds since 1970, or since the beginning of a simulation."""
    source: Place
    destination: Place
    datagram: bytes


def pcap_record(captured: Captured) -> bytes:
    """Return a datagram as a record of a capture.

    Raises:
        EncodeError: The time is negative, an address is none, or the datagram is too large for UDP.
    """
    try:
        udp = _UDP_HEADER.pack(
            captured.source[1], captured.destination[1], _UDP_HEADER.size + len(captured.datagram), 0
        )
        addresses = [IPv4Address(place[0]).packed for place in (captured.source, captured.destination)]
        size = _IP_HEADER.size + len(udp) + len(captured.datagram)
        ip = _IP_HEADER.pack(0x45, 0, size, 0, 0, 64, _UDP, 0, *addresses)
        ip = ip[:10] + _checksum(ip).to_bytes(2, "big") + ip[12:]
        seconds, microseconds = divmod(round(captured.time_s * 1e6), 1_000_000)
        head = struct.pack("<IIII", seconds, microseconds, size, size)
    except (struct.error, ValueError, OverflowError) as error:
        raise EncodeError(f"record of a capture: {error}") from None
    return head + ip + udp + captured.datagram


class Recorder:
    """A capture under way: a file that has each datagram from its recording on, in whole records.

    Args:
        path: The file; what it held is lost.

    Raises:
        OSError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("wb")
        self._file.write(PCAP_HEADER)
        self._file.flush()

    def record(self, datagram: bytes, source: Place, destination: Place, time_s: float) -> None:
        """Append a datagram.

        Args:
            datagram: As it was sent or received.
            source: From where.
            destination: To where.
            time_s: Seconds since 1970, or since the beginning of a simulation.

        Raises:
            EncodeError: As with ``pcap_record``; nothing is written.
            OSError: The file cannot be written.
        """
        self._file.write(pcap_record(Captured(time_s, source, destination, datagram)))
        self._file.flush()

    def close(self) -> None:
        """End the file; a second time does nothing."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_pcap(data: bytes) -> Iterator[Captured]:
    """Return the UDP datagrams of a capture; what is something else is passed over.

    Raises:
        DecodeError: It is no capture, of a kind that is not read, or cut short.
    """
    order, fraction, link = _form_of(data)
    record = struct.Struct(f"{order}IIII")
    begin = len(PCAP_HEADER)
    while begin < len(data):
        try:
            seconds, parts, size, _ = record.unpack_from(data, begin)
        except struct.error:
            raise DecodeError(f"capture: cut short after {len(data)} bytes") from None
        begin += record.size
        frame = data[begin : begin + size]
        if len(frame) < size:
            raise DecodeError(f"capture: cut short after {len(data)} bytes")
        begin += size
        found = udp_in_ethernet(frame) if link == _ETHERNET else _udp_of(frame)
        if found is not None:
            yield Captured(seconds + parts * fraction, *found)


def udp_in_ethernet(frame: bytes) -> tuple[Place, Place, bytes] | None:
    """Return (source, destination, datagram) of an Ethernet frame, None if it holds no UDP over IPv4."""
    return _udp_of(frame[_ETHERNET_HEADER_SIZE:]) if frame[12:14] == _IPV4_ON_ETHERNET else None


def _form_of(data: bytes) -> tuple[str, float, int]:
    """Return byte order, size of a part of a second, and link type."""
    for order in "<>":
        for magic, fraction in ((_MAGIC, 1e-6), (_MAGIC_NANOSECONDS, 1e-9)):
            if len(data) >= len(PCAP_HEADER) and data.startswith(struct.pack(f"{order}I", magic)):
                (link,) = struct.unpack_from(f"{order}I", data, 20)
                if link not in {_ETHERNET, _RAW_IP}:
                    raise DecodeError(f"capture: link type {link}, expected 1 (Ethernet) or 101 (IP)")
                return order, fraction, link
    raise DecodeError("capture: it does not begin as a pcap file does (pcapng is not read)")


def _udp_of(packet: bytes) -> tuple[Place, Place, bytes] | None:
    if len(packet) < _IP_HEADER.size or packet[0] >> 4 != 4 or packet[9] != _UDP:
        return None
    begin = (packet[0] & 15) * 4
    source, destination = (str(IPv4Address(packet[at : at + 4])) for at in (12, 16))
    try:
        source_port, destination_port, size, _ = _UDP_HEADER.unpack_from(packet, begin)
    except struct.error:
        return None
    datagram = packet[begin + _UDP_HEADER.size : begin + size]
    return (source, source_port), (destination, destination_port), datagram


def _checksum(header: bytes) -> int:
    total = sum(int.from_bytes(header[at : at + 2], "big") for at in range(0, len(header), 2))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF
