"""Warnings at the line of a user's script that has led to them, each of them once."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence

_NOT_THE_SCRIPT = frozenset({"xgv_cosim", "libsumo", "traci", "contextlib"})


class SumoOptionsWarning(UserWarning):
    """SUMO runs with options under which something stays hidden from a plugin, or happens to its vehicles."""


class ScriptWarnings:
    """Gives them, and remembers which it has given."""

    def __init__(self) -> None:
        self._given: set[str] = set()

    def give(self, texts: Sequence[str], category: type[Warning]) -> None:
        """Warn of those that are new."""
        new = [text for text in texts if text not in self._given]
        self._given.update(new)
        if new:
            warnings.warn("\n".join(new), category, stacklevel=_frames_to_the_script())


def _frames_to_the_script() -> int:
    """Return how many calls away from ``warnings.warn`` in ``give`` the script stands."""
    frame, levels = sys._getframe(1), 1  # noqa: SLF001 - warnings offers no other way before Python 3.12
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] in _NOT_THE_SCRIPT:
        frame, levels = frame.f_back, levels + 1
    return levels
