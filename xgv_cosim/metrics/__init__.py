"""Metrics: what is measured of a run, each with a definition and a case in which it does not apply."""

from __future__ import annotations

from xgv_cosim.metrics.gaps import GapLows
from xgv_cosim.metrics.placements import PlacementRow
from xgv_cosim.metrics.stops import StopMetrics, stop_metrics
from xgv_cosim.metrics.surrogate import time_to_collision_s
from xgv_cosim.metrics.watch import VehicleSeries, Watch

__all__ = [
    "GapLows",
    "PlacementRow",
    "StopMetrics",
    "VehicleSeries",
    "Watch",
    "stop_metrics",
    "time_to_collision_s",
]
