"""Units that stand at the end of a key's name, for hints about a key with the wrong unit."""

from __future__ import annotations

_KNOWN = {
    "_per_m_s": "1/m per second",
    "_per_m": "1/m",
    "_mps3": "m/s³",
    "_mps2": "m/s²",
    "_mps": "m/s",
    "_rad": "radians",
    "_kg": "kilograms",
    "_m": "metres",
    "_s": "seconds",
}
"""Suffixes that scenario files use, longest first where one ends in the other."""

# fmt: off
_FOREIGN = (
    "_m_per_s2", "_m_per_s", "_m_s2", "_m_s", "_ms2", "_seconds", "_second", "_secs", "_sec", "_minutes",
    "_min", "_hours", "_h", "_ms", "_millis", "_us", "_ns", "_ticks", "_steps", "_kmh", "_kph", "_mph",
    "_knots", "_fps", "_ft", "_feet", "_km", "_cm", "_mm", "_metres", "_meters", "_meter", "_deg",
    "_degrees", "_radians", "_rps", "_g", "_percent", "_hz",
)
# fmt: on
"""Suffixes people write that scenario files do not use."""

_SUFFIXES = tuple(sorted((*_KNOWN, *_FOREIGN), key=len, reverse=True))


def unit_words(key: str) -> str | None:
    """Return the unit that ``key`` names, in words, or None where it names none (``at_s`` is "seconds")."""
    return next((words for suffix, words in _KNOWN.items() if key.endswith(suffix)), None)


def without_unit(key: str) -> str:
    """Return ``key`` without its unit, known or foreign: ``at_s``, ``at_ms`` and ``at`` all give ``at``."""
    return next((key.removesuffix(suffix) for suffix in _SUFFIXES if key.endswith(suffix)), key)
