"""What is wrong with a scenario, where it stands, and what its author probably meant."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from xgv_cosim.scenario.units import unit_words, without_unit

if TYPE_CHECKING:
    from collections.abc import Collection

Path = tuple[str | int, ...]
"""Way from the top of the file to a value: keys and list indices."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with a scenario file or with a ``--set`` option."""

    message: str
    """What is wrong and what is expected."""
    key: str = ""
    """Dotted key, for example ``injections.0.at_s``; empty for the whole file."""
    place: str = ""
    """``file:line:column``, or the option, or the file."""
    hint: str = ""
    """What the author probably meant, for example ``did you mean 'kind'?``."""

    def __str__(self) -> str:
        parts = [part for part in (self.place, self.key, self.message) if part]
        return ": ".join(parts) + (f" ({self.hint})" if self.hint else "")

    def as_row(self) -> dict[str, str]:
        """Return the row of ``check --json``."""
        return {
            "place": self.place,
            "key": self.key,
            "message": self.message,
            "hint": self.hint,
        }


def dotted(path: Path) -> str:
    """Return a path as people write it: ``injections.0.at_s``."""
    return ".".join(map(str, path))


def nearest(word: str, candidates: Collection[str]) -> str | None:
    """Return the candidate that ``word`` was probably meant to be, or None."""
    by_lower = {candidate.lower(): candidate for candidate in candidates}
    found = difflib.get_close_matches(word.lower().replace("-", "_"), by_lower, n=1, cutoff=0.6)
    return by_lower[found[0]] if found else None


def intended_key(key: str, candidates: Collection[str]) -> str | None:
    """Return the key that an unknown key was meant to be: the same but for its unit, or nearly the same."""
    stem = without_unit(key.lower().replace("-", "_"))
    same_but_unit = [candidate for candidate in candidates if without_unit(candidate) == stem]
    return same_but_unit[0] if same_but_unit else nearest(key, candidates)


def key_hint(intended: str | None) -> str:
    """Return the "did you mean" of a key, with its unit where it has one."""
    if intended is None:
        return ""
    words = unit_words(intended)
    return f"did you mean '{intended}'{f' ({words})' if words else ''}?"


def word_hint(word: object, candidates: Collection[str]) -> str:
    """Return the "did you mean" of a value, or nothing."""
    meant = nearest(word, candidates) if isinstance(word, str) else None
    return f"did you mean '{meant}'?" if meant else ""
