"""Who is bound: ids, and a row of ``ROSTER`` for each, in the order in which they are placed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.placing import REFUSED_STEPS
from xgv_cosim.worlds.sumo.placing_tables import KINDS, ROSTER, Way, new_row

if TYPE_CHECKING:
    from collections.abc import Iterator

    from xgv_cosim.actuation import CouplingKind
    from xgv_cosim.worlds.sumo.lane_table import Table


class Roster:
    """The bound vehicles of an open simulation."""

    def __init__(self) -> None:
        self._ids: tuple[str, ...] = ()
        self._rows: Table = np.zeros(0, ROSTER)
        self._place: dict[str, int] = {}

    def __contains__(self, vehicle_id: object) -> bool:
        return vehicle_id in self._place

    def __iter__(self) -> Iterator[str]:
        return iter(self._place)

    def __len__(self) -> int:
        return len(self._place)

    @property
    def ids(self) -> tuple[str, ...]:
        """Return who is bound, in the order in which they were placed last."""
        return self._ids

    def add(self, vehicle_id: str, kind: CouplingKind) -> None:
        """Take a vehicle in, as one that nothing is known of."""
        self._set((*self._ids, vehicle_id), np.concatenate([self._rows, new_row(kind)]))

    def remove(self, vehicle_id: str) -> None:
        """Drop a vehicle, if it is there."""
        place = self._place.get(vehicle_id)
        if place is not None:
            self._set(self._ids[:place] + self._ids[place + 1 :], np.delete(self._rows, place))

    def in_order_of(self, ids: tuple[str, ...]) -> Table:
        """Return the rows of ``ids``, for reading and writing; whoever is left out comes after them.

        Raises:
            WorldError: One of them is not bound.
        """
        if ids is not self._ids and ids != self._ids[: len(ids)]:
            for vehicle_id in ids:
                if vehicle_id not in self._place:
                    raise WorldError(f"vehicle {vehicle_id!r} is placed but not bound; bind it first")
            named = frozenset(ids)
            order = (*ids, *(name for name in self._ids if name not in named))
            self._set(order, self._rows[[self._place[name] for name in order]])
        return self._rows[: len(ids)]

    def way_of(self, vehicle_id: str) -> Way:
        """Return which coupling wrote a vehicle last."""
        return Way(self._rows["way"][self._place[vehicle_id]])

    def set_kind(self, vehicle_id: str, kind: CouplingKind) -> None:
        """Choose how a vehicle is written from the next step on."""
        self._rows["kind"][self._place[vehicle_id]] = KINDS.index(kind)

    def refuse_mirror(self, vehicle_id: str) -> None:
        """Place a vehicle freely for a while: SUMO did otherwise than was foreseen."""
        if vehicle_id in self._place:
            self._rows["exact_steps"][self._place[vehicle_id]] = REFUSED_STEPS

    def _set(self, ids: tuple[str, ...], rows: Table) -> None:
        self._ids, self._rows = ids, rows
        self._place = {name: place for place, name in enumerate(ids)}
