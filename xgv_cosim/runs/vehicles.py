"""Rows of the bound vehicles in ``result.json``: injections, modes with reasons, metrics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from xgv_cosim.events import Event
from xgv_cosim.metrics import VehicleSeries, stop_metrics
from xgv_cosim.metrics.watch import Contact

AFTER_THE_EVENT_S = 10.0
"""A stop is judged until this long after its injection has ended."""


def injections_of(events: list[Event], vehicle_id: str) -> list[dict[str, Any]]:
    """Return what was injected into a vehicle, from when to when (None: to the end of the run)."""
    rows: list[dict[str, Any]] = []
    for event in events:
        if event.vehicle != vehicle_id or event.kind != "injection":
            continue
        if event.after:
            rows.append({"kind": event.after, "at_s": event.t_s, "end_s": None})
        else:
            still_open = [row for row in rows if row["kind"] == event.before and row["end_s"] is None]
            for row in still_open:
                row["end_s"] = event.t_s
    return rows


def modes_of(events: list[Event], vehicle_id: str) -> list[dict[str, Any]]:
    """Return each change of control, ready or safety mode, with the reasons of the safety mode."""
    now: dict[str, Any] = {
        "t_s": 0.0,
        "control_mode": "software_pause",
        "ready_mode": "software_pause",
        "safety_mode": "unknown",
        "reasons": [],
    }
    rows: list[dict[str, Any]] = []
    for event in events:
        if event.vehicle != vehicle_id or event.kind not in {"control_mode", "ready_mode", "safety_mode"}:
            continue
        now = now | {"t_s": event.t_s, event.kind: event.after}
        if event.kind == "safety_mode":
            now["reasons"] = list(event.reasons)
        if rows and rows[-1]["t_s"] == event.t_s:
            rows[-1] = now
        else:
            rows.append(now)
    return rows


def time_in_mode_s(modes: list[dict[str, Any]], end_s: float) -> dict[str, float]:
    """Return the seconds spent in each safety mode."""
    spent: dict[str, float] = {}
    ends = [row["t_s"] for row in modes[1:]] + [end_s]
    for row, until in zip(modes, ends, strict=True):
        spent[row["safety_mode"]] = spent.get(row["safety_mode"], 0.0) + max(0.0, until - row["t_s"])
    return {mode: round(seconds, 9) for mode, seconds in spent.items()}


def time_without_control_s(events: list[Event], vehicle_id: str, end_s: float) -> dict[str, float]:
    """Return for each axis the seconds in which neither computer nor driver had it (XGV-64).

    It counts from the binding to ``end_s``; an axis that never changed hands was somebody's all along.
    """
    spent = {}
    for axis in ("speed", "steering"):
        changes = [e for e in events if e.vehicle == vehicle_id and e.kind == f"{axis}_control"]
        ends = [*(event.t_s for event in changes), end_s][1:]
        without = sum(
            until - event.t_s for event, until in zip(changes, ends, strict=True) if event.after == "nobody"
        )
        spent[axis] = round(without, 9)
    return spent


def vehicle_rows(
    series: dict[str, VehicleSeries], events: list[Event], contacts: Sequence[Contact], end_s: float
) -> dict[str, Any]:
    """Return the row of every vehicle that was ever bound, injected ones with their metrics."""
    bound = [event for event in events if event.kind == "bound"]
    rows: dict[str, Any] = {}
    for event in bound:
        name = event.vehicle
        injections = injections_of(events, name)
        modes = modes_of(events, name)
        last_s = _last_seen(events, name, end_s)
        metrics: dict[str, Any] = {
            "time_in_mode_s": time_in_mode_s(modes, last_s),
            "time_without_control_s": time_without_control_s(events, name, last_s),
        }
        if injections and name in series:
            metrics |= _stop_row(series[name], injections[0], end_s)
        metrics["collisions"] = sum(name in {row.collider, row.victim} for row in contacts)
        rows[name] = {
            "bound_at_s": event.t_s,
            "binding": list(event.reasons),
            "injected": bool(injections),
            "injections": injections,
            "modes": modes,
            "metrics": metrics,
        }
    return rows


def _last_seen(events: list[Event], vehicle_id: str, end_s: float) -> float:
    gone = [event.t_s for event in events if event.vehicle == vehicle_id and event.kind == "released"]
    return gone[-1] if gone else end_s


def _stop_row(series: VehicleSeries, injection: dict[str, Any], end_s: float) -> dict[str, Any]:
    until = end_s if injection["end_s"] is None else min(end_s, injection["end_s"] + AFTER_THE_EVENT_S)
    return asdict(stop_metrics(series, injection["at_s"], until))
