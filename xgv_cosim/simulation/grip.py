"""Curvature that the tyres do not give: the friction circle's cap as an event, on its own ticks."""

from __future__ import annotations

import numpy as np

from xgv_cosim.clock import CONTROL_TICK_S, time_of_tick_s
from xgv_cosim.simulation.state import RunState

KIND = "curvature_limited_by_grip"
_WHAT = "wider than steered"


def note(state: RunState, ticks: int) -> None:
    """Enter, once the segment is driven, where the tyres began or ceased to give less than the wheel asks.

    Each row is stamped with its own control tick inside the segment (XGV-71). Of several such times in
    one segment, the last one counts for all.

    Args:
        state: The run, its clock still at the begin of the segment.
        ticks: Control ticks of the segment.
    """
    motion, until_s = state.fleet.motion, state.now_s + time_of_tick_s(ticks)
    recent = (motion.grip_limited_s > 0.0) & (
        motion.grip_free_s < time_of_tick_s(ticks) - 0.5 * CONTROL_TICK_S
    )
    for slot in np.flatnonzero(recent).tolist():
        name = str(state.fleet.ids[slot])
        ended_s = _on_tick_s(until_s - float(motion.grip_free_s[slot]))
        if name not in state.limited_by_grip:
            began_s = _on_tick_s(ended_s - float(motion.grip_limited_s[slot]))
            state.limited_by_grip[name] = began_s
            state.journal.note(began_s, name, KIND, "", _WHAT, (_why(state, slot),))
        if motion.grip_free_s[slot] > 0.0:
            _end(state, name, ended_s)


def forget(state: RunState, vehicle_id: str) -> None:
    """End what lasts, because the vehicle is released."""
    if vehicle_id in state.limited_by_grip:
        _end(state, vehicle_id, state.now_s)


def _end(state: RunState, name: str, ended_s: float) -> None:
    lasted_s = ended_s - state.limited_by_grip.pop(name)
    state.journal.note(ended_s, name, KIND, _WHAT, "", (f"lasted {lasted_s:.2f} s",))


def _why(state: RunState, slot: int) -> str:
    motion, speed_mps = state.fleet.motion, float(state.fleet.motion.speed_mps[slot])
    sideways = abs(float(motion.curvature_per_m[slot])) * speed_mps * speed_mps
    friction = float(state.fleet.parameters.friction[slot])
    return f"the tyres give {sideways:.1f} m/s² sideways at {abs(speed_mps):.1f} m/s, friction {friction:g}"


def _on_tick_s(time_s: float) -> float:
    """Return the time without the rounding of added ticks, so that rows of one tick carry one number."""
    return time_of_tick_s(round(time_s / CONTROL_TICK_S))
