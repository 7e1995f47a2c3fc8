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
        WorldError: A file is not well-formed; names file, line and column.
    """
    named: list[Path] = []

    def start_element(tag: str, attributes: dict[str, str]) -> None:
        if _LONG_NAMES.get(tag, tag) in _FILE_OPTIONS:
            named.extend(config_file.parent / name.strip() for name in attributes.get("value", "").split(","))

    _parse(config_file, start_element)
    for option, value in zip_longest(options, options[1:], fillvalue=""):
        name, _, joined = option.partition("=")
        if _LONG_NAMES.get(name, name.removeprefix("--")) in _FILE_OPTIONS:
            named.extend(Path(part.strip()) for part in (joined or value).split(","))
    for file in named:
        _parse(file)


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
