"""Limits of what others can cause: what has happened and waits to be taken, and so many in a second.

Of what waits, messages must not get lost, and notices may.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from itertools import count
from typing import Generic, TypeVar

E = TypeVar("E")
_WINDOW_S = 1.0


class EventQueue(Generic[E]):
    """Events in the order in which they happened. Notices, which strangers can cause, push out notices only.

    Args:
        max_events: How many events may wait; who fills the queue asks ``is_full`` before he takes another in.
        max_notices: How many notices may wait; the oldest give way.
    """

    def __init__(self, max_events: int, max_notices: int) -> None:
        self._max_events = max_events
        self._events: deque[tuple[int, E]] = deque()
        self._notices: deque[tuple[int, E]] = deque(maxlen=max_notices)
        self._numbers = count()
        self.dropped = 0
        """How many notices gave way."""

    def __len__(self) -> int:
        """Return how many events and notices wait."""
        return len(self._events) + len(self._notices)

    @property
    def is_full(self) -> bool:
        """Return whether as many events wait as may."""
        return len(self._events) >= self._max_events

    def add(self, event: E) -> None:
        """Append an event that must not get lost."""
        self._events.append((next(self._numbers), event))

    def note(self, notice: E) -> None:
        """Append a notice, of which there may be too many."""
        self.dropped += len(self._notices) == self._notices.maxlen
        self._notices.append((next(self._numbers), notice))

    def next(self) -> E | None:
        """Take away and return what happened first, None when that was all."""
        events, notices = self._events, self._notices
        if not events or (notices and notices[0][0] < events[0][0]):
            events = notices
        return events.popleft()[1] if events else None


@dataclass(slots=True)
class Allowance:
    """Counts what is taken, and begins anew a second after the first that was counted."""

    most: int
    """So many may be taken in one second."""
    taken: int = 0
    began_s: float = -math.inf

    def take(self, now_s: float, number: int = 1) -> bool:
        """Return whether so many more may be taken now."""
        if not self.began_s <= now_s < self.began_s + _WINDOW_S:
            self.taken, self.began_s = 0, now_s
        if self.taken + number > self.most:
            return False
        self.taken += number
        return True
