"""What a message is: a class whose annotations say how its fields lie on the wire.

::

    @message(0x4202)
    class ReportHeartbeatPulse(Message): ...

A field annotated ``X | None`` is optional: bit *i* of the presence vector announces the *i*-th of them.
"""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import (
    Annotated,
    ClassVar,
    Self,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from jaus.address import JausAddress
from jaus.fields import Counted, Field, Integer, Kind, Nested
from jaus.header import (
    SERVICE_CONNECTION_BIT,
    UNADDRESSED,
    Acknowledgement,
    DataFlag,
    Header,
    MessageProperties,
)

EXPERIMENTAL_CODES = 0xD000
"""From here on the codes are experimental (jaus-wire: D000 to FFFF)."""

T = TypeVar("T")
M = TypeVar("M", bound="Message")


@dataclass(slots=True)
class Message:
    """Base of all messages."""

    code: ClassVar[int]
    """Command code."""
    fields: ClassVar[tuple[Field, ...]]
    """How the body lies on the wire, in order."""
    presence: ClassVar[Integer | None]
    """Kind of the presence vector; None: there is none, and every field is always there."""
    presence_at: ClassVar[int]
    """How many fields lie before the presence vector."""
    properties: ClassVar[MessageProperties]
    """What its header says by default."""
    properties_word: ClassVar[int]
    """The same as on the wire."""

    header: Header = field(default=UNADDRESSED, kw_only=True)

    @property
    def presence_vector(self) -> int:
        """Return which optional fields are there; 0 for a message without such."""
        there = (f.bit for f in self.fields if f.bit is not None and getattr(self, f.name) is not None)
        return sum(1 << bit for bit in there)

    def to(
        self,
        destination: JausAddress,
        *,
        source: JausAddress,
        sequence: int = 0,
        acknowledgement: Acknowledgement = Acknowledgement.NONE,
        service_connection: bool = False,
    ) -> Self:
        """Address the message and return it; priority and flags are those of its kind.

        Args:
            destination: To whom.
            source: From whom.
            sequence: Sequence number.
            acknowledgement: Whether the receiver shall acknowledge it.
            service_connection: Whether it is sent under a service connection.
        """
        word = self.properties_word | acknowledgement << 4
        if service_connection:
            word |= SERVICE_CONNECTION_BIT
        self.header = Header.from_words(word, destination.jaus_id, source.jaus_id, sequence)
        return self

    def keep(self, presence_vector: int) -> Self:
        """Take away the optional fields that ``presence_vector`` does not name, and return the message."""
        for each in self.fields:
            if each.bit is not None and not presence_vector >> each.bit & 1:
                setattr(self, each.name, None)
        return self


@dataclass(slots=True)
class UnknownMessage:
    """A message with a code that this library has no declaration for."""

    code: int
    body: bytes
    header: Header = field(default=UNADDRESSED, kw_only=True)


@dataclass(slots=True)
class MessagePart:
    """One packet of a large message; ``jaus.Reassembly`` puts them together."""

    code: int
    body: bytes
    data_flag: DataFlag
    is_sae: bool = field(default=False, kw_only=True)
    """Whether its code means something else in SAE JAUS, where it comes from."""
    header: Header = field(default=UNADDRESSED, kw_only=True)


@dataclass(slots=True)
class Ack:
    """Acknowledgement: an empty message with the code and sequence number of the one it answers."""

    code: int
    sequence: int
    positive: bool = True
    """False: a NAK."""
    header: Header = field(default=UNADDRESSED, kw_only=True)


MESSAGES: dict[int, type[Message]] = {}
"""Every declared message by its code."""


@dataclass_transform(field_specifiers=(field,))
def record(cls: type[T]) -> type[T]:
    """Declare a group of fields within messages."""
    made = dataclass(slots=True)(cls)
    made.fields = _fields_of(made)  # type: ignore[attr-defined]
    return made


@dataclass_transform(field_specifiers=(field,))
def message(
    code: int, *, presence: str | None = None, presence_at: int = 0, service_connection: bool = False
) -> Callable[[type[M]], type[M]]:
    """Declare a message.

    Args:
        code: Its command code.
        presence: Format of its presence vector as in ``struct``.
        presence_at: How many fields lie before it.
        service_connection: Whether its header says by default that it belongs to a service connection.
    """

    def declare(cls: type[M]) -> type[M]:
        made = dataclass(slots=True)(cls)
        made.code = code
        made.fields = _fields_of(made)
        made.presence = None if presence is None else Integer(presence)
        made.presence_at = presence_at
        made.properties = MessageProperties(
            service_connection=service_connection, experimental=code >= EXPERIMENTAL_CODES
        )
        made.properties_word = made.properties.word
        if code in MESSAGES:
            raise TypeError(f"{cls.__name__}: code {code:#06x} belongs to {MESSAGES[code].__name__}")
        MESSAGES[code] = made
        return made

    return declare


def _fields_of(cls: type) -> tuple[Field, ...]:
    hints = get_type_hints(cls, include_extras=True)
    found: list[Field] = []
    bit = 0
    for name in (each.name for each in dataclasses.fields(cls) if each.name != "header"):
        hint, optional = _without_none(hints[name])
        found.append(Field(name, _kind_of(hint), bit if optional else None))
        bit += optional
    return tuple(found)


def _without_none(hint: object) -> tuple[object, bool]:
    if get_origin(hint) in {Union, types.UnionType}:
        (only,) = (each for each in get_args(hint) if each is not type(None))
        return only, True
    return hint, False


def _kind_of(hint: object) -> Kind:
    origin = get_origin(hint)
    if origin is Annotated:
        kind: Kind = get_args(hint)[1]
        return kind
    if origin is tuple:
        return Counted(_kind_of(get_args(hint)[0]))
    assert isinstance(hint, type)  # noqa: S101 - a declaration in this package is wrong otherwise
    return Nested(hint, _fields_of(hint))
