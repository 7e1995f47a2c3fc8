"""``report.html``: one self-contained page that shows what happened in a run and why."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any, Final

import jinja2
import numpy as np

from xgv_cosim.errors import RecordingError
from xgv_cosim.recording import REPORT, Trajectory, write_whole_file
from xgv_cosim.reports.along_road import AlongRoad, along_road
from xgv_cosim.reports.mode_timeline import mode_timeline
from xgv_cosim.reports.palette import LEGEND, mode_style, plain
from xgv_cosim.reports.run_data import Injected, RunData, read_run
from xgv_cosim.reports.time_space import Window, lanes_of, time_space
from xgv_cosim.reports.top_down import moments_of, top_down
from xgv_cosim.reports.traces import traces, window_of
from xgv_cosim.reports.wording import HELD, METRICS, number, story, summary, verdict

MOST_PICTURED: Final = 10
"""Injected vehicles with pictures of their own; more would make the page heavy."""
VEHICLES_PER_TABLE: Final = 6
CLOSE_UP_BEHIND_M: Final = 450.0
CLOSE_UP_AHEAD_M: Final = 120.0

_CONTENTS: Final[tuple[tuple[str, str], ...]] = (
    ("expectations", "Expectations"),
    ("numbers", "Key numbers"),
    ("traffic", "Traffic"),
    ("modes", "Modes"),
    ("vehicles", "Vehicles"),
    ("metrics", "Measured values"),
    ("collisions", "Collisions"),
    ("assumptions", "Assumptions"),
    ("provenance", "Provenance"),
)


def write_report(folder: Path) -> Path:
    """Write ``report.html`` into a run folder, from what lies there, and return its path.

    A folder of an interrupted or failed run gives a report of what was recorded, and says what is missing.

    Raises:
        ReplayError: It is not a run folder, or a file in it is of another schema.
        RecordingError: The page cannot be written.
    """
    page = render_report(read_run(folder))
    path = folder / REPORT
    try:
        write_whole_file(path, page.encode("utf-8", "replace"))
    except OSError as error:
        raise RecordingError(
            f"cannot write {path}: {error.strerror or error}. The run itself is complete."
        ) from error
    return path


def render_report(run: RunData) -> str:
    """Return the page for a run."""
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters["mode_style"] = mode_style
    environment.filters["plain"] = plain
    template = resources.files("xgv_cosim.reports").joinpath("template.html.j2").read_text(encoding="utf-8")
    return environment.from_string(template).render(_content(run))


def _content(run: RunData) -> dict[str, Any]:
    track = run.trajectory if run.trajectory is not None and run.trajectory.num_rows else None
    road = along_road(track) if track is not None else None
    injected = run.injected
    tone, headline = verdict(run)
    expectations = run.result.get("expectations") or []
    ledger = list(run.result.get("assumptions", []))
    defaults = dict.fromkeys(
        ("description", "error", "warnings", "notes", "expectations", "collisions", "teleports")
    )
    return {
        "title": run.result.get("scenario") or run.folder.name,
        "result": {**defaults, **run.result} if run.result else defaults,
        "contents": [row for row in _CONTENTS if row[0] != "vehicles" or injected],
        "tone": tone,
        "headline": headline,
        "summary": summary(run),
        "stories": [(vehicle.vehicle_id, story(run, vehicle)) for vehicle in injected],
        "problems": run.problems,
        "tiles": _tiles(run),
        "time_space": _overview(track, road, injected),
        "axis_note": _axis_note(road),
        "any_bound": track is not None and bool(track.bound.any()),
        "held": [row for row in expectations if row["status"] in HELD],
        "not_held": [row for row in expectations if row["status"] not in HELD],
        "legend": LEGEND,
        "timeline": mode_timeline(run, injected),
        "vehicles": [_vehicle(run, track, road, vehicle) for vehicle in injected[:MOST_PICTURED]],
        "num_left_out": max(0, len(injected) - MOST_PICTURED),
        "metric_tables": _metric_tables(injected),
        "other_vehicles": _other_vehicles(run),
        "exercised": [row for row in ledger if row.get("exercised")],
        "unexercised": [row for row in ledger if not row.get("exercised")],
        "facts": _facts(run),
    }


def _overview(track: Trajectory | None, road: AlongRoad | None, injected: tuple[Injected, ...]) -> Any:  # noqa: ANN401 - Markup or None
    if track is None or road is None or not road.edges:
        return None
    on_road = road.distance_m[road.lane_index >= 0]
    times = track.time_s
    window = Window(
        float(times.min()), max(float(times.max()), float(times.min()) + 1.0), 0.0, float(on_road.max())
    )
    return time_space(
        track, road, injected, lanes_of(road), window, description="time-space diagram per lane"
    )


def _axis_note(road: AlongRoad | None) -> str:
    if road is None or not road.edges:
        return ""
    named = [edge for edge in road.edges if not edge.startswith(":")]
    shown = " → ".join(named) if len(named) <= 6 else f"{named[0]} → … → {named[-1]} ({len(named)} edges)"
    text = f"Distance is measured along the most travelled road ({shown}), from where its first edge begins."
    if road.share < 0.995:
        text += f" {100.0 * (1.0 - road.share):.0f} % of what was recorded lies elsewhere and is not shown."
    return text


def _vehicle(
    run: RunData, track: Trajectory | None, road: AlongRoad | None, vehicle: Injected
) -> dict[str, Any]:
    names = [str(row["safety_mode"]) for row in vehicle.modes if row["safety_mode"] != "unknown"]
    styles = list(dict.fromkeys(mode_style(name) for name in names))
    pictures: dict[str, Any] = {"top_down": None, "close_up": None, "traces": None, "gone": ""}
    rows = track.rows_of.get(vehicle.vehicle_id) if track is not None else None
    if track is None or road is None or rows is None:
        pictures["gone"] = "This vehicle is not in the trajectories."
    else:
        pictures["top_down"] = top_down(run, track, vehicle, moments_of(run, vehicle))
        pictures["close_up"] = _close_up(run, track, road, vehicle)
        pictures["traces"] = traces(run, track, vehicle)
        last_s = float(track.time_s[rows.stop - 1])
        if last_s < run.end_s - 1.0:
            pictures["gone"] = f"It left the recorded traffic at {last_s:.1f} s."
    return {
        "name": vehicle.vehicle_id,
        "styles": styles,
        "story": story(run, vehicle),
        "modes": vehicle.modes,
        **pictures,
    }


def _close_up(run: RunData, track: Trajectory, road: AlongRoad, vehicle: Injected) -> Any:  # noqa: ANN401 - Markup or None
    """Draw the lane of the vehicle around its injections."""
    from_s, to_s = window_of(run, vehicle)
    rows = track.rows_of[vehicle.vehicle_id]
    shown = (track.time_s[rows] >= from_s) & (track.time_s[rows] <= to_s) & (road.lane_index[rows] >= 0)
    if not shown.any():
        return None
    distance_m = road.distance_m[rows][shown]
    after = shown & (track.time_s[rows] >= vehicle.first_s)
    lane = int(np.bincount(road.lane_index[rows][after if after.any() else shown]).argmax())
    event_m = float(road.distance_m[rows][after if after.any() else shown][0])
    low = max(0.0, min(float(distance_m.min()), event_m - CLOSE_UP_BEHIND_M))
    high = min(float(distance_m.max()), event_m + 2.0 * CLOSE_UP_BEHIND_M) + CLOSE_UP_AHEAD_M
    return time_space(
        track,
        road,
        [vehicle],
        [lane],
        Window(from_s, to_s, low, high),
        description=f"time-space diagram around {vehicle.vehicle_id}",
        panel_height_in=3.4,
        close_up=True,
    )


def _tiles(run: RunData) -> list[tuple[str, str]]:
    result = run.result
    tiles = [(number(run.end_s, 0, "s"), "simulated time")]
    factor = result.get("real_time_factor")
    if factor is not None:
        tiles.append(
            (
                f"{factor:.{1 if factor >= 1.0 else 2}f}",
                f"times real time ({number(result.get('wall_s'), 0, 's')} of computing)",
            )
        )
    for key, label in (
        ("num_vehicles_max", "vehicles at once, at most"),
        ("num_bound_max", "emulated vehicles"),
    ):
        if result.get(key) is not None:
            tiles.append((str(result[key]), label))
    tiles.append((str(len(run.injected)), "vehicles with an injection"))
    for key, label in (("collisions", "collisions"), ("teleports", "teleports")):
        if result.get(key) is not None:
            tiles.append((str(len(result[key])), label))
    tiles.append((str(len(run.events)), "events in the log"))
    return tiles


def _metric_tables(injected: tuple[Injected, ...]) -> list[dict[str, Any]]:
    tables = []
    for first in range(0, len(injected), VEHICLES_PER_TABLE):
        group = injected[first : first + VEHICLES_PER_TABLE]
        rows = []
        for metric in METRICS:
            values = [vehicle.metrics.get(metric.key) for vehicle in group]
            if any(value is not None for value in values):
                cells = [metric.cell(value) for value in values]
                rows.append({"name": metric.name, "help": metric.help, "cells": cells})
        modes = list(dict.fromkeys(name for v in group for name in v.metrics.get("time_in_mode_s") or {}))
        for name in modes:
            cells = [number((v.metrics.get("time_in_mode_s") or {}).get(name), 1, "s") for v in group]
            rows.append({"name": f"time in {mode_style(name).label}", "help": "", "cells": cells})
        tables.append({"names": [vehicle.vehicle_id for vehicle in group], "rows": rows})
    return tables


def _other_vehicles(run: RunData) -> list[list[str]]:
    """Return rows (vehicle, seconds in each mode, placement error, collisions) of the vehicles left alone."""
    rows = []
    for name, vehicle in run.result.get("vehicles", {}).items():
        if vehicle.get("injections"):
            continue
        metrics = vehicle.get("metrics", {})
        spent = (metrics.get("time_in_mode_s") or {}).items()
        modes = ", ".join(f"{mode_style(mode).label} {number(seconds, 1, 's')}" for mode, seconds in spent)
        placed = number(metrics.get("placement_error_m"), 3, "m")
        rows.append([name, modes, placed, number(metrics.get("collisions"), 0)])
    return rows


def _facts(run: RunData) -> list[tuple[str, str]]:
    result = run.result
    facts = [("run again and compare", f"xgv-cosim replay {run.folder}")]
    for key, name in (
        ("seed", "seed"),
        ("trace_hash", "trace hash"),
        ("started_at", "started"),
        ("step_s", "step, s"),
    ):
        if result.get(key) is not None:
            facts.append((name, str(result[key])))
    facts += [(str(name), str(version)) for name, version in (result.get("versions") or {}).items()]
    return facts
