"""Scenarios that come with the package, as data: one folder each, with SUMO files and a scenario.yaml.

Standard library only; nothing here imports the plugin.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

__all__ = ["ScenarioInfo", "list_scenarios", "load"]

_DESCRIPTION = re.compile(r"^description:[ \t]+(?P<quote>[\"']?)(?P<text>.*?)(?P=quote)[ \t]*$", re.MULTILINE)
"""The key ``description`` at the top level of a scenario file; it stands on one line."""


@dataclass(frozen=True, slots=True)
class ScenarioInfo:
    """A packaged scenario."""

    name: str
    """Name by which ``xgv-cosim run`` finds it."""
    description: str
    """One line: what it shows."""
    folder: Path
    """Folder on disk."""


def list_scenarios() -> tuple[ScenarioInfo, ...]:
    """Return every packaged scenario, by name."""
    folders = sorted(file.parent for file in _root().glob("*/scenario.yaml"))
    return tuple(ScenarioInfo(folder.name, _description(folder), folder) for folder in folders)


def load(name: str) -> Path:
    """Return the folder of a packaged scenario.

    Raises:
        LookupError: There is no scenario of this name.
    """
    folders = {info.name: info.folder for info in list_scenarios()}
    if name not in folders:
        raise LookupError(f"no packaged scenario {name!r}; there are: {', '.join(folders) or 'none'}")
    return folders[name]


def _root() -> Path:
    # SUMO opens the files itself, so they must lie on disk: importing from a zip file is not supported.
    return Path(str(resources.files(__name__)))


def _description(folder: Path) -> str:
    found = _DESCRIPTION.search((folder / "scenario.yaml").read_text(encoding="utf-8"))
    return found["text"] if found else ""
