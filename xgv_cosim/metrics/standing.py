"""For how long each bound vehicle has stood without a break."""

from __future__ import annotations

import numpy as np

from xgv_cosim.fleet import Fleet
from xgv_cosim.metrics.standstill import is_slow


class Standing:
    """Keeps when each slot's vehicle has moved last; columns of shape ``(num_slots,)``."""

    def __init__(self) -> None:
        self._ids: tuple[str, ...] | None = None
        self._slot_of: dict[str, int] = {}
        self._moved_s = np.zeros(0)
        self._t_s = 0.0

    def note(self, t_s: float, fleet: Fleet) -> None:
        """Note one step; a vehicle that is newly bound counts from then on."""
        self._t_s = t_s
        if fleet.bound_ids is not self._ids:
            self._meet(t_s, fleet)
        self._moved_s[~is_slow(fleet.motion.speed_mps)] = t_s

    def _meet(self, t_s: float, fleet: Fleet) -> None:
        moved_s = np.full(fleet.num_slots, t_s)
        for slot, name in fleet:
            if self._slot_of.get(name) == slot:
                moved_s[slot] = self._moved_s[slot]
        self._ids, self._moved_s = fleet.bound_ids, moved_s
        self._slot_of = {name: slot for slot, name in fleet}

    def lasts_s(self) -> dict[str, float]:
        """Return for how long each vehicle has stood that is bound now, 0 for one that moves."""
        return {name: self._t_s - float(self._moved_s[slot]) for name, slot in self._slot_of.items()}
