"""When a change of gear can end, so that a segment of the step ends there (XGV-70, XGV-71)."""

from __future__ import annotations

import math

from xgv_cosim import kernel
from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import Setpoints, motion_table, setpoint_tables
from xgv_cosim.parameters import parameter_table

_ROUNDING_TICKS = 1e-6
"""The time under way is a sum of ticks; one this near to a whole tick is that tick."""


def next_engagement(fleet: Fleet, wanted: Setpoints, tick: int, end: int) -> int:
    """Return the first tick after ``tick`` on which a gear may be engaged, at most ``end``.

    A shift that goes on undisturbed is engaged just then; one that begins or begins anew meanwhile is
    engaged later, and is asked about again. So the clock stands on the tick of every engagement.

    Args:
        fleet: The fleet at ``tick``.
        wanted: Setpoints of the segment that begins there.
        tick: The present tick.
        end: Where the segment ends otherwise.
    """
    takes_s = kernel.next_engagement(
        setpoint_tables(wanted)[1],
        fleet.motion.gear,
        motion_table(fleet.motion),
        parameter_table(fleet.parameters),
    )
    if math.isinf(takes_s):
        return end
    ticks = math.ceil(takes_s / CONTROL_TICK_S - _ROUNDING_TICKS)
    return min(end, tick + max(1, ticks))
