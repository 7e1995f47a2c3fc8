"""``scenario.lock.yaml``: the whole scenario with its seed, versions and the digests of its inputs."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

import sumo_scenarios
from xgv_cosim.errors import ReplayError
from xgv_cosim.recording import LOCK, write_whole_file
from xgv_cosim.runs.versions import recorded_versions
from xgv_cosim.scenario.files import input_files
from xgv_cosim.scenario.loading import scenario_from_mapping
from xgv_cosim.scenario.model import Scenario

SCHEMA = "xgv-cosim/lock/1"


@dataclass(frozen=True, slots=True)
class Lock:
    """A lock file read back."""

    scenario: Scenario
    versions: dict[str, str]
    changed_inputs: tuple[str, ...]
    """Input files that are no longer what they were when the run was made."""


def write_lock(scenario: Scenario, folder: Path) -> None:
    """Write the lock file of a run.

    Raises:
        ScenarioError: An input file is not there.
        OSError: It cannot be written.
    """
    home = scenario.source.folder
    data = {
        "schema": SCHEMA,
        "folder": _portable(home),
        "seed": scenario.seed,
        "versions": recorded_versions(),
        "inputs": {_relative(path, home): _digest(path) for path in input_files(scenario)},
        "scenario": scenario.to_mapping(),
    }
    text = io.StringIO()
    yaml = YAML()
    yaml.default_flow_style = False
    yaml.dump(data, text)
    write_whole_file(folder / LOCK, text.getvalue().encode())


def read_lock(folder: Path) -> Lock:
    """Return the scenario of a run folder.

    Raises:
        ReplayError: There is no lock file, or it is not one.
    """
    path = folder / LOCK
    try:
        data: Any = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ReplayError(
            f"{path}: cannot be read ({error.strerror}); expected a run folder as 'xgv-cosim run' makes it"
        ) from error
    except YAMLError as error:
        raise ReplayError(f"{path}: not YAML: {error}") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        got = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise ReplayError(f"{path}: got schema {got!r}, expected {SCHEMA!r}")
    home = _home(str(data["folder"]))
    changed = tuple(name for name, digest in data["inputs"].items() if _digest_or_none(home / name) != digest)
    return Lock(scenario_from_mapping(data["scenario"], home), dict(data["versions"]), changed)


def _portable(folder: Path) -> str:
    """Return a packaged scenario's folder as ``package:name``, any other as an absolute path."""
    for info in sumo_scenarios.list_scenarios():
        if info.folder.resolve() == folder.resolve():
            return f"package:{info.name}"
    return str(folder)


def _home(text: str) -> Path:
    kind, _, name = text.partition(":")
    return sumo_scenarios.load(name) if kind == "package" else Path(text)


def _relative(path: Path, home: Path) -> str:
    return path.relative_to(home).as_posix() if path.is_relative_to(home) else str(path)


def _digest(path: Path) -> str:
    return "sha256:" + hashlib.sha256(path.read_bytes()).hexdigest()


def _digest_or_none(path: Path) -> str | None:
    return _digest(path) if path.is_file() else None
