"""So many of something in a second, and no more."""

from __future__ import annotations

import math
from dataclasses import dataclass

_WINDOW_S = 1.0


@dataclass(slots=True)
class Allowance:
    """Counts what is taken, and begins anew a second after the first that was counted."""

    most: int
    """So many may be taken in one second."""
    taken: int = 0
    began_s: float = -math.inf

    def take(self, now_s: float) -> bool:
        """Return whether one more may be taken now."""
        if not self.began_s <= now_s < self.began_s + _WINDOW_S:
            self.taken, self.began_s = 0, now_s
        if self.taken >= self.most:
            return False
        self.taken += 1
        return True
