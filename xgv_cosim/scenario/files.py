"""Checks that the files a scenario names are there: the SUMO configuration and what it names in turn."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.problems import Path as KeyPath
from xgv_cosim.scenario.problems import Problem, dotted, word_hint

if TYPE_CHECKING:
    from pathlib import Path

    from xgv_cosim.scenario.model import Scenario

_CONFIG_KEY: KeyPath = ("world", "sumo", "config")
_FILE_OPTIONS = frozenset(
    {"net-file", "route-files", "additional-files", "n", "r", "a", "net", "routes", "additional"}
)
"""SUMO options that name input files, with their short and older names."""


def file_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Return one problem for each file that a run would miss; empty if all are there."""
    config = scenario.world.sumo.config
    path = scenario.source.resolve(config)
    place = scenario.source.locate(_CONFIG_KEY)
    key = dotted(_CONFIG_KEY)
    place = "" if place == key else place

    def problem(message: str, hint: str = "") -> Problem:
        return Problem(message, key, place, hint)

    if not path.is_file():
        near = word_hint(path.name, _names_in(path.parent))
        return (problem(f"no file {config!r} in {scenario.source.folder}", near),)
    try:
        root = ET.parse(path).getroot()  # noqa: S314 - the user's own file, which SUMO reads next
    except ET.ParseError as error:
        return (problem(f"{config!r} is not XML: {error}"),)
    except OSError as error:
        return (problem(f"{config!r} cannot be read: {error.strerror}"),)
    missing = [name for name in _named_files(root) if not (path.parent / name).is_file()]
    return tuple(
        problem(
            f"{config!r} names the file {name!r}, which is not there", word_hint(name, _names_in(path.parent))
        )
        for name in missing
    )


def require_files(scenario: Scenario) -> None:
    """Make sure that every file the scenario names is there.

    Raises:
        ScenarioError: One is not; ``problems`` has one line for each.
    """
    problems = file_problems(scenario)
    if problems:
        raise ScenarioError(f"{scenario.name}: files are missing", tuple(map(str, problems)))


def input_files(scenario: Scenario) -> tuple[Path, ...]:
    """Return the SUMO configuration and the files that it names, as absolute paths.

    Raises:
        ScenarioError: One is not there, or the configuration is not XML.
    """
    require_files(scenario)
    config = scenario.source.resolve(scenario.world.sumo.config)
    root = ET.parse(config).getroot()  # noqa: S314 - the user's own file, which SUMO reads next
    return (config, *((config.parent / name).resolve() for name in _named_files(root)))


def _named_files(root: ET.Element) -> list[str]:
    """Return the input files of a SUMO configuration, without addresses on the network."""
    values = [element.get("value", "") for element in root.iter() if element.tag in _FILE_OPTIONS]
    names = [name.strip() for value in values for name in value.split(",")]
    return [name for name in names if name and "://" not in name]


def _names_in(folder: Path) -> list[str]:
    return [entry.name for entry in folder.iterdir()] if folder.is_dir() else []
