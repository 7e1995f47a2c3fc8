"""Kinds of fields: how a value lies in the body of a message, as data.

A message declares its fields as annotated types, ``Annotated[float, Scaled("H", 0.0, 1092.0, "Hz")]``; the
codec reads the declarations and generates encoders and decoders from them. All is little endian.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from struct import calcsize
from typing import Annotated, ClassVar

from jaus.stamps import DateStamp, TimeStamp

_WORDS = {"B": "u8", "b": "s8", "H": "u16", "h": "s16", "I": "u32", "i": "s32", "Q": "u64", "q": "s64"}
_WORDS |= {"f": "f32", "d": "f64"}


@dataclass(frozen=True, slots=True)
class Integer:
    """An integer as it is, ``format`` as in ``struct``."""

    format: str
    names: type[IntEnum | TimeStamp | DateStamp] | None = None
    """What the values mean. With ``bits``, the members are bit numbers."""
    unit: str = ""
    bits: bool = False

    def __str__(self) -> str:
        if self.names is None:
            return f"{_WORDS[self.format]} {self.unit}".rstrip()
        kind = f"bits of {self.names.__name__}" if self.bits else self.names.__name__
        return f"{_WORDS[self.format]} {kind}"

    def words(self, value: int) -> str | None:
        """Return what ``value`` means in words, None where it has none."""
        if self.names is None:
            return None
        if issubclass(self.names, TimeStamp | DateStamp):
            return str(self.names.from_packed(value))
        if self.bits:
            return " | ".join(bit.name.lower() for bit in self.names if value >> bit & 1) or None
        return next((member.name.lower() for member in self.names if member == value), None)


@dataclass(frozen=True, slots=True)
class Scaled:
    """A real number between two bounds, as a scaled integer.

    To the wire: ``floor((x - bias) / scale + 0.5)`` with ``x`` held within the bounds; back:
    ``raw * scale + bias``, held likewise. What was decoded is encoded to the same integer again (but for the
    one value of a signed integer that lies below the lower bound). Implementations in C cut off towards zero,
    so their negative values differ by one.

    In an unsigned integer over a symmetric range zero has no representation: it becomes half a step more.
    """

    format: str
    lower: float
    upper: float
    unit: str

    @property
    def signed(self) -> bool:
        """Return whether the integer is signed: then it lies around the middle of the range."""
        return self.format.islower()

    @property
    def scale(self) -> float:
        """Return the real size of one step."""
        low, high = self.raw_bounds
        return (self.upper - self.lower) / (high - low)

    @property
    def bias(self) -> float:
        """Return the real value of the integer 0."""
        return (self.upper + self.lower) / 2 if self.signed else self.lower

    @property
    def raw_bounds(self) -> tuple[int, int]:
        """Return the integers of the two bounds."""
        low, high = _integer_bounds(self.format)
        return (-high, high) if self.signed else (low, high)

    def __str__(self) -> str:
        bounds = f"[{_bound(self.lower)}, {_bound(self.upper)}]"
        return f"{_WORDS[self.format]} {bounds} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Text:
    """Text of ``size`` bytes, filled up with zeros."""

    size: int

    @property
    def format(self) -> str:
        """Return the format as in ``struct``."""
        return f"{self.size}s"

    def __str__(self) -> str:
        return f"{self.size} characters"


@dataclass(frozen=True, slots=True)
class TerminatedText:
    """Text up to a zero byte."""

    def __str__(self) -> str:
        return "text, zero-terminated"


@dataclass(frozen=True, slots=True)
class SizedBytes:
    """Bytes after their number."""

    size: ClassVar[Integer] = Integer("I")

    def __str__(self) -> str:
        return f"{self.size} n, n bytes"


@dataclass(frozen=True, slots=True)
class RestOfBody:
    """All the bytes that follow."""

    def __str__(self) -> str:
        return "bytes to the end"


@dataclass(frozen=True, slots=True)
class Tagged:
    """A number after a byte that says how it is written: ``(tag, value)``; ``formats`` by tag.

    A format of three bytes (``BBB``) makes a tuple.
    """

    formats: tuple[str, ...]

    def __str__(self) -> str:
        return f"u8 type, number of that type ({len(self.formats)} types)"


@dataclass(frozen=True, slots=True)
class Counted:
    """Several of one kind, after their number."""

    item: Kind
    size: ClassVar[Integer] = Integer("B")

    def __str__(self) -> str:
        return f"{self.size} n, n of ({self.item})"


@dataclass(frozen=True, slots=True)
class Nested:
    """A record: fields of its own."""

    record: type
    fields: tuple[Field, ...]

    def __str__(self) -> str:
        return ", ".join(f"{field.name}: {field.kind}" for field in self.fields)


Scalar = Integer | Scaled | Text
"""Kinds of fixed size, which ``struct`` packs."""
Kind = Scalar | TerminatedText | SizedBytes | RestOfBody | Tagged | Counted | Nested


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message or record."""

    name: str
    kind: Kind
    bit: int | None
    """Its bit in the presence vector; None: it is always there."""


def problem(kind: Kind, value: object) -> str | None:  # noqa: PLR0911 - one per kind
    """Return what keeps ``value`` from going onto the wire, None if nothing does."""
    match kind:
        case Integer():
            low, high = _integer_bounds(kind.format)
            fits = isinstance(value, int) and low <= value <= high
            return None if fits else f"got {value!r}, expected an integer from {low} to {high}"
        case Scaled():
            fits = isinstance(value, int | float) and not math.isnan(value)
            return None if fits else f"got {value!r}, expected a number"
        case Text() | TerminatedText():
            fits = isinstance(value, str) and len(value) <= getattr(kind, "size", len(value))
            return None if fits else f"got {value!r}, expected {kind}"
        case Counted():
            if not isinstance(value, tuple | list) or len(value) > _integer_bounds(kind.size.format)[1]:
                return f"got {value!r}, expected a tuple of at most {_integer_bounds(kind.size.format)[1]}"
            found = (problem(kind.item, item) for item in value)
            return next((f"item {number}: {text}" for number, text in enumerate(found) if text), None)
        case Nested():
            if not isinstance(value, kind.record):
                return f"got {value!r}, expected a {kind.record.__name__}"
            named = ((field.name, problem(field.kind, getattr(value, field.name))) for field in kind.fields)
            return next((f"{name}: {text}" for name, text in named if text), None)
        case _:
            return f"got {value!r}, expected {kind}"


def _integer_bounds(format_: str) -> tuple[int, int]:
    values = 1 << 8 * calcsize(format_)
    return (-values // 2, values // 2 - 1) if format_.islower() else (0, values - 1)


def _bound(value: float) -> str:
    for share, word in ((1, "π"), (2, "π/2")):
        if math.isclose(abs(value), math.pi / share):
            return f"{'-' if value < 0 else ''}{word}"
    return f"{value:g}" if abs(value) < 1e5 else f"{value:.0f}"


Byte = Annotated[int, Integer("B")]
UnsignedShort = Annotated[int, Integer("H")]
UnsignedLong = Annotated[int, Integer("I")]
Time = Annotated[int, Integer("I", TimeStamp)]
Date = Annotated[int, Integer("H", DateStamp)]
