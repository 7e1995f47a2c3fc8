"""What must hold of a vehicle before something happens to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple


class Disc(NamedTuple):
    """A place: all points within a distance of its centre, frame east-north-up."""

    x_m: float
    y_m: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class Condition:
    """All that is given must hold of a bound vehicle at the end of one world step; None: it does not matter.

    Gaps are bumper to bumper, positions those of the front bumper.
    """

    speed_above_mps: float | None = None
    speed_below_mps: float | None = None
    gap_below_m: float | None = None
    """Gap to the leader; a vehicle without one never meets it."""
    lanes: str | None = None
    """World's name of the lane, or a pattern of names."""
    position_above_m: float | None = None
    """Distance from the beginning of its lane."""
    near: Disc | None = None
    other: tuple[str, str] | None = None
    """(vehicle id, safety mode) of another bound vehicle; one that is not bound never meets it."""

    def words(self) -> tuple[str, ...]:
        """Return what is given in words, for events and messages."""
        return tuple(self._words())

    def _words(self) -> Iterator[str]:
        if self.speed_above_mps is not None:
            yield f"speed above {self.speed_above_mps:g} m/s"
        if self.speed_below_mps is not None:
            yield f"speed below {self.speed_below_mps:g} m/s"
        if self.gap_below_m is not None:
            yield f"gap below {self.gap_below_m:g} m"
        if self.lanes is not None:
            yield f"on lane {self.lanes}"
        if self.position_above_m is not None:
            yield f"beyond {self.position_above_m:g} m of the lane"
        if self.near is not None:
            x_m, y_m, radius_m = self.near
            yield f"within {radius_m:g} m of ({x_m:g}, {y_m:g})"
        if self.other is not None:
            yield f"{self.other[0]} in {self.other[1]}"
