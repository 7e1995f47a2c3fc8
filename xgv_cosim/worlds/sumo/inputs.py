"""A look at SUMO's input files before SUMO reads them: it crashes on some that are not well-formed XML."""

from __future__ import annotations

import gzip
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat  # no entity is expanded from outside; the files are the user's own

from xgv_cosim.errors import WorldConfigurationError

if TYPE_CHECKING:
    from collections.abc import Callable

_LONG_NAMES = {
    "-n": "net-file",
    "--net": "net-file",
    "-r": "route-files",
    "--route-files": "route-files",
    "-a": "additional-files",
    "--additional": "additional-files",
    "net": "net-file",
    "route": "route-files",
    "additional": "additional-files",
    "n": "net-file",
    "r": "route-files",
    "a": "additional-files",
}
_FILE_OPTIONS = frozenset({"net-file", "route-files", "additional-files"})


def check_inputs(config_file: Path, options: tuple[str, ...] = ()) -> None:
    """Check that the configuration and the files it names are well-formed XML.

    Files that do not exist are left to SUMO, which names them itself.

    Raises:
        WorldConfigurationError: A file is not well-formed (names file, line and column), or the network
            file is none.
    """
    named: list[tuple[str, Path]] = []

    def start_element(tag: str, attributes: dict[str, str]) -> None:
        option = _LONG_NAMES.get(tag, tag)
        if option in _FILE_OPTIONS:
            names = attributes.get("value", "").split(",")
            named.extend((option, config_file.parent / name.strip()) for name in names)

    _parse(config_file, start_element)
    for option, value in zip_longest(options, options[1:], fillvalue=""):
        name, _, joined = option.partition("=")
        long_name = _LONG_NAMES.get(name, name.removeprefix("--"))
        if long_name in _FILE_OPTIONS:
            named.extend((long_name, Path(part.strip())) for part in (joined or value).split(","))
    for long_name, file in named:
        if long_name == "net-file":
            _check_network(file)
        else:
            _parse(file)


def _check_network(file: Path) -> None:
    """Check that a network file begins like one: SUMO crashes on ``<net>`` without a version."""
    roots: list[tuple[str, bool]] = []

    def start_element(tag: str, attributes: dict[str, str]) -> None:
        if not roots:
            roots.append((tag, "version" in attributes))

    _parse(file, start_element)
    if roots and roots[0] != ("net", True):
        raise WorldConfigurationError(
            f"SUMO network {file} is not one: got <{roots[0][0]}> as its first element, expected "
            '<net version="..."> as netconvert writes it'
        )


def _parse(file: Path, start_element: Callable[[str, dict[str, str]], None] | None = None) -> None:
    if not file.is_file():
        return
    parser = expat.ParserCreate()
    if start_element is not None:
        parser.StartElementHandler = start_element
    opener = gzip.open if file.suffix == ".gz" else Path.open
    try:
        with opener(file, "rb") as stream:
            parser.ParseFile(stream)
    except expat.ExpatError as error:
        raise WorldConfigurationError(f"SUMO input file {file} is not well-formed XML: {error}") from error
    except OSError as error:
        raise WorldConfigurationError(f"SUMO input file {file} cannot be read: {error}") from error
