"""Where a scenario came from: its file, its text, and the folder its relative paths begin in."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from xgv_cosim.scenario.problems import Path as KeyPath
from xgv_cosim.scenario.problems import dotted

if TYPE_CHECKING:
    from collections.abc import Callable


@dataclass(frozen=True, slots=True)
class ScenarioSource:
    """Origin of a scenario. Two scenarios are equal when data and folder are, whatever the file."""

    folder: Path = field(default_factory=Path.cwd)
    """Absolute folder in which relative paths of the scenario begin."""
    path: Path | None = field(default=None, compare=False)
    """The scenario file, None for a scenario made from a mapping."""
    text: str = field(default="", compare=False)
    """Text of the file as it was read."""
    overrides: tuple[str, ...] = field(default=(), compare=False)
    """The ``--set`` options that were applied."""
    locate: Callable[[KeyPath], str] = field(default=dotted, compare=False, repr=False)
    """Returns the place of a value, as messages show it (``file:line:column``)."""

    def resolve(self, relative: str) -> Path:
        """Return the absolute path of a file that the scenario names."""
        return (self.folder / relative).resolve()

    def where(self, *path: str | int) -> str:
        """Return the place of a value for a message: ``file:line:column: injections.0.vehicles``."""
        place, key = self.locate(path), dotted(path)
        return key if place in {"", key} else f"{place}: {key}"
