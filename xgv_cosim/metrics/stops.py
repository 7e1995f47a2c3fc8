"""Stops as metrics: how soon and how far, against what the demanded deceleration promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn
from xgv_cosim.metrics.standstill import first_standstill_s
from xgv_cosim.metrics.watch import VehicleSeries

AFTER_THE_EVENT_S = 10.0
"""A stop is judged until this long after its injection has ended."""


@dataclass(frozen=True, slots=True)
class StopMetrics:
    """What one event did to one vehicle; None where a measure does not apply."""

    speed_at_event_mps: float | None
    stop_demanded_after_s: float | None
    """From the device edge to the moment in which the vehicle's mode demanded a stop: 0 for most edges,
    the rest of the last command's life for lost commands; None if no stop was demanded."""
    time_to_standstill_s: float | None
    """From the device edge to standstill, None if it never stood."""
    stopping_distance_m: float | None
    """Distance driven from the demand to standstill; from the edge, where no stop was demanded."""
    ideal_stopping_distance_m: float | None
    """``v^2 / (2 a)`` with speed and deceleration of the demand, None if no stop was demanded."""
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


NO_STOP = StopMetrics(None, None, None, None, None, None, None, None, None, None, 0.0, 0.0)


def judged_until_s(injection_end_s: float | None) -> float:
    """Return until when an injection's effect is judged, ``inf`` for one that never ends."""
    return np.inf if injection_end_s is None else float(injection_end_s) + AFTER_THE_EVENT_S


def _least(values: FloatColumn, window: BoolColumn) -> float | None:
    inside = values[window]
    least = float(inside.min()) if inside.size else np.inf
    return least if np.isfinite(least) else None


def state_at(series: VehicleSeries, time_s: float) -> tuple[float, float]:
    """Return (speed in m/s, distance in m) at a time that may lie between two samples.

    The last sample not after it is carried on with its acceleration: an edge changes the motion only
    from then on, so the next sample, which may have braked for most of the step, says nothing of it.
    Before the first sample, its values.
    """
    index = int(np.searchsorted(series.t_s, time_s + 1e-9, side="right")) - 1
    if index < 0:
        return float(series.speed_mps[0]), float(series.distance_m[0])
    since_s = max(0.0, time_s - float(series.t_s[index]))
    before, accel = float(series.speed_mps[index]), float(series.accel_mps2[index])
    speed = before + accel * since_s
    if before * speed <= 0.0:  # it stands, or comes to stand within the step; it does not turn round
        speed = max(0.0, speed) if before == 0.0 else 0.0
    return speed, float(series.distance_m[index]) + 0.5 * (before + speed) * since_s


def stop_metrics(series: VehicleSeries, event_s: float, until_s: float) -> StopMetrics:
    """Return the metrics of one event.

    Args:
        series: The vehicle's series; it begins at or before the event, where the vehicle was bound by then.
        event_s: Time of the device edge, which need not be a sample's.
        until_s: End of the window in which the event is judged.
    """
    window = (series.t_s >= event_s - 1e-9) & (series.t_s <= until_s + 1e-9)
    if not window.any():
        return NO_STOP
    after = window & (series.t_s > event_s + 1e-9)  # what a sample says of the step that it ends
    speed, odometer = state_at(series, event_s)
    step_s = float(np.median(np.diff(series.t_s))) if series.t_s.size > 1 else 0.0
    demanded = np.flatnonzero(after & np.isfinite(series.demanded_decel_mps2))
    ideal, demand_s = None, event_s
    if demanded.size:
        # A sample tells of the step that it ends, so the demand began no later than that step.
        demand_s = max(event_s, float(series.t_s[demanded[0]]) - step_s)
        entry, odometer = state_at(series, demand_s)
        ideal = entry * entry / (2.0 * float(series.demanded_decel_mps2[demanded[0]]))
    still_s = first_standstill_s(series.t_s, series.speed_mps, event_s, until_s)
    distance = None if still_s is None else state_at(series, still_s)[1] - odometer
    return StopMetrics(
        speed_at_event_mps=speed,
        stop_demanded_after_s=demand_s - event_s if demanded.size else None,
        time_to_standstill_s=None if still_s is None else still_s - event_s,
        stopping_distance_m=distance,
        ideal_stopping_distance_m=ideal,
        stopping_distance_ratio=distance / ideal if distance is not None and ideal else None,
        peak_decel_mps2=float(np.max(-series.accel_mps2[after], initial=0.0)),
        min_ttc_s=_least(series.leader_ttc_s, window),
        min_ttc_follower_s=_least(series.follower_ttc_s, window),
        min_gap_m=_least(np.minimum(series.leader_gap_m, series.follower_gap_m), window),
        unattended_speed_s=step_s * int(np.sum(series.longitudinal[after] == Longitudinal.FREE)),
        unattended_steering_s=step_s * int(np.sum(series.lateral[after] == Lateral.FREE)),
    )
