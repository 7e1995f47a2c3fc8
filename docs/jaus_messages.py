"""The table of messages for the README of jaus, computed from their declarations."""

from __future__ import annotations

from collections.abc import Iterator
from inspect import getdoc

from markdown_parts import rules_in, table, words

from jaus.fields import Field
from jaus.messages import MESSAGES, Message


def messages() -> str:
    """Return code, name, purpose and body of every declared message, by code."""
    return table(
        ("code", "message", "what it says", "body"),
        [
            (f"`{code:04X}`", f"`{kind.__name__}`", _purpose(kind), ", ".join(_body(kind)) or "-")
            for code, kind in sorted(MESSAGES.items())
        ],
    )


def _purpose(kind: type[Message]) -> str:
    return words(rules_in(getdoc(kind) or "")[0])


def _body(kind: type[Message]) -> Iterator[str]:
    for number, field in enumerate(kind.fields):
        if kind.presence is not None and number == kind.presence_at:
            yield f"presence vector {kind.presence}"
        yield _field(field)


def _field(field: Field) -> str:
    bit = "" if field.bit is None else f"bit {field.bit} "
    return f"{bit}`{field.name}` {field.kind}"
