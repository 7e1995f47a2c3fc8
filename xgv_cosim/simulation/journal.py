"""The journal: every event of the run, handed at once to whoever records it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.snapshot import Snapshot


class Observer(Protocol):
    """Reads the run as it goes: a recorder, a metric, a progress bar. Changes nothing."""

    def record_event(self, event: Event) -> None:
        """Take one event."""
        ...

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Take the state after a world step that ended at ``tick``."""
        ...


class Journal:
    """Keeps the events and passes them on."""

    def __init__(self, observers: Sequence[Observer] = ()) -> None:
        self.events: list[Event] = []
        self._observers = tuple(observers)

    def note(
        self,
        t_s: float,
        vehicle: str,
        kind: str,
        before: str = "",
        after: str = "",
        reasons: tuple[str, ...] = (),
    ) -> None:
        """Enter one event."""
        event = Event(t_s, vehicle, kind, before, after, reasons)
        self.events.append(event)
        for observer in self._observers:
            observer.record_event(event)

    def step_done(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Show the observers the state after a step."""
        for observer in self._observers:
            observer.record_step(tick, fleet, snapshot)
