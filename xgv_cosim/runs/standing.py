"""Who stands at the end of a run for no reason that the run knows: locked traffic, a stack that waits."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.simulation import Simulation

LONG_S = 90.0
"""Longer than signals are red."""
AT_END_M = 20.0
"""So near the end of its route a vehicle has come to where it was to go."""
_MOST_NAMES = 10
_MEANT_TO_STAND = frozenset(
    {
        Longitudinal.CONTROLLED_STOP,
        Longitudinal.FULL_BRAKE,
        Longitudinal.MAXIMUM_BRAKING,
        Longitudinal.HOLD,
        Longitudinal.FREE,
    }
)
"""A stop, a cold vehicle, or one without anybody at the pedals; the events tell why."""


def unexplained(simulation: Simulation, lasts_s: Mapping[str, float]) -> dict[str, float]:
    """Return who has stood for long and neither has to, nor has crashed, nor is at the end of its route.

    Args:
        simulation: At its end, still open.
        lasts_s: For how long each bound vehicle has stood.
    """
    fleet = simulation.fleet
    return {
        name: seconds
        for name, seconds in lasts_s.items()
        if seconds > LONG_S
        and int(fleet.longitudinal[fleet.slot_of(name)]) not in _MEANT_TO_STAND
        and name not in simulation.state.crashed
        and not _is_at_end(simulation, name)
    }


def _is_at_end(simulation: Simulation, name: str) -> bool:
    snapshot = simulation.snapshot
    row = snapshot.index_of[name]
    lane = np.array([int(snapshot.value("lane", row))])
    left_m = float(simulation.world.road.lane_length_m(lane)[0]) - snapshot.value("lane_position_m", row)
    return bool(lane[0] >= 0) and snapshot.value("next_lane", row) < 0.0 and left_m < AT_END_M


def warning_of(standing: Mapping[str, float]) -> list[str]:
    """Return the line that names them, none if there is nobody."""
    if not standing:
        return []
    names = [f"{name} for {seconds:.0f} s" for name, seconds in list(standing.items())[:_MOST_NAMES]]
    if len(standing) > _MOST_NAMES:
        names.append(f"and {len(standing) - _MOST_NAMES} more")
    who = "bound vehicle has" if len(standing) == 1 else "bound vehicles have"
    return [f"{len(standing)} {who} stood for more than {LONG_S:g} s at the end ({', '.join(names)})"]
