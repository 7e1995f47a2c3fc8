"""Encoders and decoders, generated as Python source from the declarations of the messages.

For each message one function in either direction, straight-line code with the constants written into it: no
field is looked up or interpreted while messages flow. What a generated function raises on bad input,
``struct.error`` or ``ValueError`` among others, the codec turns into its own errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import groupby
from struct import Struct
from typing import Any, NamedTuple

from jaus.fields import (
    Counted,
    Integer,
    Kind,
    Nested,
    RestOfBody,
    Scalar,
    Scaled,
    SizedBytes,
    Tagged,
    TerminatedText,
    Text,
)
from jaus.header import Header
from jaus.messages import Message

Decoder = Callable[[bytes, int, Header], Message]
"""Takes the data, where the body begins in it, and the header."""
Encoder = Callable[[Any], bytes]
"""Takes the message and returns its body."""


def decoder(cls: type[Message]) -> Decoder:
    """Return the function that makes a message of its body."""
    source = _Source({"new": object.__new__, "Message": cls})
    with source.block("def decode(data, o, header):"):
        source.add("m = new(Message)", "m.header = header")
        _decode_single_item(source, cls)
        _decode_fields(source, cls, "m")
        with source.block("if o != len(data):"):
            source.add("raise ValueError(f'{len(data) - o} bytes more than the fields need')")
        source.add("return m")
    made: Decoder = source.compiled(f"decoder of {cls.__name__}")["decode"]
    return made


def encoder(cls: type[Message]) -> Encoder:
    """Return the function that makes the body of a message."""
    source = _Source({"floor": math.floor, "fitting": _fitting, "terminated": _terminated})
    with source.block("def encode(m):"):
        _encode_message(source, cls)
    made: Encoder = source.compiled(f"encoder of {cls.__name__}")["encode"]
    return made


class _Source:
    """Lines of a function under way, and the objects they name."""

    def __init__(self, names: dict[str, Any]) -> None:
        self.names = names
        self.lines: list[str] = []
        self.depth = 0
        self.used = 0

    def add(self, *lines: str) -> None:
        self.lines += ["    " * self.depth + line for line in lines]

    def fresh(self, value: object = None) -> str:
        """Return a new name, bound to ``value``."""
        self.used += 1
        name = f"x{self.used}"
        if value is not None:
            self.names[name] = value
        return name

    @contextmanager
    def block(self, line: str) -> Iterator[None]:
        self.add(line)
        self.depth += 1
        yield
        self.depth -= 1

    def compiled(self, what: str) -> dict[str, Any]:
        code = compile("\n".join(self.lines), f"<{what}>", "exec")
        exec(code, self.names)  # noqa: S102 - our own declarations, no foreign text
        return self.names


def _decode_fields(source: _Source, cls: type[Message], target: str) -> None:
    fields = [_Slot(field.kind, f"{target}.{field.name}", field.bit) for field in cls.fields]
    if cls.presence is not None:
        fields.insert(cls.presence_at, _Slot(cls.presence, "p"))
    _decode_run(source, fields)


def _decode_single_item(source: _Source, cls: type[Message]) -> None:
    """Decode all at once what has fields of fixed size, then a list with the usual one item of such fields.

    Any other message of the same size is left to the code that follows.
    """
    if cls.presence is not None or not cls.fields:
        return
    *before, last = cls.fields
    counted = last.kind
    if not (isinstance(counted, Counted) and isinstance(counted.item, Nested)):
        return
    count, item = source.fresh(), source.fresh()
    run: list[tuple[Kind, str]] = [(field.kind, f"m.{field.name}") for field in before]
    run += [(counted.size, count)]
    run += [(field.kind, f"{item}.{field.name}") for field in counted.item.fields]
    fixed = [(kind, target) for kind, target in run if isinstance(kind, Integer | Scaled | Text)]
    if len(fixed) < len(run) or any(field.bit is not None for field in cls.fields):
        return
    size = Struct("<" + "".join(kind.format for kind, _ in fixed)).size
    with source.block(f"if len(data) - o == {size}:"):
        source.add(f"{item} = new({source.fresh(counted.item.record)})")
        _decode_scalars(source, fixed, moves_on=False)
        with source.block(f"if {count} == 1:"):
            source.add(f"m.{last.name} = ({item},)", "return m")


class _Slot(NamedTuple):
    """A value on the wire, and the expression that holds it."""

    kind: Kind
    target: str
    bit: int | None = None


def _decode_run(source: _Source, slots: Iterable[_Slot]) -> None:
    """Decode one value after the other; neighbours of fixed size at once."""
    run: list[tuple[Scalar, str]] = []
    for slot in slots:
        if slot.bit is None and isinstance(slot.kind, Integer | Scaled | Text):
            run.append((slot.kind, slot.target))
            continue
        size = source.fresh()
        if slot.bit is None and isinstance(slot.kind, Counted | SizedBytes):
            run.append((slot.kind.size, size))
        _decode_scalars(source, run)
        run = []
        if slot.bit is None:
            _decode_variable(source, slot.kind, slot.target, size)
            continue
        with source.block(f"if p & {1 << slot.bit}:"):
            _decode_run(source, [slot._replace(bit=None)])
        with source.block("else:"):
            source.add(f"{slot.target} = None")
    _decode_scalars(source, run)


def _decode_scalars(source: _Source, run: list[tuple[Scalar, str]], *, moves_on: bool = True) -> None:
    if not run:
        return
    layout = Struct("<" + "".join(kind.format for kind, _ in run))
    unpack = source.fresh(layout.unpack_from)
    values = [target if isinstance(kind, Integer) else source.fresh() for kind, target in run]
    source.add(f"{', '.join(values)}, = {unpack}(data, o)")
    if moves_on:
        source.add(f"o += {layout.size}")
    for (kind, target), value in zip(run, values, strict=True):
        if isinstance(kind, Scaled):
            source.add(f"{target} = {_real(kind, value)}")
        elif isinstance(kind, Text):
            source.add(f"{target} = {value}.rstrip(b'\\0').decode('latin-1')")


def _real(kind: Scaled, raw: str) -> str:
    real = f"{raw} * {kind.scale!r}" + (f" + {kind.bias!r}" if kind.bias else "")
    if not kind.signed:
        return real
    return f"{real} if {raw} >= {kind.raw_bounds[0]} else {kind.lower!r}"


def _decode_variable(source: _Source, kind: Kind, target: str, size: str) -> None:
    """Decode a value whose size is its own affair; ``size`` holds the number that stands before it."""
    match kind:
        case TerminatedText():
            source.add(f"{size} = data.index(0, o)", f"{target} = data[o:{size}].decode('latin-1')")
            source.add(f"o = {size} + 1")
        case SizedBytes():
            source.add(f"{target} = data[o : o + {size}]", f"o += {size}")
        case RestOfBody():
            source.add(f"{target} = data[o:]", "o = len(data)")
        case Tagged():
            _decode_tagged(source, kind, target)
        case Counted():
            items, item = source.fresh(), source.fresh()
            with source.block(f"if {size} == 1:"):  # The usual number, without the detour over a list.
                _decode_run(source, [_Slot(kind.item, item)])
                source.add(f"{target} = ({item},)")
            with source.block("else:"):
                source.add(f"{items} = []")
                with source.block(f"for _ in range({size}):"):
                    _decode_run(source, [_Slot(kind.item, item)])
                    source.add(f"{items}.append({item})")
                source.add(f"{target} = tuple({items})")
        case Nested():
            made = source.fresh()
            source.add(f"{made} = new({source.fresh(kind.record)})")
            _decode_run(source, [_Slot(field.kind, f"{made}.{field.name}") for field in kind.fields])
            source.add(f"{target} = {made}")


def _decode_tagged(source: _Source, kind: Tagged, target: str) -> None:
    tag, layout, value = source.fresh(), source.fresh(), source.fresh()
    layouts = source.fresh([Struct("<" + format_) for format_ in kind.formats])
    _decode_scalars(source, [(Integer("B"), tag)])
    with source.block(f"if {tag} >= {len(kind.formats)}:"):
        source.add(f"raise ValueError(f'type {{{tag}}} of a value is unknown')")
    source.add(
        f"{layout} = {layouts}[{tag}]",
        f"{value} = {layout}.unpack_from(data, o)",
        f"o += {layout}.size",
        f"{target} = ({tag}, {value} if len({value}) > 1 else {value}[0])",
    )


def _encode_message(source: _Source, cls: type[Message]) -> None:
    slots = [_Slot(field.kind, f"m.{field.name}", field.bit) for field in cls.fields]
    if cls.presence is None:
        source.add(f"return {_encoded(source, slots)}")
        return
    # What follows the presence vector is collected first: only then all its bits are known.
    source.add("p = 0", "b = b''")
    for optional, group in groupby(slots[cls.presence_at :], lambda slot: slot.bit is not None):
        if not optional:
            source.add(f"b += {_encoded(source, group)}")
            continue
        for slot in group:
            value = source.fresh()
            source.add(f"{value} = {slot.target}")
            with source.block(f"if {value} is not None:"):
                source.add(f"p |= {1 << (slot.bit or 0)}")
                source.add(f"b += {_encoded(source, [_Slot(slot.kind, value)])}")
    head = [*slots[: cls.presence_at], _Slot(cls.presence, "p")]
    source.add(f"return {_encoded(source, head)} + b")


def _encoded(source: _Source, slots: Iterable[_Slot]) -> str:
    """Write the lines that prepare the values, and return the expression for their bytes."""
    parts: list[str] = []
    formats, run = "<", list[str]()

    def flush() -> None:
        nonlocal formats
        if run:
            parts.append(f"{source.fresh(Struct(formats).pack)}({', '.join(run)})")
            run.clear()
            formats = "<"

    for kind, value, _ in slots:
        if isinstance(kind, Integer | Scaled | Text):
            formats += kind.format
            run.append(_raw(source, kind, value))
            continue
        if isinstance(kind, Counted | SizedBytes):
            formats += kind.size.format
            run.append(f"len({value})")
        flush()
        parts.append(_encoded_variable(source, kind, value))
    flush()
    return " + ".join(parts) or "b''"


def _raw(source: _Source, kind: Scalar, value: str) -> str:
    if isinstance(kind, Integer):
        return value
    if isinstance(kind, Text):
        return f"fitting({value}, {kind.size})"
    real, raw = source.fresh(), source.fresh()
    low, high = kind.raw_bounds
    nearest = "floor" if kind.signed else "int"
    offset = f"({real} - {kind.bias!r})" if kind.bias else real
    source.add(
        f"{real} = {value}",
        f"{raw} = {low} if {real} < {kind.lower!r} else {high} if {real} > {kind.upper!r}"
        f" else {nearest}({offset} / {kind.scale!r} + 0.5)",
    )
    return raw


def _encoded_variable(source: _Source, kind: Kind, value: str) -> str:
    match kind:
        case Counted():
            return _encoded_items(source, kind, value)
        case Nested():
            slots = [_Slot(field.kind, f"{value}.{field.name}") for field in kind.fields]
            return _encoded(source, slots)
        case Tagged():
            return _encoded_tagged(source, kind, value)
        case TerminatedText():
            return f"terminated({value})"
        case _:
            return value


def _encoded_items(source: _Source, kind: Counted, value: str) -> str:
    body, item = source.fresh(), source.fresh()
    source.add(f"{body} = b''")
    with source.block(f"for {item} in {value}:"):
        source.add(f"{body} += {_encoded(source, [_Slot(kind.item, item)])}")
    return body


def _encoded_tagged(source: _Source, kind: Tagged, value: str) -> str:
    tag, number = source.fresh(), source.fresh()
    packs = source.fresh([Struct("<B" + format_).pack for format_ in kind.formats])
    source.add(f"{tag}, {number} = {value}")
    source.add(f"{number} = {number} if isinstance({number}, tuple) else ({number},)")
    return f"{packs}[{tag}]({tag}, *{number})"


def _fitting(text: str, size: int) -> bytes:
    data = text.encode("latin-1")
    if len(data) > size:
        raise ValueError(f"text of {len(data)} characters, expected {size} at most")
    return data


def _terminated(text: str) -> bytes:
    if "\0" in text:
        raise ValueError(f"text {text!r}, expected one without a zero character")
    return text.encode("latin-1") + b"\0"
