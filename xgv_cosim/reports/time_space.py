"""Time-space diagrams: every car a line, slow is dark, so that jams and the waves they send show at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize

from xgv_cosim.recording import Trajectory
from xgv_cosim.reports.along_road import AlongRoad
from xgv_cosim.reports.canvas import as_png, drawing, stacked, tidy
from xgv_cosim.reports.palette import INK, mode_style
from xgv_cosim.reports.run_data import Injected
from xgv_cosim.reports.wording import injection_name

DRAW_EVERY_S = 0.4
"""A line needs no more points than the eye can see."""
GAP_S = 1.0
"""A line is interrupted where a vehicle was away from the lane for longer."""
MOST_LANES = 6
MANY_VEHICLES = 100
"""From here on fast cars are drawn paler, so that slow ones stand out."""


@dataclass(frozen=True, slots=True)
class Window:
    """The part of the run that a diagram shows."""

    from_s: float
    to_s: float
    from_m: float
    to_m: float


def speed_colours() -> Colormap:
    """Return the colours of speed: dark blue at standstill to yellow, without the palest end."""
    return ListedColormap(mpl.colormaps["viridis"](np.linspace(0.0, 0.93, 256)))


def lanes_of(road: AlongRoad) -> tuple[int, ...]:
    """Return the lane numbers that hold vehicles, from the middle of the road to the kerb."""
    numbers = np.unique(road.lane_index[road.lane_index >= 0])
    return tuple(sorted(numbers.tolist(), reverse=True))[-MOST_LANES:]


def time_space(
    track: Trajectory,
    road: AlongRoad,
    injected: Sequence[Injected],
    lanes: Sequence[int],
    window: Window,
    *,
    description: str,
    panel_height_in: float = 2.9,
    close_up: bool = False,
) -> Markup:
    """Draw one diagram per lane below each other, time to the right and distance up.

    A close-up also shows, dotted, where the injected vehicles were while in another lane.
    """
    fastest_mps = float(np.nanmax(track["measured_speed"])) if track.num_rows else 1.0
    norm = Normalize(0.0, max(5.0, fastest_mps))
    with drawing(description):
        figure, panels = stacked(
            [panel_height_in] * len(lanes),
            gap_in=0.34,
            left_in=0.62,
            right_in=0.95,
            top_in=0.28,
            bottom_in=0.5,
        )
        for axes, lane in zip(panels, lanes, strict=True):
            tidy(axes)
            axes.set_xlim(window.from_s, window.to_s)
            axes.set_ylim(window.from_m, window.to_m)
            axes.set_ylabel("distance along the road, m")
            axes.set_title(_lane_title(lane, lanes_of(road)), loc="left", color=INK, weight="bold")
            if axes is not panels[-1]:
                axes.tick_params(labelbottom=False)
            if close_up:
                _draw_elsewhere(axes, track, road, lane, injected)
            _draw_lane(axes, track, road, lane, {row.vehicle_id for row in injected}, norm, window)
            _mark_injections(axes, track, road, lane, injected, window)
        panels[-1].set_xlabel("time since the start of the run, s")
        first, last = panels[0].get_position(), panels[-1].get_position()
        scale = figure.add_axes((first.x1 + 0.015, last.y0, 0.016, first.y1 - last.y0))
        bar = figure.colorbar(ScalarMappable(norm, speed_colours()), cax=scale)
        bar.set_label("speed, m/s")
        bar.outline.set_visible(False)
        scale.tick_params(length=0)
        return as_png(figure, description)


def _lane_title(lane: int, lanes: Sequence[int]) -> str:
    if lane == 0:
        return "Lane 0 (kerb)"
    return f"Lane {lane}{' (middle of the road)' if lane == max(lanes) else ''}"


def _draw_lane(
    axes: Axes,
    track: Trajectory,
    road: AlongRoad,
    lane: int,
    injected: set[str],
    norm: Normalize,
    window: Window,
) -> None:
    in_window = (
        (road.lane_index == lane)
        & (track.time_s >= window.from_s - GAP_S)
        & (track.time_s <= window.to_s + GAP_S)
        & (road.distance_m >= window.from_m - 50.0)
        & (road.distance_m <= window.to_m + 50.0)
    )
    special = np.array([name in injected for name in track.vehicle_ids] or [False])[track.vehicle]
    crowded = len(track.vehicle_ids) > MANY_VEHICLES
    styles = (
        (in_window & ~track.bound, 0.8, 0.45 if crowded else 0.9, 2.0, False),
        (in_window & track.bound & ~special, 1.7, 1.0, 3.0, False),
        (in_window & special, 2.4, 1.0, 5.0, True),
    )
    for rows, width, alpha, order, outlined in styles:
        segments, speeds = _segments(track, road, np.flatnonzero(rows))
        if not len(segments):
            continue
        if outlined:
            axes.add_collection(
                LineCollection(
                    list(segments), colors="white", linewidths=6.0, capstyle="round", zorder=order - 0.6
                )
            )
            axes.add_collection(
                LineCollection(
                    list(segments), colors=INK, linewidths=4.2, capstyle="round", zorder=order - 0.4
                )
            )
        slow_last = np.argsort(-speeds)
        colours = speed_colours()(norm(speeds[slow_last]))
        colours[:, 3] = 1.0 - (1.0 - alpha) * np.clip(norm(speeds[slow_last]), 0.0, 1.0)
        axes.add_collection(
            LineCollection(
                list(segments[slow_last]), colors=colours, linewidths=width, capstyle="round", zorder=order
            )
        )


def _segments(
    track: Trajectory, road: AlongRoad, rows: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return line pieces (k, 2 points, time and distance) of the vehicles in ``rows``, and their speeds."""
    if len(rows) > 1:
        steps = np.round(track.time_s[rows] / DRAW_EVERY_S).astype(np.int64)
        first = np.ones(len(rows), np.bool_)
        first[1:] = (steps[1:] != steps[:-1]) | (track.vehicle[rows[1:]] != track.vehicle[rows[:-1]])
        rows = rows[first]
    if len(rows) < 2:
        return np.zeros((0, 2, 2)), np.zeros(0)
    here, there = rows[:-1], rows[1:]
    joined = (track.vehicle[here] == track.vehicle[there]) & (
        track.time_s[there] - track.time_s[here] <= GAP_S
    )
    here, there = here[joined], there[joined]
    points = np.stack([track.time_s, road.distance_m], axis=1)
    return np.stack([points[here], points[there]], axis=1), track["measured_speed"][there]


def _mark_injections(
    axes: Axes, track: Trajectory, road: AlongRoad, lane: int, injected: Sequence[Injected], window: Window
) -> None:
    """Put a marker at the begin and end of each injection, and a name where it fits."""
    taken: list[tuple[float, float, float, float]] = []
    for vehicle in injected:
        rows = track.rows_of.get(vehicle.vehicle_id)
        if rows is None:
            continue
        time_s, distance_m, lanes = track.time_s[rows], road.distance_m[rows], road.lane_index[rows]
        for injection in vehicle.injections:
            colour = mode_style(_mode_brought(vehicle, injection)).colour
            for at_s, shape in ((injection["at_s"], "v"), (injection.get("end_s"), "^")):
                if at_s is None or not len(time_s) or not time_s[0] <= at_s <= time_s[-1] + GAP_S:
                    continue
                row = int(np.argmin(np.abs(time_s - at_s)))
                inside = (
                    window.from_s <= at_s <= window.to_s and window.from_m <= distance_m[row] <= window.to_m
                )
                if lanes[row] != lane or not inside:
                    continue
                fill = colour if shape == "v" else "white"
                axes.plot(
                    [at_s], [distance_m[row]], shape, ms=9, mfc=fill, mec=colour if shape == "^" else "white",
                    mew=1.6, zorder=8, clip_on=False,
                )  # fmt: skip
                if shape == "v":
                    text = f"{vehicle.vehicle_id}: {injection_name(injection['kind'])}"
                    _label(axes, float(at_s), float(distance_m[row]), text, taken)


def _draw_elsewhere(
    axes: Axes, track: Trajectory, road: AlongRoad, lane: int, injected: Sequence[Injected]
) -> None:
    """Dot the path of the injected vehicles while they drive in another lane."""
    for vehicle in injected:
        rows = track.rows_of.get(vehicle.vehicle_id, slice(0, 0))
        elsewhere = np.where(road.lane_index[rows] == lane, np.nan, road.distance_m[rows])
        axes.plot(track.time_s[rows], elsewhere, color=INK, lw=1.3, ls=(0, (1.2, 1.8)), zorder=4.0)


def _mode_brought(vehicle: Injected, injection: Mapping[str, Any]) -> str:
    """Return the safety mode that an injection led to, or the one that stayed in force."""
    begin_s = float(injection["at_s"])
    end_s = np.inf if injection.get("end_s") is None else float(injection["end_s"])
    before = [str(row["safety_mode"]) for row in vehicle.modes if row["t_s"] < begin_s]
    during = [str(row["safety_mode"]) for row in vehicle.modes if begin_s <= row["t_s"] < end_s]
    changed = [name for name in during if not before or name != before[-1]]
    return (changed[:1] or before[-1:] or [""])[0]


def _label(
    axes: Axes, t_s: float, distance_m: float, text: str, taken: list[tuple[float, float, float, float]]
) -> None:
    """Write ``text`` beside a point, at the first place where it covers no other and stays in the panel."""
    text = text if len(text) <= 44 else text[:43] + "…"
    scale = 72.0 / axes.figure.dpi  # everything below is in points
    x, y = axes.transData.transform((t_s, distance_m)) * scale
    frame = axes.get_window_extent()
    left, right, bottom, top = (edge * scale for edge in (frame.x0, frame.x1, frame.y0, frame.y1))
    width, height = 4.9 * len(text) + 8.0, 14.0
    # A car's own line runs to the right and up or level, so up left and down right are free of it.
    places = [(dx, dy) for level in range(4) for dx, dy in _beside(width, 14.0 + 17.0 * level)]
    for dx, dy in places:
        box = (x + dx, y + dy, x + dx + width, y + dy + height)
        inside = left <= box[0] and box[2] <= right and bottom <= box[1] and box[3] <= top
        clear = all(box[2] < b[0] or b[2] < box[0] or box[3] < b[1] or b[3] < box[1] for b in taken)
        if inside and clear:
            break
    else:
        return  # crowded: the marker stands alone, and the timeline below names it
    taken.append(box)
    axes.annotate(
        text,
        (t_s, distance_m),
        xytext=(dx + 4.0, dy + 3.5),
        textcoords="offset points",
        fontsize=8.5,
        weight="bold",
        color=INK,
        zorder=9,
        bbox={"boxstyle": "round,pad=0.3", "fc": "white", "ec": "#c9d0d8", "alpha": 0.94, "lw": 0.7},
        arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8, "shrinkA": 0.0, "shrinkB": 4.0},
    )


def _beside(width: float, away: float) -> tuple[tuple[float, float], ...]:
    """Return places for a label around a point, in points, the best first."""
    return (
        (-width - 6.0, away),
        (8.0, -away - 14.0),
        (-0.6 * width, away),
        (8.0, away),
        (-width - 6.0, -away - 14.0),
    )
