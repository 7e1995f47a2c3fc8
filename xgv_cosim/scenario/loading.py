"""Reads scenario files and reports everything that is wrong with them at once, each with its place."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

import sumo_scenarios
from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.checks import disagreements
from xgv_cosim.scenario.document import Document, read_document
from xgv_cosim.scenario.model import (
    DISAGREEMENTS_LATER,
    BindSection,
    ExpectationSection,
    InjectionSection,
    Scenario,
)
from xgv_cosim.scenario.overrides import Override, apply_overrides
from xgv_cosim.scenario.problems import Path as KeyPath
from xgv_cosim.scenario.problems import Problem, dotted, word_hint
from xgv_cosim.scenario.short_rows import add_rows
from xgv_cosim.scenario.source import ScenarioSource
from xgv_cosim.scenario.stacks import stack_class
from xgv_cosim.scenario.sumo_config import SUFFIX, mapping_of_config
from xgv_cosim.scenario.translation import problems_of
from xgv_cosim.scenario.xgv_section import XgvSection

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from xgv_cosim.scenario.section import Section

KEEP_STEP = "--keep-step"
_LEAVE_OUT = f"leave {KEEP_STEP} out: then the step is {Scenario.model_fields['step_s'].default} s"
FILE_NAME = "scenario.yaml"
"""Name of the scenario file in a scenario's folder."""


@dataclass(frozen=True, slots=True)
class Examination:
    """What came of reading a scenario: the scenario, or what is wrong with it."""

    name: str
    """What messages call it."""
    scenario: Scenario | None
    problems: tuple[Problem, ...]

    def require(self) -> Scenario:
        """Return the scenario.

        Raises:
            ScenarioError: Something is wrong with it; ``problems`` has one line for each mistake.
        """
        if self.scenario is None or self.problems:
            count = f"{len(self.problems)} problems" if len(self.problems) != 1 else "1 problem"
            raise ScenarioError(f"{self.name}: {count}", tuple(map(str, self.problems)))
        return self.scenario


@dataclass(frozen=True, slots=True)
class Additions:
    """What the caller adds to a scenario, as options of the command line spell it."""

    overrides: tuple[str, ...] = ()
    """``dotted.key=value`` each, as ``--set`` takes them; list entries by index."""
    bind: tuple[str, ...] = ()
    """Rows behind those of ``bind``, as ``--bind`` takes them."""
    inject: tuple[str, ...] = ()
    """Rows behind those of ``injections``, as ``--inject`` takes them."""
    keep_step: bool = False
    """Of a SUMO configuration: keep its step length."""


def load_scenario(
    path_or_name: str | Path,
    overrides: Sequence[str] = (),
    *,
    bind: Sequence[str] = (),
    inject: Sequence[str] = (),
    keep_step: bool = False,
) -> Scenario:
    """Return the scenario of a YAML file, a folder with a ``scenario.yaml``, a packaged name or a .sumocfg.

    A plain name such as ``hello`` means the packaged scenario first; ``./hello`` means the folder. A SUMO
    configuration (``.sumocfg``) needs no scenario file: it is run from its begin to its end, in the
    scenario's default step unless ``keep_step``.

    Args:
        path_or_name: File, folder or packaged name.
        overrides: ``dotted.key=value`` each, as ``--set`` takes them; list entries by index.
        bind: Further rows of ``bind``, as ``--bind`` takes them (see ``short_rows``).
        inject: Further rows of ``injections``, as ``--inject`` takes them.
        keep_step: Keep the step length of a SUMO configuration.

    Raises:
        ScenarioError: It is not there, or wrong; every mistake is a line
            ``file:line:column: dotted.key: message (did you mean 'x'?)`` of ``problems``.
    """
    additions = Additions(tuple(overrides), tuple(bind), tuple(inject), keep_step)
    return examine_scenario(path_or_name, additions).require()


def scenario_from_mapping(data: Mapping[str, Any], folder: str | Path) -> Scenario:
    """Return the scenario of plain data, for example of ``Scenario.to_mapping``.

    Args:
        data: The same keys as in a scenario file.
        folder: Folder in which relative paths begin.

    Raises:
        ScenarioError: Something is wrong; places are dotted keys.
    """
    source = ScenarioSource(folder=Path(folder).resolve())
    return _examine(dict(data), source, Document("the scenario"), [], [], located=False).require()


def override(scenario: Scenario, overrides: Sequence[str]) -> Scenario:
    """Return a scenario with values replaced by ``dotted.key=value`` options.

    Raises:
        ScenarioError: An option is wrong, or what it makes of the scenario is.
    """
    if not overrides:
        return scenario
    data, applied, problems = apply_overrides(scenario.to_mapping(), overrides)
    source = ScenarioSource(scenario.source.folder, overrides=(*scenario.source.overrides, *overrides))
    return _examine(data, source, Document("the scenario"), applied, problems, located=False).require()


def examine_scenario(path_or_name: str | Path, additions: Additions | None = None) -> Examination:
    """Read a scenario like ``load_scenario``, but return the problems instead of raising them.

    Raises:
        ScenarioError: There is no such scenario, its file cannot be read, or ``keep_step`` has no meaning.
        WorldConfigurationError: A SUMO configuration is not well-formed.
    """
    path, additions = find_scenario(path_or_name), additions or Additions()
    if path.suffix == SUFFIX:
        data = mapping_of_config(path, keep_step=additions.keep_step)
        kept = [Override(KEEP_STEP, ("step_s",), data["step_s"])] if additions.keep_step else []
        return _with_additions(data, path, "", Document(_shown(path)), additions, kept, located=False)
    if additions.keep_step:
        raise ScenarioError(
            f"{_shown(path)}: --keep-step is for a SUMO configuration ({SUFFIX}); a scenario names its own "
            "step_s"
        )
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ScenarioError(
            f"{_shown(path)}: not UTF-8 text (byte {error.start}); save the file as UTF-8"
        ) from error
    except OSError as error:
        raise ScenarioError(f"{_shown(path)}: cannot be read: {error.strerror}") from error
    document = read_document(text, _shown(path))
    if document.problems and document.data is None:
        return Examination(document.name, None, tuple(document.problems))
    return _with_additions(document.data, path, text, document, additions)


def _with_additions(
    data: Any,  # noqa: ANN401 - a YAML value has any type
    path: Path,
    text: str,
    document: Document,
    additions: Additions,
    given: Sequence[Override] = (),
    *,
    located: bool = True,
) -> Examination:
    """Add what the caller adds, then check the whole; ``given`` are options that are in the data already."""
    rows: list[Override] = []
    problems = list(document.problems)
    if isinstance(data, dict):
        data, rows, wrong_rows = add_rows(data, additions.bind, additions.inject)
        problems += wrong_rows
    data, applied, wrong_options = apply_overrides(data, additions.overrides)
    source = ScenarioSource(path.parent.resolve(), path.resolve(), text, additions.overrides)
    return _examine(
        data, source, document, [*given, *rows, *applied], [*problems, *wrong_options], located=located
    )


def find_scenario(path_or_name: str | Path) -> Path:
    """Return the scenario file that a path or a packaged name means.

    Raises:
        ScenarioError: There is none; near names are in the message.
    """
    packaged = {info.name: info.folder for info in sumo_scenarios.list_scenarios()}
    if isinstance(path_or_name, str) and path_or_name in packaged:
        return packaged[path_or_name] / FILE_NAME
    path = Path(path_or_name)
    if path.is_dir():
        if (path / FILE_NAME).is_file():
            return path / FILE_NAME
        raise ScenarioError(
            f"{_shown(path)}: a folder without {FILE_NAME}; 'xgv-cosim init DIR' makes a folder with one"
        )
    if path.exists():
        return path
    siblings = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
    if path.suffix == SUFFIX:
        near = word_hint(path.name, siblings)
        raise ScenarioError(f"no such file: {os.fspath(path)}{f' ({near})' if near else ''}")
    hint = word_hint(path.name, [*packaged, *siblings])
    raise ScenarioError(
        f"no scenario {str(path_or_name)!r}: neither a file or folder nor a packaged scenario"
        f"{f' ({hint})' if hint else ''}; packaged: {', '.join(packaged) or 'none'}"
    )


def _shown(path: Path) -> str:
    """Return a path as short as it stays true from the working folder."""
    try:
        return os.fspath(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return os.fspath(path)


def _examine(
    data: Any,  # noqa: ANN401 - a YAML value has any type
    source: ScenarioSource,
    document: Document,
    applied: Sequence[Override],
    problems: Sequence[Problem],
    *,
    located: bool = True,
) -> Examination:
    """Check plain data as a whole and return the scenario or every problem."""

    def from_option(path: KeyPath) -> str | None:
        owners = [o.option for o in applied if o.path[: len(path)] == path or path[: len(o.path)] == o.path]
        return owners[-1] if owners else None

    def place_of_key(path: KeyPath) -> str:
        return from_option(path) or (document.place_of_key(path) if located else "")

    def place_of_value(path: KeyPath) -> str:
        return from_option(path) or (document.place_of_value(path) if located else "")

    found = list(problems)
    if not isinstance(data, dict):
        what = "the file is empty" if data is None else "expected keys such as 'name: ...' at the top"
        found.append(Problem(f"not a scenario: {what}; 'xgv-cosim init DIR' makes one", place=document.name))
        return Examination(document.name, None, tuple(found))
    scenario: Scenario | None = None
    wrong: set[KeyPath] = set()
    try:
        # By way of JSON, since strict reading of JSON takes words for enumerations and lists for tuples.
        text = json.dumps(data, default=str)
        scenario = Scenario.model_validate_json(text, context={DISAGREEMENTS_LATER: True})
    except ValidationError as error:
        found += [
            replace(problem, hint=_LEAVE_OUT) if problem.place == KEEP_STEP else problem
            for problem in problems_of(error, place_of_key, place_of_value)
        ]
        wrong = {tuple(detail["loc"][:2]) for detail in error.errors(include_url=False)}
    for path, message in (*_disagreements(data, wrong), *_missing_stacks(data, wrong, source.folder)):
        found.append(Problem(message, dotted(path), place_of_value(path)))
    if found:
        return Examination(document.name, None, tuple(sorted(found, key=_in_file_order)))
    assert scenario is not None  # noqa: S101 - no problem was found, so it was made
    located_source = ScenarioSource(source.folder, source.path, source.text, source.overrides, place_of_value)
    return Examination(document.name, scenario.with_source(located_source), ())


def _in_file_order(problem: Problem) -> tuple[bool, int, int]:
    """Sort by line and column; what stands in no line, such as options, comes last."""
    line, _, column = problem.place.rpartition(":")
    line = line.rpartition(":")[2]
    if not (line.isdecimal() and column.isdecimal()):
        return (True, 0, 0)
    return (False, int(line), int(column))


def _disagreements(data: dict[str, Any], wrong: set[KeyPath]) -> list[tuple[KeyPath, str]]:
    """Return what does not fit together among the parts that are right in themselves."""

    def number(key: str, default: float | None) -> float | None:
        value = data.get(key, default)
        return None if (key,) in wrong or isinstance(value, str) else value

    def rows(key: str, section: type[Section]) -> dict[int, Any]:
        entries = data.get(key) or []
        if (key,) in wrong or not isinstance(entries, list):
            return {}
        return {
            index: section.model_validate_json(json.dumps(row, default=str))
            for index, row in enumerate(entries)
            if (key, index) not in wrong
        }

    def allow_both() -> bool | None:
        if any(path[0] == "xgv" for path in wrong):
            return None
        return XgvSection.model_validate_json(json.dumps(data.get("xgv", {}), default=str)).partial.allow_both

    return disagreements(
        number("duration_s", None),
        number("step_s", Scenario.model_fields["step_s"].default),
        rows("bind", BindSection),
        rows("injections", InjectionSection),
        rows("expect", ExpectationSection),
        allow_both=allow_both(),
        all_bind_rows=not any(path[0] == "bind" for path in wrong),
    )


def _missing_stacks(data: dict[str, Any], wrong: set[KeyPath], folder: Path) -> list[tuple[KeyPath, str]]:
    """Return which rows of ``bind`` name a class that cannot be had; the modules are imported for it."""
    rows = data.get("bind") or []
    found: list[tuple[KeyPath, str]] = []
    for index, row in enumerate(rows if isinstance(rows, list) else []):
        if not isinstance(row, dict) or ("bind", index) in wrong or ":" not in str(row.get("stack", "")):
            continue
        try:
            stack_class(row["stack"], folder, row.get("stack_options") or {})
        except ScenarioError as error:
            found.append((("bind", index, "stack"), str(error)))
    return found
