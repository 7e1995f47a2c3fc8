"""SUMO's command-line options as it reads them: long and short names, synonyms, ``--name=value``.

SUMO refuses an option that is given twice, under whatever name. So what the user gives is taken apart
before anything is added to it, and put together again under the full names.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.errors import WorldConfigurationError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

_SYNONYMS = {
    "c": "configuration-file",
    "configuration": "configuration-file",
    "n": "net-file",
    "net": "net-file",
    "r": "route-files",
    "routes": "route-files",
    "a": "additional-files",
    "additional": "additional-files",
    "w": "weight-files",
    "weights": "weight-files",
    "device.fcd-replay.file": "device.fcd-replay.files",
    "v": "verbose",
    "W": "no-warnings",
    "suppress-warnings": "no-warnings",
    "no-duration-log": "duration-log.disable",
    "srand": "seed",
    "abs-rand": "random",
    "b": "begin",
    "e": "end",
}
"""Full name of each synonym of an option that matters here."""
_SHORT_SWITCHES = frozenset("HvV?WtQGSDT")
"""Short options that need no value and can stand in a row: ``-vW``."""
INPUT_FILES = frozenset(
    {
        "net-file",
        "route-files",
        "additional-files",
        "weight-files",
        "load-state",
        "fcd-output.filter-edges.input-file",
        "device.ssm.filter-edges.input-file",
        "device.fcd-replay.files",
        "astar.all-distances",
        "astar.landmark-distances",
    }
)
"""Options that name files which the simulation reads."""
_RESERVED = {
    "configuration-file": "set world.sumo.config instead",
    "step-length": "set step_s instead",
    "seed": "set seed instead",
    "random": "a run must be repeatable; set seed instead",
    "error-log": "the run keeps SUMO's messages itself; use log for a file of your own",
}
"""Options that the scenario has keys of its own for."""
_VALUE_BEGINS = re.compile(r"[^-]|-\.?\d")
_ENVIRONMENT = re.compile(r"\$\{(?P<name>\w+)\}")


class Option(NamedTuple):
    """One option with its value."""

    name: str
    """Full name without hyphens; empty for a word that is no option."""
    value: str

    @property
    def argument(self) -> str:
        """Return the option as one word of the command line."""
        return f"--{self.name}={self.value}" if self.name else self.value


def full_name(name: str) -> str:
    """Return the name that SUMO's documentation gives an option."""
    return _SYNONYMS.get(name, name)


def parse_options(words: Sequence[str]) -> tuple[Option, ...]:
    """Return the options that stand in the words of a command line, in their order.

    Raises:
        WorldConfigurationError: One of them is for the scenario to say, in a key of its own.
    """
    options: list[Option] = []
    position = 0
    while position < len(words):
        word = words[position]
        following = words[position + 1] if position + 1 < len(words) else None
        if following and not _VALUE_BEGINS.match(following):
            following = None  # the next option
        found, takes_following = _read(word, following)
        options += found
        position += 2 if takes_following else 1
    for option in options:
        if option.name in _RESERVED:
            raise WorldConfigurationError(
                f"SUMO option --{option.name} cannot be given in world.sumo.options "
                f"(got {option.value!r}): {_RESERVED[option.name]}"
            )
    return tuple(options)


def _read(word: str, following: str | None) -> tuple[list[Option], bool]:
    """Return the options of one word, and whether the following word is the value of the last one."""
    if word.startswith("--"):
        name, equals, value = word[2:].partition("=")
        if equals or following is None:
            return [Option(full_name(name), value if equals else "true")], False
        return [Option(full_name(name), following)], True
    if not word.startswith("-") or word == "-":
        return [Option("", word)], False
    options: list[Option] = []
    for index, letter in enumerate(word[1:], start=1):
        rest = word[index + 1 :]
        if letter not in _SHORT_SWITCHES and rest:
            return [*options, Option(full_name(letter), rest.removeprefix("="))], False
        if not rest and following is not None:
            return [*options, Option(full_name(letter), following)], True
        options.append(Option(full_name(letter), "true"))
    return options, False


def files_of(option: Option, folder: Path) -> Iterator[Path]:
    """Yield the files that an option names, relative ones below ``folder``; no addresses on the network."""
    for part in option.value.split(","):
        name = _ENVIRONMENT.sub(lambda found: os.environ.get(found["name"], ""), part.strip())
        if name and "://" not in name:
            yield folder / name


def with_rooted_files(option: Option, folder: Path) -> Option:
    """Return the option with its input files below ``folder``, wherever the process works."""
    if option.name not in INPUT_FILES or "://" in option.value:
        return option
    return option._replace(value=",".join(str(file) for file in files_of(option, folder.absolute())))
