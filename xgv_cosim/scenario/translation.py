"""Turns what pydantic found into problems: where they stand, in our words, with what was probably meant."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from xgv_cosim.scenario.model import json_schema
from xgv_cosim.scenario.problems import Path, Problem, dotted, intended_key, key_hint, word_hint
from xgv_cosim.scenario.units import unit_words

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails

Place = Callable[[Path], str]

_SELECTOR_SHAPES = "an id or pattern, a list of them, or {type: ..., route: ..., via: ..., share: ...}"
_LIMITS = {
    "greater_than": ("gt", "more than {}"),
    "greater_than_equal": ("ge", "{} or more"),
    "less_than": ("lt", "less than {}"),
    "less_than_equal": ("le", "{} or less"),
}
_KINDS = {
    "finite_number": "a finite number",
    "string_too_short": "at least one character",
    "too_short": "at least one entry",
    "string_pattern_mismatch": "letters, digits, '_', '.' and '-' only",
    "bool_type": "true or false",
    "string_type": "a text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "tuple_type": "a list",
    "list_type": "a list",
    "model_type": "a mapping of keys",
    "model_attributes_type": "a mapping of keys",
    "union_tag_invalid": _SELECTOR_SHAPES,
    "union_tag_not_found": _SELECTOR_SHAPES,
}


def problems_of(error: ValidationError, place_of_key: Place, place_of_value: Place) -> list[Problem]:
    """Return one problem for each mistake; a misspelt key is not also reported as missing."""
    details = error.errors(include_url=False)
    unknown: dict[Path, str | None] = {}
    for detail in details:
        if detail["type"] == "extra_forbidden":
            path = _path(detail)
            unknown[path] = intended_key(str(path[-1]), keys_at(path[:-1]))
    meant = {(*path[:-1], key) for path, key in unknown.items() if key is not None}
    problems = []
    for detail in details:
        path = _path(detail)
        if path in unknown:
            problems.append(_unknown_key(path, unknown[path], place_of_key(path)))
        elif detail["type"] == "missing":
            if path not in meant:
                words = description_at(path)
                message = f"is missing{f': {words}' if words else ''}"
                problems.append(Problem(message, dotted(path), place_of_value(path[:-1])))
        else:
            message, hint = _wrong_value(detail, path)
            problems.append(Problem(message, dotted(path), place_of_value(path), hint))
    return problems


def _path(detail: ErrorDetails) -> Path:
    """Return the location without the tags of selector shapes, which stand in no file."""
    return tuple(part for part in detail["loc"] if not (isinstance(part, str) and part.startswith("|")))


def _unknown_key(path: Path, meant: str | None, place: str) -> Problem:
    if meant is not None:
        return Problem("unknown key", dotted(path), place, key_hint(meant))
    known = ", ".join(sorted(keys_at(path[:-1])))
    return Problem(f"unknown key; known here: {known}" if known else "unknown key", dotted(path), place)


def _wrong_value(detail: ErrorDetails, path: Path) -> tuple[str, str]:
    """Return message and hint for a value that does not fit."""
    got, kind = detail["input"], detail["type"]
    context: Mapping[str, Any] = detail.get("ctx", {})
    if kind == "value_error":
        return str(context["error"]), ""
    hint = ""
    if kind in {"literal_error", "enum"}:
        choices = _choices_at(path)
        expected, hint = _one_of(choices), word_hint(got, choices)
    elif kind == "float_type":
        expected, hint = _expected_number(path, got)
    elif kind in _LIMITS:
        name, phrase = _LIMITS[kind]
        expected = phrase.format(f"{context[name]:g}")
    elif kind in _KINDS:
        expected = _KINDS[kind]
    else:
        return f"{detail['msg']}; got {_shown(got)}", ""
    return f"got {_shown(got)}, expected {expected}", hint


def _expected_number(path: Path, got: object) -> tuple[str, str]:
    """Return what number is expected, and a hint for one with its unit behind it, such as ``30s``."""
    words = unit_words(str(path[-1]))
    if not (isinstance(got, str) and got.strip()[:1] in tuple("0123456789+-.")):
        return f"a number ({words})" if words else "a number", ""
    if words is None:
        return "a number", "write it without quotes"
    return f"a number ({words})", "write the bare number; its unit stands in the key"


def _shown(value: object) -> str:
    """Return a value as its author wrote it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _one_of(choices: list[str]) -> str:
    return f"one of {', '.join(choices)}" if len(choices) > 1 else ", ".join(choices)


@cache
def _schema() -> dict[str, Any]:
    return json_schema()


def _schemas_at(path: Path) -> list[Mapping[str, Any]]:
    """Return every schema that may describe the value at ``path``."""
    schemas = _alternatives(_schema())
    for part in path:
        inner: list[Mapping[str, Any]] = []
        for schema in schemas:
            if isinstance(part, int) and "items" in schema:
                inner += _alternatives(schema["items"])
            elif isinstance(part, str) and part in schema.get("properties", {}):
                inner += _alternatives(schema["properties"][part])
        schemas = inner
    return schemas


def _alternatives(schema: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the schema with references followed, and each branch of its unions."""
    if "$ref" in schema:
        target = _schema()["$defs"][schema["$ref"].rsplit("/", 1)[-1]]
        return _alternatives({**target, **{key: value for key, value in schema.items() if key != "$ref"}})
    branches = schema.get("anyOf") or schema.get("oneOf") or schema.get("allOf")
    if not branches:
        return [schema]
    about = {"description": schema["description"]} if "description" in schema else {}
    return [found for branch in branches for found in _alternatives({**branch, **about})]


def keys_at(path: Path) -> tuple[str, ...]:
    """Return the keys that a mapping at ``path`` may have."""
    return tuple(key for schema in _schemas_at(path) for key in schema.get("properties", {}))


def description_at(path: Path) -> str:
    """Return the first line that describes the key at ``path``, or nothing."""
    texts = (str(schema["description"]) for schema in _schemas_at(path) if "description" in schema)
    return next(texts, "").split("\n", maxsplit=1)[0].rstrip(".")


def _choices_at(path: Path) -> list[str]:
    """Return the values that the schema lists at ``path``, as a YAML file spells them."""
    found: list[str] = []
    for schema in _schemas_at(path):
        values = schema.get("enum", [schema["const"]] if "const" in schema else [])
        found += ["true" if value is True else str(value) for value in values]
    return found
