"""Bound vehicles in the colour of their safety mode, in a window of the world."""

from __future__ import annotations

from collections.abc import Callable

from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.mode_styles import mode_style
from xgv_cosim.snapshot import Snapshot

Paint = Callable[[str, tuple[int, int, int] | None], None]
"""(vehicle id, red green blue from 0 to 255, or None for its own colour)"""


class ModePainter:
    """Observes a run and paints whoever has changed.

    Args:
        paint: Paints one vehicle.
        safety_mode_name: The profile's name for a safety mode code.
    """

    def __init__(self, paint: Paint, safety_mode_name: Callable[[int], str]) -> None:
        self._paint = paint
        self._safety_mode_name = safety_mode_name
        self._painted: dict[str, int] = {}
        """Safety mode in whose colour each vehicle is."""

    def record_event(self, event: Event) -> None:
        """Paint anew who is bound: another vehicle may have had its id."""
        if event.kind == "bound":
            self._painted.pop(event.vehicle, None)

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:  # noqa: ARG002 - an Observer
        """Paint whose mode has changed since the step before, and who is bound no longer."""
        bound = set()
        for slot, vehicle_id in fleet:
            bound.add(vehicle_id)
            mode = int(fleet.safety_mode[slot])
            if self._painted.get(vehicle_id) != mode:
                self._painted[vehicle_id] = mode
                self._paint(vehicle_id, mode_style(self._safety_mode_name(mode)).rgb)
        for vehicle_id in [name for name in self._painted if name not in bound]:
            del self._painted[vehicle_id]
            if vehicle_id in snapshot.index_of:
                self._paint(vehicle_id, None)
