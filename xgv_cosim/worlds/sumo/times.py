"""SUMO's times in options: seconds, or hours, minutes and seconds, with days before them."""

from __future__ import annotations

_SECONDS = (1.0, 60.0, 3600.0, 86400.0)


def seconds_of(text: str) -> float:
    """Return a time that SUMO has accepted, ``300``, ``0:05:00`` or ``1:00:00:00``, in seconds."""
    return sum(float(part) * unit for part, unit in zip(reversed(text.split(":")), _SECONDS, strict=False))
