"""Rows of the bound vehicles in ``result.json``: injections, modes with reasons, metrics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from types import MappingProxyType
from typing import Any

from xgv_cosim.events import Event
from xgv_cosim.metrics import PlacementRow, VehicleSeries, stop_metrics
from xgv_cosim.metrics.stops import judged_until_s
from xgv_cosim.metrics.watch import Contact


def by_vehicle(events: Iterable[Event]) -> dict[str, list[Event]]:
    """Return the events of each vehicle, in order."""
    grouped: dict[str, list[Event]] = {}
    for event in events:
        grouped.setdefault(event.vehicle, []).append(event)
    return grouped


def injections_of(events: Iterable[Event]) -> list[dict[str, Any]]:
    """Return what was injected into one vehicle, from when to when (None: to the end of the run).

    An end belongs to the injection of its kind and, for errors, of its code.

    Args:
        events: Of this vehicle.
    """
    rows: list[dict[str, Any]] = []
    still_open: dict[tuple[str, tuple[str, ...]], list[dict[str, Any]]] = {}
    for event in events:
        if event.kind != "injection":
            continue
        same = still_open.setdefault((event.after or event.before, event.reasons), [])
        if event.after:
            same.append({"kind": event.after, "code": _code(event), "at_s": event.t_s, "end_s": None})
            rows.append(same[-1])
        else:
            for row in same:
                row["end_s"] = event.t_s
            same.clear()
    return rows


def _code(event: Event) -> int | None:
    """Return the error code that an injection's reasons name, None where it has none."""
    words = " ".join(event.reasons).split()
    return int(words[1]) if words[:1] == ["code"] else None


def modes_of(events: Iterable[Event]) -> list[dict[str, Any]]:
    """Return each change of one vehicle's control, ready or safety mode, with the latter's reasons."""
    now: dict[str, Any] = {
        "t_s": 0.0,
        "control_mode": "software_pause",
        "ready_mode": "software_pause",
        "safety_mode": "unknown",
        "reasons": [],
    }
    rows: list[dict[str, Any]] = []
    for event in events:
        if event.kind not in {"control_mode", "ready_mode", "safety_mode"}:
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


def time_without_control_s(events: Sequence[Event], end_s: float) -> dict[str, float]:
    """Return for each axis the seconds in which neither computer nor driver had it (XGV-64).

    It counts from the binding to ``end_s``; an axis that never changed hands was somebody's all along.
    """
    spent = {}
    for axis in ("speed", "steering"):
        changes = [event for event in events if event.kind == f"{axis}_control"]
        ends = [*(event.t_s for event in changes), end_s][1:]
        without = sum(
            until - event.t_s for event, until in zip(changes, ends, strict=True) if event.after == "nobody"
        )
        spent[axis] = round(without, 9)
    return spent


def vehicle_rows(
    series: dict[str, VehicleSeries],
    events: list[Event],
    contacts: Sequence[Contact],
    end_s: float,
    placements: Mapping[str, PlacementRow] = MappingProxyType({}),
) -> dict[str, Any]:
    """Return the row of every vehicle that was ever bound, injected ones with their metrics.

    Each injection carries its own metrics; the vehicle's are those of its first injection.
    """
    rows: dict[str, Any] = {}
    for name, own in by_vehicle(events).items():
        bound = [event for event in own if event.kind == "bound"]
        if not bound:
            continue
        injections = injections_of(own)
        modes = modes_of(own)
        for injection in injections:
            injection["metrics"] = _stop_row(series[name], injection, end_s) if name in series else {}
        last_s = _last_seen(own, end_s)
        rows[name] = {
            "bound_at_s": bound[-1].t_s,
            "binding": list(bound[-1].reasons),
            "injected": bool(injections),
            "injections": injections,
            "modes": modes,
            "metrics": {
                "time_in_mode_s": time_in_mode_s(modes, last_s),
                "time_without_control_s": time_without_control_s(own, last_s),
                **(injections[0]["metrics"] if injections else {}),
                "collisions": sum(name in {row.collider, row.victim} for row in contacts),
                **(asdict(placements[name]) if name in placements else {}),
            },
        }
    return rows


def _last_seen(events: Sequence[Event], end_s: float) -> float:
    gone = [event.t_s for event in events if event.kind == "released"]
    return gone[-1] if gone else end_s


def _stop_row(series: VehicleSeries, injection: dict[str, Any], end_s: float) -> dict[str, Any]:
    until_s = min(end_s, judged_until_s(injection["end_s"]))
    return asdict(stop_metrics(series, injection["at_s"], until_s))
