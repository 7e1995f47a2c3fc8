"""Stops as metrics: how soon and how far, against what the demanded deceleration promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn
from xgv_cosim.metrics.watch import VehicleSeries

STANDSTILL_MPS = 0.1
STANDSTILL_HELD_S = 0.5
"""Standstill means below 0.1 m/s, held for 0.5 s."""


@dataclass(frozen=True, slots=True)
class StopMetrics:
    """What one event did to one vehicle; None where a measure does not apply."""

    speed_at_event_mps: float | None
    time_to_standstill_s: float | None
    """From the device edge to standstill, None if it never stood."""
    stopping_distance_m: float | None
    """Distance driven in that time."""
    ideal_stopping_distance_m: float | None
    """``v^2 / (2 a)`` with the demanded deceleration, None if no stop was demanded."""
    stopping_distance_ratio: float | None
    peak_decel_mps2: float | None
    min_ttc_s: float | None
    """Least time to collision with the leader, from the edge to the end of the window."""
    min_ttc_follower_s: float | None
    """Least time to collision of the follower with this vehicle."""
    min_gap_m: float | None
    """Least bumper-to-bumper gap to leader or follower."""
    unattended_speed_s: float
    """Seconds in which nobody controlled speed (XGV-64)."""
    unattended_steering_s: float
    """Seconds in which nobody controlled steering (XGV-64)."""


NO_STOP = StopMetrics(None, None, None, None, None, None, None, None, None, 0.0, 0.0)


def first_standstill(series: VehicleSeries, after_s: float, until_s: float) -> int | None:
    """Return the index at which the first held standstill in ``[after_s, until_s]`` begins."""
    still = (np.abs(series.speed_mps) < STANDSTILL_MPS) & (series.t_s >= after_s - 1e-9)
    for index in np.flatnonzero(still & (series.t_s <= until_s + 1e-9)).tolist():
        held = (series.t_s >= series.t_s[index] - 1e-9) & (
            series.t_s <= series.t_s[index] + STANDSTILL_HELD_S + 1e-9
        )
        if bool(still[held].all()):
            return int(index)
    return None


def _least(values: np.ndarray[tuple[int], np.dtype[np.float64]], window: BoolColumn) -> float | None:
    inside = values[window]
    least = float(inside.min()) if inside.size else np.inf
    return least if np.isfinite(least) else None


def stop_metrics(series: VehicleSeries, event_s: float, until_s: float) -> StopMetrics:
    """Return the metrics of one event.

    Args:
        series: The vehicle's series.
        event_s: Time of the device edge.
        until_s: End of the window in which the event is judged.
    """
    window = (series.t_s >= event_s - 1e-9) & (series.t_s <= until_s + 1e-9)
    if not window.any():
        return NO_STOP
    before = np.flatnonzero(series.t_s <= event_s + 1e-9)
    edge = int(before[-1]) if before.size else 0
    speed = float(series.speed_mps[edge])
    demanded = series.demanded_decel_mps2[window]
    demanded = demanded[np.isfinite(demanded)]
    ideal = speed * speed / (2.0 * float(demanded[0])) if demanded.size else None
    still = first_standstill(series, event_s, until_s)
    distance = None if still is None else float(series.distance_m[still] - series.distance_m[edge])
    step_s = float(np.median(np.diff(series.t_s))) if series.t_s.size > 1 else 0.0
    return StopMetrics(
        speed_at_event_mps=speed,
        time_to_standstill_s=None if still is None else float(series.t_s[still] - event_s),
        stopping_distance_m=distance,
        ideal_stopping_distance_m=ideal,
        stopping_distance_ratio=distance / ideal if distance is not None and ideal else None,
        peak_decel_mps2=float(np.max(-series.accel_mps2[window], initial=0.0)),
        min_ttc_s=_least(series.leader_ttc_s, window),
        min_ttc_follower_s=_least(series.follower_ttc_s, window),
        min_gap_m=_least(np.minimum(series.leader_gap_m, series.follower_gap_m), window),
        unattended_speed_s=step_s * int(np.sum(series.longitudinal[window] == Longitudinal.FREE)),
        unattended_steering_s=step_s * int(np.sum(series.lateral[window] == Lateral.FREE)),
    )
