"""Simulation time: the world step, the control tick, and the way back from seconds to ticks.

Time is counted in whole control ticks, so that sums of 0.1 never drift. No wall clock is read here.
"""

from __future__ import annotations

from dataclasses import dataclass

from xgv_cosim.errors import ScenarioError

CONTROL_TICK_S = 0.01
"""The XGV's control period, in which device edges, time-outs and modes act (XGV-71)."""


@dataclass(slots=True)
class Clock:
    """Counts control ticks since the start of the run.

    Args:
        step_s: World step; a whole number of control ticks.

    Raises:
        ScenarioError: The world step is not a whole, positive number of control ticks.
    """

    step_s: float = 0.1
    tick: int = 0
    """Ticks since the start of the run, advanced by the loop."""

    def __post_init__(self) -> None:
        if self.ticks_per_step < 1 or abs(self.ticks_per_step * CONTROL_TICK_S - self.step_s) > 1e-9:
            raise ScenarioError(
                f"step_s: got {self.step_s!r}, expected a whole multiple of the control tick "
                f"{CONTROL_TICK_S} s, for example 0.1"
            )

    @property
    def ticks_per_step(self) -> int:
        """Control ticks in one world step."""
        return round(self.step_s / CONTROL_TICK_S)

    @property
    def now_s(self) -> float:
        """Simulation time in seconds since the start of the run."""
        return time_of_tick_s(self.tick)


def time_of_tick_s(tick: int) -> float:
    """Return the time of a tick, correctly rounded (so that tick 30 is 0.3 and not 0.30000000000000004)."""
    return tick / round(1.0 / CONTROL_TICK_S)


def tick_at_or_after(time_s: float) -> int:
    """Return the first tick that does not lie before ``time_s``, forgiving rounding of 1 ns."""
    ticks = time_s / CONTROL_TICK_S
    nearest = round(ticks)
    if abs(ticks - nearest) * CONTROL_TICK_S < 1e-9:
        return nearest
    return int(-(-ticks // 1))
