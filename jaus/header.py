"""The 16 bytes before each RA 3.3 message, little endian (XGV-55)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from struct import Struct

from jaus.address import JausAddress
from jaus.errors import LocalProtocolError

HEADER_SIZE = 16
MAX_BODY_SIZE = 4080
"""Bytes after the header of one packet; what is longer goes in several packets."""
MAX_SEQUENCE = 0xFFFF
"""The sequence number after which 0 comes again."""
RA_3_3 = 2
"""The version field of RA 3.2 and 3.3."""

HEADER_LAYOUT = Struct("<HHIIHH")
"""Properties, command code, destination, source, data control, sequence number."""
ANSWER_BIT = 0x20
"""Of the properties: set in ACK and NAK, and in nothing else."""
SERVICE_CONNECTION_BIT = 0x40
"""Of the properties: set in every message about and under a service connection."""
ACKNOWLEDGEMENT_BITS = 0x30
"""Of the properties: where ``Acknowledgement`` lies."""


class Acknowledgement(IntEnum):
    """The ACK/NAK field."""

    NONE = 0
    REQUESTED = 1
    NEGATIVE = 2
    POSITIVE = 3


class DataFlag(IntEnum):
    """Which part of a large message a packet is."""

    SINGLE = 0
    FIRST = 1
    NORMAL = 2
    RETRANSMITTED = 4
    LAST = 8


@dataclass(frozen=True, slots=True)
class MessageProperties:
    """The first two bytes of the header.

    Raises:
        LocalProtocolError: A value does not fit into its bits.
    """

    priority: int = 6
    """0 low, 6 default, 11 high, 12 to 15 safety critical."""
    acknowledgement: Acknowledgement = Acknowledgement.NONE
    service_connection: bool = False
    experimental: bool = False
    version: int = RA_3_3

    def __post_init__(self) -> None:
        for name, bits in (("priority", 4), ("version", 6)):
            value = getattr(self, name)
            if not 0 <= value < 2**bits:
                raise LocalProtocolError(f"header {name}: got {value!r}, expected 0 to {2**bits - 1}")

    @property
    def word(self) -> int:
        """Return the 16 bits on the wire."""
        flags = self.service_connection << 6 | self.experimental << 7
        return self.priority | self.acknowledgement << 4 | flags | self.version << 8

    @staticmethod
    def from_word(word: int) -> MessageProperties:
        """Return what 16 bits of the wire say; the two reserved bits are dropped."""
        return _properties_of(word & 0x3FFF)


@lru_cache(maxsize=1024)
def _properties_of(word: int) -> MessageProperties:
    return MessageProperties(
        word & 15, Acknowledgement(word >> 4 & 3), bool(word & 64), bool(word & 128), word >> 8
    )


DEFAULT_WORD = MessageProperties().word


class Header:
    """Who sends a message to whom, and how. Size, code and data flag follow from the message itself.

    Not to be changed once made. The fields are kept as they lie on the wire, and turned into objects when
    they are asked for: most readers want one of them.

    Args:
        destination: To whom.
        source: From whom.
        sequence: Sequence number, 0 to 65535.
        properties: Priority, acknowledgement, flags and version.
    """

    __slots__ = ("destination_id", "properties_word", "sequence", "source_id")

    destination_id: int
    """JAUS id of the destination."""
    source_id: int
    """JAUS id of the source."""
    sequence: int
    properties_word: int

    def __init__(
        self,
        destination: JausAddress,
        source: JausAddress,
        sequence: int = 0,
        properties: MessageProperties | None = None,
    ) -> None:
        self.destination_id = destination.jaus_id
        self.source_id = source.jaus_id
        self.sequence = sequence
        self.properties_word = DEFAULT_WORD if properties is None else properties.word

    @staticmethod
    def from_words(properties_word: int, destination_id: int, source_id: int, sequence: int) -> Header:
        """Return a header from its words as they lie on the wire."""
        header = object.__new__(Header)
        header.properties_word = properties_word
        header.destination_id = destination_id
        header.source_id = source_id
        header.sequence = sequence
        return header

    @property
    def destination(self) -> JausAddress:
        """Return to whom."""
        return JausAddress.from_jaus_id(self.destination_id)

    @property
    def source(self) -> JausAddress:
        """Return from whom."""
        return JausAddress.from_jaus_id(self.source_id)

    @property
    def properties(self) -> MessageProperties:
        """Return priority, acknowledgement, flags and version."""
        return MessageProperties.from_word(self.properties_word)

    @property
    def acknowledgement(self) -> Acknowledgement:
        """Return whether the sender wants an acknowledgement, or gives one."""
        return Acknowledgement(self.properties_word >> 4 & 3)

    def with_acknowledgement(self, acknowledgement: Acknowledgement) -> Header:
        """Return the same header with another ACK/NAK field."""
        return Header.from_words(
            self.properties_word & ~ACKNOWLEDGEMENT_BITS | acknowledgement << 4,
            self.destination_id,
            self.source_id,
            self.sequence,
        )

    def with_sequence(self, sequence: int) -> Header:
        """Return the same header with another sequence number."""
        return Header.from_words(self.properties_word, self.destination_id, self.source_id, sequence)

    def reply(self, acknowledgement: Acknowledgement = Acknowledgement.NONE) -> Header:
        """Return the header of an answer: addresses swapped, priority, flags and sequence number kept."""
        return Header.from_words(
            self.properties_word & ~ACKNOWLEDGEMENT_BITS | acknowledgement << 4,
            self.source_id,
            self.destination_id,
            self.sequence,
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Header):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in Header.__slots__)

    def __hash__(self) -> int:
        return hash((self.destination_id, self.properties_word, self.sequence, self.source_id))

    def __repr__(self) -> str:
        properties = self.properties
        notes = [f"{self.source} -> {self.destination}", f"sequence {self.sequence}"]
        if properties.priority != MessageProperties().priority:
            notes.append(f"priority {properties.priority}")
        if properties.acknowledgement:
            notes.append(f"acknowledgement {properties.acknowledgement.name.lower()}")
        notes += [
            word
            for word, is_set in (
                ("service connection", properties.service_connection),
                ("experimental", properties.experimental),
            )
            if is_set
        ]
        return f"<Header {', '.join(notes)}>"


UNADDRESSED = Header.from_words(DEFAULT_WORD, 0, 0, 0)
"""The header of a message that nobody has addressed yet; such a message cannot be encoded."""
