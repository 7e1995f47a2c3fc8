"""Checks that the files a scenario names are there: the SUMO configuration and what it names in turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.errors import ScenarioError, WorldConfigurationError
from xgv_cosim.scenario.problems import Path as KeyPath
from xgv_cosim.scenario.problems import Problem, dotted, word_hint
from xgv_cosim.worlds.sumo.inputs import sumo_input_files
from xgv_cosim.worlds.sumo.options import parse_options

if TYPE_CHECKING:
    from pathlib import Path

    from xgv_cosim.scenario.model import Scenario

_CONFIG_KEY: KeyPath = ("world", "sumo", "config")
_OPTIONS_KEY: KeyPath = ("world", "sumo", "options")


def file_problems(scenario: Scenario) -> tuple[Problem, ...]:
    """Return one problem for each file that a run would miss; empty if all are there."""
    sumo = scenario.world.sumo
    path = scenario.source.resolve(sumo.config)
    try:
        given = {option.name for option in parse_options(sumo.options)}
    except WorldConfigurationError as error:
        return (_problem(scenario, _OPTIONS_KEY, str(error)),)
    if not path.is_file():
        near = word_hint(path.name, _names_in(path.parent))
        text = f"no file {sumo.config!r} in {scenario.source.folder}"
        return (_problem(scenario, _CONFIG_KEY, text, near),)
    try:
        files = sumo_input_files(path, sumo.options)
    except WorldConfigurationError as error:
        return (_problem(scenario, _CONFIG_KEY, str(error)),)
    problems: list[Problem] = []
    for option, file in files:
        if file.is_file():
            continue
        name = str(file.relative_to(path.parent)) if file.is_relative_to(path.parent) else str(file)
        by_option = option in given
        text = f"--{option}" if by_option else repr(sumo.config)
        problems.append(
            _problem(
                scenario,
                _OPTIONS_KEY if by_option else _CONFIG_KEY,
                f"{text} names the file {name!r}, which is not there",
                word_hint(name, _names_in(path.parent)),
            )
        )
    return tuple(problems)


def _problem(scenario: Scenario, path: KeyPath, message: str, hint: str = "") -> Problem:
    place, key = scenario.source.locate(path), dotted(path)
    return Problem(message, key, "" if place == key else place, hint)


def require_files(scenario: Scenario) -> None:
    """Make sure that every file the scenario names is there.

    Raises:
        ScenarioError: One is not; ``problems`` has one line for each.
    """
    problems = file_problems(scenario)
    if problems:
        raise ScenarioError(f"{scenario.name}: files are missing", tuple(map(str, problems)))


def input_files(scenario: Scenario) -> tuple[Path, ...]:
    """Return the SUMO configuration and all files that SUMO will read, as absolute paths.

    Raises:
        ScenarioError: One is not there, or the configuration is not XML.
    """
    require_files(scenario)
    config = scenario.source.resolve(scenario.world.sumo.config)
    named = sumo_input_files(config, scenario.world.sumo.options)
    return tuple(dict.fromkeys((config, *(file.resolve() for _, file in named))))


def _names_in(folder: Path) -> list[str]:
    return [entry.name for entry in folder.iterdir()] if folder.is_dir() else []
