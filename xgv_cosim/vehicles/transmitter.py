"""The hand-held transmitter of a wireless emergency stop: one radio that any number of vehicles hear.

It sends a frame at once when its toggle or its button moves, and one every frame period in any case. What
it asks for, and when its radio was silent, is kept with times: a receiver looks back when it has to.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from xgv_cosim.injection import InjectionKind

_ROUNDING_S = 1e-9
"""Times are sums of floats; two this near are the same."""


class Demand(NamedTuple):
    """What a transmitter asks for, or which of a receiver's relays are open."""

    pause: bool
    stop: bool


RUN = Demand(pause=False, stop=False)

TRANSMITTER_KINDS: Mapping[InjectionKind, str] = MappingProxyType(
    {
        InjectionKind.ESTOP_PAUSE: "its toggle stands at pause",
        InjectionKind.ESTOP_DISABLE: "its stop button is pressed",
        InjectionKind.LINK: "its radio sends nothing",
    }
)
"""What can be injected at a transmitter itself, and what that does to it."""


class Transmitter:
    """A run/pause toggle, a stop button and a radio.

    Several may hold the same control (an injection and an operator's, for one car and for another); it is
    released with the last.
    """

    def __init__(self) -> None:
        self._moved: list[tuple[float, Demand]] = []
        self._switched: list[tuple[float, bool]] = []
        """(time, silent from then on) of the radio."""
        self._holders: dict[InjectionKind, set[str]] = {kind: set() for kind in TRANSMITTER_KINDS}

    @property
    def revision(self) -> int:
        """Return how often toggle and button have moved and the radio has been switched so far."""
        return len(self._moved) + len(self._switched)

    @property
    def demand(self) -> Demand:
        """Return how toggle and button stand now."""
        return self._moved[-1][1] if self._moved else RUN

    @property
    def is_silent(self) -> bool:
        """Return whether the radio sends nothing from now on."""
        return bool(self._switched) and self._switched[-1][1]

    def use(self, kind: InjectionKind, holder: str, now_s: float, *, begins: bool) -> None:
        """Let somebody hold a control of ``TRANSMITTER_KINDS``, or let go of it.

        Args:
            kind: What is held.
            holder: Who holds it; letting go what one does not hold has no effect.
            now_s: The time.
            begins: Whether he begins or ends.
        """
        holders = self._holders[kind]
        holders.add(holder) if begins else holders.discard(holder)
        match kind:
            case InjectionKind.ESTOP_PAUSE:
                self.set(now_s, pause=bool(holders))
            case InjectionKind.ESTOP_DISABLE:
                self.set(now_s, stop=bool(holders))
            case _:
                self.set_silent(now_s, silent=bool(holders))

    def set(self, now_s: float, *, pause: bool | None = None, stop: bool | None = None) -> None:
        """Move toggle or button; None leaves it as it is. Moving sends a frame at once."""
        before = self.demand
        after = Demand(before.pause if pause is None else pause, before.stop if stop is None else stop)
        if after != before:
            self._moved.append((now_s, after))

    def set_silent(self, now_s: float, *, silent: bool) -> None:
        """Switch the radio off or on; a frame of this very time is still as before."""
        if silent != self.is_silent:
            self._switched.append((now_s, silent))

    def move_after(self, time_s: float) -> float:
        """Return when toggle or button move first after ``time_s``, ``inf`` if they have not yet."""
        return min((moved for moved, _ in self._moved if moved > time_s + _ROUNDING_S), default=math.inf)

    def num_moves(self, until_s: float) -> int:
        """Return how often toggle and button have moved up to a time, that time included."""
        return sum(moved_s <= until_s + _ROUNDING_S for moved_s, _ in self._moved)

    def demand_at(self, time_s: float) -> Demand:
        """Return what a frame that was sent at ``time_s`` asks for."""
        for moved_s, demand in reversed(self._moved):
            if moved_s <= time_s + _ROUNDING_S:
                return demand
        return RUN

    def is_silent_at(self, time_s: float) -> bool:
        """Return whether a frame of ``time_s`` was never sent."""
        for switched_s, silent in reversed(self._switched):
            if switched_s < time_s - _ROUNDING_S:
                return silent
        return False

    def has_changed_after(self, time_s: float) -> bool:
        """Return whether toggle or button have moved, or the radio was switched, after ``time_s``."""
        return any(at_s > time_s + _ROUNDING_S for at_s, _ in (*self._moved, *self._switched))

    def frame_before(self, time_s: float, period_s: float) -> float:
        """Return when the last frame up to ``time_s`` was due, that time included."""
        regular = math.floor((time_s + _ROUNDING_S) / period_s) * period_s
        return max([regular, *(moved for moved, _ in self._moved if moved <= time_s + _ROUNDING_S)])

    def frame_after(self, time_s: float, period_s: float) -> float:
        """Return when the first frame after ``time_s`` is due, as far as is known now."""
        regular = (math.floor((time_s + _ROUNDING_S) / period_s) + 1) * period_s
        return min([regular, *(moved for moved, _ in self._moved if moved > time_s + _ROUNDING_S)])
