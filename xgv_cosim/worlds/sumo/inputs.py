"""SUMO's input files: which ones a configuration and its options name, and a look at them before SUMO's.

SUMO crashes on some files that are not well-formed XML. Loads no libsumo.
"""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.parsers import expat  # no entity is expanded from outside; the files are the user's own

from xgv_cosim.errors import WorldConfigurationError
from xgv_cosim.worlds.sumo.options import INPUT_FILES, Option, files_of, full_name, parse_options

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import IO

_XML_OPTIONS = frozenset({"net-file", "route-files", "additional-files", "weight-files", "load-state"})


TRUE = frozenset({"1", "yes", "true", "on", "x", "t"})
"""What SUMO takes for true."""
_PIECE_BYTES = 65536


class InputFile(NamedTuple):
    """A file that SUMO will read."""

    option: str
    """Full name of the option that names it."""
    path: Path


def sumo_input_files(config_file: Path, options: Sequence[str] = ()) -> tuple[InputFile, ...]:
    """Return the files that a configuration and further options name, whether they are there or not.

    Relative names lie below the folder of the configuration, those in ``options`` too. An option in
    ``options`` replaces the configuration's.

    Raises:
        WorldConfigurationError: The configuration is not well-formed or cannot be read, or ``options``
            holds one that is for the scenario to say.
    """
    given = [option for option in parse_options(options) if option.name in INPUT_FILES]
    replaced = {option.name for option in given}
    configured = [option for option in configured_options(config_file) if option.name not in replaced]
    return tuple(
        InputFile(option.name, file)
        for option in (*configured, *given)
        if option.name in INPUT_FILES
        for file in files_of(option, config_file.parent)
    )


def configured_options(config_file: Path) -> list[Option]:
    """Return the options of a configuration file: elements with ``value=``, ``v=`` or text.

    Raises:
        WorldConfigurationError: The configuration is not well-formed or cannot be read.
    """
    options: list[Option] = []
    text: list[str] = []

    def start_element(tag: str, attributes: dict[str, str]) -> None:
        text.clear()
        value = attributes.get("value") or attributes.get("v", "")
        if value:
            options.append(Option(full_name(tag), value))

    def end_element(tag: str) -> None:
        value = "".join(text).strip()
        text.clear()
        if value:
            options.append(Option(full_name(tag), value))

    _parse(config_file, start_element, end_element, text.append)
    return options


def check_inputs(config_file: Path, options: Sequence[str] = ()) -> None:
    """Check that the configuration and the files it names are well-formed XML, and ask for no other model.

    Files that do not exist are left to SUMO, which names them itself.

    Raises:
        WorldConfigurationError: A file is not well-formed (names file, line and column), the network file is
            none, or SUMO would run a model that is not supported.
    """
    _check_models(config_file, options)
    for option, file in sumo_input_files(config_file, options):
        if option == "net-file":
            _check_network(file)
        elif option in _XML_OPTIONS:
            _parse(file)


def _check_models(config_file: Path, options: Sequence[str]) -> None:
    """Check that SUMO moves vehicles along their lanes one by one; ``options`` win over the configuration."""
    chosen = {option.name: option.value for option in configured_options(config_file)}
    given = {option.name: option.value for option in parse_options(options)}
    for name, (model, is_on) in _MODELS.items():
        value = given.get(name, chosen.get(name))
        if value is not None and is_on(value):
            where = "world.sumo.options" if name in given else str(config_file)
            raise WorldConfigurationError(
                f"{where} chooses SUMO's {model} (option {name}, got {value!r}), which is not supported; "
                "leave that option out"
            )


def _is_above_zero(value: str) -> bool:
    try:
        return float(value) > 0.0
    except ValueError:
        return False  # SUMO says what it expects


_MODELS = {
    "lateral-resolution": ("sublane model", _is_above_zero),
    "mesosim": ("mesoscopic model", lambda value: value.lower() in TRUE),
}
"""Models of SUMO that cannot be used: what they are, and whether the value of the option chooses them."""


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


def network_attributes(file: Path) -> dict[str, str] | None:
    """Return what a network file says of the whole network; None: there is no such file here."""
    roots: list[dict[str, str]] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda _, attributes: roots.append(attributes)
    try:
        with _opened(file) as stream:
            while not roots and (piece := stream.read(_PIECE_BYTES)):
                parser.Parse(piece)
    except (expat.ExpatError, OSError):
        return None
    return roots[0] if roots else None


def _opened(file: Path) -> IO[bytes] | gzip.GzipFile:
    return gzip.open(file, "rb") if file.suffix == ".gz" else file.open("rb")


def _parse(
    file: Path,
    start_element: Callable[[str, dict[str, str]], None] | None = None,
    end_element: Callable[[str], None] | None = None,
    text: Callable[[str], None] | None = None,
) -> None:
    if not file.is_file():
        return
    parser = expat.ParserCreate()
    parser.StartElementHandler = start_element
    parser.EndElementHandler = end_element
    parser.CharacterDataHandler = text
    try:
        with _opened(file) as stream:
            parser.ParseFile(stream)
    except expat.ExpatError as error:
        raise WorldConfigurationError(f"SUMO input file {file} is not well-formed XML: {error}") from error
    except OSError as error:
        raise WorldConfigurationError(f"SUMO input file {file} cannot be read: {error}") from error
