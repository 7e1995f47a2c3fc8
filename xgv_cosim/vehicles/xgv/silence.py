"""Controllers that fall silent lose control (XGV-65)."""

from __future__ import annotations

import math
from collections.abc import Iterable

from jaus.address import JausAddress

_ROUNDING_S = 1e-9
"""Deadlines are sums of floats; one this near is due."""


class SilenceWatch:
    """Knows when each controller was heard last; traffic of any kind counts.

    Args:
        timeout_s: Silence after which a controller has lost control; 0 means never.
    """

    def __init__(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._heard_s: dict[JausAddress, float] = {}

    def heard(self, sender: JausAddress, now_s: float) -> None:
        """Take note of traffic."""
        if self.timeout_s:
            self._heard_s[sender] = now_s

    def keep(self, controllers: Iterable[JausAddress]) -> None:
        """Forget whoever does not control anything, so that strangers cost no memory."""
        for sender in self._heard_s.keys() - set(controllers):
            del self._heard_s[sender]

    def delay(self, stopped_s: float) -> None:
        """Leave out a time in which the controller's clock stood still."""
        self._heard_s = {sender: heard_s + stopped_s for sender, heard_s in self._heard_s.items()}

    @property
    def next_deadline_s(self) -> float:
        """Return when the first of those heard has been silent for too long, ``inf`` for never."""
        return min(self._heard_s.values(), default=math.inf) + self.timeout_s

    def silent(self, now_s: float) -> list[JausAddress]:
        """Return who has been silent for too long."""
        latest_s = now_s - self.timeout_s + _ROUNDING_S
        return [sender for sender, heard_s in self._heard_s.items() if heard_s <= latest_s]
