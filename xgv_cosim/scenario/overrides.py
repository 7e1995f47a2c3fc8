"""``--set dotted.key=value``: changes a scenario's data before it is checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ruamel.yaml.error import YAMLError

from xgv_cosim.scenario.document import parse_scalar
from xgv_cosim.scenario.problems import Path, Problem, dotted

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, slots=True)
class Override:
    """One option, read."""

    option: str
    """The option as messages show it: ``--set seed=3``."""
    path: Path
    value: Any


def apply_overrides(data: Any, options: Sequence[str]) -> tuple[Any, list[Override], list[Problem]]:  # noqa: ANN401 - a YAML value has any type
    """Return the changed data, the options that were applied, and what is wrong with the others.

    Args:
        data: Plain data of the scenario; it is not changed.
        options: ``dotted.key=value`` each; list entries by index: ``injections.0.at_s=12``.
    """
    applied: list[Override] = []
    problems: list[Problem] = []
    for text in options:
        option = f"--set {text}"
        key, equals, value_text = text.partition("=")
        if not equals or not all(key.strip().split(".")):
            problems.append(Problem("expected dotted.key=value, for example --set seed=3", place=option))
            continue
        try:
            value = parse_scalar(value_text)
        except YAMLError as error:
            reason = " ".join(str(error).split())
            problems.append(Problem(f"the value is not valid YAML: {reason}", key.strip(), option))
            continue
        try:
            data, path = _changed(data, key.strip().split("."), (), value)
        except LookupError as error:
            problems.append(Problem(str(error.args[0]), key.strip(), option))
            continue
        applied.append(Override(option, path, value))
    return data, applied, problems


def set_key(data: Any, key: str, value: Any) -> Any:  # noqa: ANN401 - a YAML value has any type
    """Return a copy of ``data`` with the value under a dotted key.

    Raises:
        LookupError: The key leads through something that has no keys.
    """
    return _changed(data, key.split("."), (), value)[0]


def _changed(data: Any, parts: list[str], above: Path, value: Any) -> tuple[Any, Path]:  # noqa: ANN401 - a YAML value has any type
    """Return a copy of ``data`` with the value in place, and its path with list indices as numbers."""
    if not parts:
        return value, above
    head, rest = parts[0], parts[1:]
    if isinstance(data, list):
        index = _index(head, len(data), above)
        entry, path = _changed(data[index], rest, (*above, index), value)
        return [*data[:index], entry, *data[index + 1 :]], path
    if data is None:
        data = {}
    if not isinstance(data, dict):
        raise LookupError(f"'{dotted(above)}' is the value {data!r} and has no keys")  # noqa: TRY004 - like a missing key
    entry, path = _changed(data.get(head), rest, (*above, head), value)
    return {**data, head: entry}, path


def _index(text: str, length: int, above: Path) -> int:
    if not text.isdecimal():
        raise LookupError(
            f"'{dotted(above)}' is a list; give the number of an entry, counted from 0, not '{text}'"
        )
    if int(text) >= length:
        has = f"has entries 0 to {length - 1}" if length else "is empty"
        raise LookupError(f"'{dotted(above)}' {has}; there is no entry {text}")
    return int(text)
