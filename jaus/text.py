"""Messages for people and for other programs: as lines of text, and as plain data for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields as dataclass_fields

from jaus.codec import Decoded
from jaus.fields import Counted, Field, Integer, Kind, Nested
from jaus.messages import Message, MessagePart


def title(message: Decoded) -> str:
    """Return name, code, addresses and what else the header says, on one line."""
    header, properties = message.header, message.header.properties
    notes = [f"sequence {header.sequence}", f"priority {properties.priority}"]
    if properties.acknowledgement:
        notes.append(f"acknowledgement {properties.acknowledgement.name.lower()}")
    flags = {"service connection": properties.service_connection, "experimental": properties.experimental}
    notes += [word for word, is_set in flags.items() if is_set]
    name = type(message).__name__
    return f"{name} {message.code:#06x}  {header.source} -> {header.destination}  {', '.join(notes)}"


def lines(message: Decoded) -> list[str]:
    """Return the message as text: its title, and below it a line for each value that is there."""
    return [title(message), *(f"  {path}: {value}" for path, value in _values(message))]


def plain(message: Decoded) -> dict[str, object]:
    """Return the message as data that JSON can hold; ``words`` says in words what some numbers mean."""
    header, properties = message.header, message.header.properties
    found: dict[str, object] = {
        "message": type(message).__name__,
        "code": f"{message.code:#06x}",
        "source": str(header.source),
        "destination": str(header.destination),
        "sequence": header.sequence,
        "priority": properties.priority,
        "acknowledgement": properties.acknowledgement.name.lower(),
        "service_connection": properties.service_connection,
        "experimental": properties.experimental,
        "version": properties.version,
    }
    if not isinstance(message, Message):
        own = (field.name for field in dataclass_fields(message) if field.name not in {"code", "header"})
        return found | {name: _plain_value(getattr(message, name)) for name in own}
    if message.presence is not None:
        found["presence_vector"] = message.presence_vector
    found["fields"] = _plain_fields(message, message.fields)
    words = {path: said for path, _, said in _leaves(message, message.fields, "") if said is not None}
    return found | ({"words": words} if words else {})


def _values(message: Decoded) -> Iterator[tuple[str, str]]:
    if not isinstance(message, Message):
        if body := getattr(message, "body", b""):
            yield "body", body.hex(" ")
        if isinstance(message, MessagePart):
            yield "part", message.data_flag.name.lower()
        return
    for path, value, said in _leaves(message, message.fields, ""):
        shown = (
            f"{value:.6g}"
            if isinstance(value, float)
            else value.hex(" ")
            if isinstance(value, bytes)
            else printable(str(value))
        )
        yield path, f"{shown} ({said})" if said else f"{shown}"


def printable(text: str) -> str:
    """Return foreign text with its control characters escaped: a terminal shows them, and obeys none."""
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in text
    )


def _leaves(
    owner: object, fields: tuple[Field, ...], prefix: str
) -> Iterator[tuple[str, object, str | None]]:
    """Return path, value and words of everything that is there."""
    for field in fields:
        value = getattr(owner, field.name)
        if value is not None:
            yield from _leaves_of(value, field.kind, prefix + field.name)


def _leaves_of(value: object, kind: Kind, path: str) -> Iterator[tuple[str, object, str | None]]:
    match kind:
        case Counted() if isinstance(value, tuple):
            for number, item in enumerate(value):
                yield from _leaves_of(item, kind.item, f"{path}[{number}]")
        case Nested():
            yield from _leaves(value, kind.fields, f"{path}.")
        case Integer() if isinstance(value, int):
            yield path, value, kind.words(value)
        case _:
            yield path, value, None


def _plain_fields(owner: object, fields: tuple[Field, ...]) -> dict[str, object]:
    values = {field.name: (getattr(owner, field.name), field.kind) for field in fields}
    return {name: _plain_kind(value, kind) for name, (value, kind) in values.items() if value is not None}


def _plain_kind(value: object, kind: Kind) -> object:
    match kind:
        case Counted() if isinstance(value, tuple):
            return [_plain_kind(item, kind.item) for item in value]
        case Nested():
            return _plain_fields(value, kind.fields)
        case _:
            return _plain_value(value)


def _plain_value(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain_value(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)  # JSON has no word for it.
    return value.hex() if isinstance(value, bytes) else value
