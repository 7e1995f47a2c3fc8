"""``--bind`` and ``--inject``: a row of a scenario in one line of text.

::

    --bind   VEHICLES[,key=value...]               'xgv_*,coupling=lane'   share=0.25,driver=none
    --inject 'VEHICLES@WHEN KIND [key=value ...]'  'xgv_3@31.5 estop_pause duration_s=5'

VEHICLES is an id or pattern, several of them with commas between, or ``type=...``, ``share=...`` and
``seed=...``. The keys are those of the rows of a scenario file; what needs more than that is written in one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ruamel.yaml.error import YAMLError

from xgv_cosim.scenario.document import parse_scalar
from xgv_cosim.scenario.overrides import Override, set_key
from xgv_cosim.scenario.problems import Problem
from xgv_cosim.scenario.sections import VehicleQuery

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

BIND_SHAPE = "VEHICLES[,key=value...], for example 'xgv_*,coupling=lane' or share=0.25"
INJECT_SHAPE = "'VEHICLES@WHEN KIND [key=value ...]', for example 'xgv_3@31.5 estop_pause duration_s=5'"


class _NotARowError(ValueError):
    """The text is not what a row looks like; the message says why."""


def add_rows(
    data: dict[str, Any], bind: Sequence[str], inject: Sequence[str]
) -> tuple[dict[str, Any], list[Override], list[Problem]]:
    """Return the data with rows added behind those it has, the rows with their options, and what is wrong.

    Args:
        data: Plain data of a scenario; it is not changed.
        bind: Texts of ``--bind``.
        inject: Texts of ``--inject``.
    """
    applied: list[Override] = []
    problems: list[Problem] = []
    readers: tuple[tuple[str, str, Sequence[str], Callable[[str], dict[str, Any]], str], ...] = (
        ("--bind", "bind", bind, _bind_row, BIND_SHAPE),
        ("--inject", "injections", inject, _injection_row, INJECT_SHAPE),
    )
    for option, section, texts, read, shape in readers:
        there = data.get(section) or []
        if not texts or not isinstance(there, list):  # what is wrong with it is told elsewhere
            continue
        rows = list(there)
        for text in texts:
            try:
                row = read(text)
            except _NotARowError as error:
                problems.append(Problem(f"{error}; expected {shape}", place=f"{option} {text}"))
                continue
            applied.append(Override(f"{option} {text}", (section, len(rows)), row))
            rows.append(row)
        data = {**data, section: rows}
    return data, applied, problems


def _bind_row(text: str) -> dict[str, Any]:
    words = [word.strip() for word in text.split(",")]
    vehicles = [word for word in words if "=" not in word or _is_query(word)]
    row: dict[str, Any] = {"vehicles": _selector(vehicles)}
    return _with_keys(row, [word for word in words if word not in vehicles])


def _injection_row(text: str) -> dict[str, Any]:
    head, *rest = text.split() or [""]
    vehicles, at, when = head.rpartition("@")
    if not at or not when:
        raise _NotARowError(f"got {head!r} where VEHICLES@WHEN should stand")
    row: dict[str, Any] = {"vehicles": _selector(vehicles.split(",")), **_when(when)}
    if not rest or "=" in rest[0]:
        raise _NotARowError("it does not say what happens")
    return _with_keys({**row, "kind": rest[0]}, rest[1:])


def _when(text: str) -> dict[str, Any]:
    """Return the keys for a time, or for conditions ``key=value`` with commas between."""
    if "=" not in text:
        return {"at_s": _value(text)}
    words = text.split(",")
    times = [word for word in words if word.startswith("at_s=")]
    return _with_keys({"when": _with_keys({}, [word for word in words if word not in times])}, times)


def _selector(words: Sequence[str]) -> object:
    """Return the selector that patterns, or the keys of a query, stand for."""
    queries = [word for word in words if _is_query(word)]
    patterns = [word for word in words if word not in queries]
    if not words or not all(words):
        raise _NotARowError("no vehicles are named")
    if queries and patterns:
        raise _NotARowError(f"got names ({', '.join(patterns)}) and {', '.join(queries)}; use one of the two")
    if queries:
        return _with_keys({}, queries)
    return patterns[0] if len(patterns) == 1 else patterns


def _is_query(word: str) -> bool:
    key, equals, _ = word.partition("=")
    return bool(equals) and key.strip() in VehicleQuery.model_fields


def _with_keys(row: dict[str, Any], words: Sequence[str]) -> dict[str, Any]:
    """Return the row with ``key=value`` words put in; a dotted key leads into a section of the row."""
    for word in words:
        key, equals, text = word.partition("=")
        if not equals or not all(key.split(".")):
            raise _NotARowError(f"got {word!r} where key=value should stand")
        try:
            row = set_key(row, key, _value(text))
        except LookupError as error:
            raise _NotARowError(str(error.args[0])) from error
    return row


def _value(text: str) -> Any:  # noqa: ANN401 - a YAML value has any type
    try:
        return parse_scalar(text)
    except YAMLError as error:
        raise _NotARowError(f"{text!r} is not a value: {' '.join(str(error).split())}") from error
