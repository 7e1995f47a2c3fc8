"""What is injected into which vehicle now: scheduled injections and operators' requests alike.

Several sources may hold the same thing (a scheduled pause and an operator's); it ends with the last.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from xgv_cosim.injection import Injection, InjectionKind
from xgv_cosim.traveller import Traveller

OPERATOR = -1
"""Source number of requests made through a vehicle handle."""


@dataclass(frozen=True, slots=True)
class Edge:
    """One thing begins or ends to act on one vehicle, or on a transmitter that several share."""

    vehicle_id: str
    """Empty where a transmitter is meant."""
    kind: InjectionKind
    code: int | None
    begins: bool
    transmitter: str = ""


class Devices:
    """Holds for each vehicle what acts on it, whether it is bound already or not."""

    def __init__(self, injections: Sequence[Injection] = ()) -> None:
        self._schedule: dict[int, list[tuple[int, Injection, bool]]] = {}
        self._ticks: list[int] = []
        self._num_sources = 0
        self._chosen: dict[int, tuple[str, ...]] = {}
        self._acting: dict[str, dict[tuple[InjectionKind, int | None], set[int]]] = {}
        """Vehicle id -> what acts on it -> the sources that hold it."""
        self._at_transmitter: dict[str, dict[InjectionKind, set[int]]] = {}
        """Transmitter -> what acts on it -> the injections that hold it."""
        for injection in injections:
            self.add(injection)

    def add(self, injection: Injection) -> None:
        """Schedule one more; what of it lies on ticks that are over never acts."""
        source, self._num_sources = self._num_sources, self._num_sources + 1
        self._schedule.setdefault(injection.tick, []).append((source, injection, True))
        if injection.end_tick is not None:
            self._schedule.setdefault(injection.end_tick, []).append((source, injection, False))
        self._ticks = sorted(self._schedule)

    def ticks_between(self, first: int, last: int) -> list[int]:
        """Return the scheduled ticks in ``[first, last)``."""
        return [tick for tick in self._ticks if first <= tick < last]

    def due(self, tick: int, bound: Sequence[Traveller]) -> list[Edge]:
        """Return the edges scheduled for ``tick``, in the order of the schedule.

        Args:
            tick: Control tick.
            bound: The vehicles bound now, from which patterns choose.
        """
        edges: list[Edge] = []
        for source, injection, begins in self._schedule.get(tick, []):
            if injection.transmitter:
                edges += self._change_transmitter(
                    source, injection.transmitter, injection.kind, begins=begins
                )
                continue
            if begins:
                self._chosen[source] = _chosen(injection, bound)
            for vehicle_id in self._chosen[source]:
                edges += self.change(source, vehicle_id, injection.kind, injection.code, begins=begins)
        return edges

    def chose_nobody(self, tick: int) -> list[Injection]:
        """Return the injections that began on ``tick`` and whose pattern chose no vehicle."""
        return [
            injection
            for source, injection, begins in self._schedule.get(tick, [])
            if begins and not injection.transmitter and not self._chosen.get(source)
        ]

    def change(
        self, source: int, vehicle_id: str, kind: InjectionKind, code: int | None = None, *, begins: bool
    ) -> list[Edge]:
        """Let a source begin or end to hold something; return the edge if that changes anything."""
        acting = self._acting.setdefault(vehicle_id, {})
        holders = acting.setdefault((kind, code), set())
        held_before = bool(holders)
        holders.add(source) if begins else holders.discard(source)
        if not holders:
            del acting[kind, code]
        return [] if bool(holders) == held_before else [Edge(vehicle_id, kind, code, begins)]

    def _change_transmitter(self, source: int, name: str, kind: InjectionKind, *, begins: bool) -> list[Edge]:
        holders = self._at_transmitter.setdefault(name, {}).setdefault(kind, set())
        held_before = bool(holders)
        holders.add(source) if begins else holders.discard(source)
        return [] if bool(holders) == held_before else [Edge("", kind, None, begins, name)]

    def acting_at(self, transmitter: str) -> list[InjectionKind]:
        """Return what acts on a transmitter itself now."""
        return [kind for kind, holders in self._at_transmitter.get(transmitter, {}).items() if holders]

    def acting_on(self, vehicle_id: str) -> Iterable[tuple[InjectionKind, int | None]]:
        """Return what acts on a vehicle now, in the order in which it began."""
        return tuple(self._acting.get(vehicle_id, ()))


def _chosen(injection: Injection, bound: Sequence[Traveller]) -> tuple[str, ...]:
    """Return the vehicles an injection acts on: those named, then those bound that match."""
    matching = [who.vehicle_id for who in bound if injection.matches and injection.matches(who)]
    return tuple(dict.fromkeys((*injection.vehicle_ids, *matching)))
