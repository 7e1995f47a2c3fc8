"""A run in real time: a step begins when the wall clock has come to its time, and clients are served."""

from __future__ import annotations

import time
from collections.abc import Callable

COMMUNICATION_PERIOD_S = 0.01
"""Between two looks at what clients have sent: the communication period of wire links in real time."""


class RealTime:
    """Keeps the simulation from running ahead of the wall's clock.

    A run that is slower than the wall's clock catches up when it can; it never skips a step.

    Args:
        communicate: Serves clients, given the time on the network; called once per communication period.
        clock: Seconds that never go back, for tests.
        sleep: Waits so many seconds, likewise.
    """

    def __init__(
        self,
        communicate: Callable[[float], None],
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._communicate = communicate
        self._clock = clock
        self._sleep = sleep
        self._began_s: float | None = None
        self.most_behind_s = 0.0
        """How far the simulation was behind the wall's clock at most."""

    def wait_until(self, time_s: float) -> None:
        """Wait until a simulation time has come, and serve clients until then, at least once.

        The time on the network goes on with the wall's clock meanwhile, up to ``time_s``.
        """
        if self._began_s is None:
            self._began_s = self._clock() - time_s  # the first step has been made: this is its end
        self.most_behind_s = max(self.most_behind_s, self._clock() - self._began_s - time_s)
        while True:
            now_s = self._clock() - self._began_s
            self._communicate(min(now_s, time_s))
            if now_s >= time_s:
                return
            took_s = self._clock() - self._began_s - now_s
            left_s = time_s - now_s - took_s
            self._sleep(max(0.0, min(COMMUNICATION_PERIOD_S - took_s, left_s)))
