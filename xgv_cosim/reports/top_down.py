"""The road from above at one moment, turned so that the injected car drives to the right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from xgv_cosim.recording import Trajectory
from xgv_cosim.reports.canvas import WIDTH_IN, as_svg, drawing, stacked
from xgv_cosim.reports.palette import INK, mode_style
from xgv_cosim.reports.run_data import Injected, Lane, RunData

AHEAD_M = 60.0
BEHIND_M = 60.0
BESIDE_M = 18.0
"""Most that is shown to each side; less where the road is narrower."""
VERGE_M = 1.5
SIDE_IN = 0.15
ROAD = "#dfe3e8"
ROAD_EDGE = "#8e97a3"
OTHER = "#aab2bd"

Points = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Moment:
    """A time to draw and why."""

    t_s: float
    why: str


def moments_of(run: RunData, vehicle: Injected, most: int = 4) -> tuple[Moment, ...]:
    """Return when to look: each injection's begin and the standstill that followed, else its end."""
    moments: list[Moment] = []
    for injection in vehicle.injections:
        begin_s = float(injection["at_s"])
        still_s = run.standstill_s(vehicle.vehicle_id, injection)
        moments.append(Moment(begin_s, "the event begins"))
        if still_s is not None and still_s > begin_s:
            moments.append(Moment(still_s, "stands still"))
        elif injection.get("end_s") is not None:
            moments.append(Moment(float(injection["end_s"]), "the event ends"))
    return tuple(moments[:most])


def top_down(run: RunData, track: Trajectory, vehicle: Injected, moments: Sequence[Moment]) -> Markup | None:
    """Draw the road around a vehicle at each moment; None where it was never on the road then."""
    views = [
        (moment, row)
        for moment in moments
        if (row := _row_at(track, vehicle.vehicle_id, moment.t_s)) is not None
    ]
    if not views:
        return None
    description = f"the road around {vehicle.vehicle_id} from above"
    scenes = [_scene(run, track, row) for _, row in views]
    inches_per_m = (WIDTH_IN - 2.0 * SIDE_IN) / (AHEAD_M + BEHIND_M)
    heights_in = [(scene.high_m - scene.low_m) * inches_per_m for scene in scenes]
    with drawing(description):
        figure, panels = stacked(
            heights_in, gap_in=0.36, left_in=SIDE_IN, right_in=SIDE_IN, top_in=0.3, bottom_in=0.48
        )
        for axes, (moment, row), scene in zip(panels, views, scenes, strict=True):
            _draw_view(axes, track, vehicle, moment, row, scene)
        for axes in panels[:-1]:
            axes.tick_params(labelbottom=False)
        panels[-1].set_xlabel("metres ahead of the car's front bumper")
        return as_svg(figure, description)


@dataclass(frozen=True, slots=True)
class _Scene:
    """The road around a car in the car's own frame: origin at its front bumper, x ahead, y to the left."""

    origin: Points
    heading_rad: float
    lanes: tuple[tuple[Lane, Points], ...]
    low_m: float
    high_m: float

    def place(self, points: Points) -> Points:
        """Return points of the world in this frame."""
        return _turned(points - self.origin, self.heading_rad)


def _turned(points: Points, heading_rad: float) -> Points:
    cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
    turned: Points = points @ np.array([[cosine, -sine], [sine, cosine]])
    return turned


def _scene(run: RunData, track: Trajectory, row: int) -> _Scene:
    origin = np.array([track["x"][row], track["y"][row]])
    heading_rad = float(track["heading"][row])
    placed = [(lane, _turned(lane.shape_m - origin, heading_rad)) for lane in run.lanes]
    lanes = tuple((lane, shape) for lane, shape in placed if _touches(shape))
    low, high = -4.0, 4.0
    for lane, shape in lanes:
        y_m = np.interp(np.linspace(-BEHIND_M, AHEAD_M, 25), *_sorted(shape), left=np.nan, right=np.nan)
        if np.isfinite(y_m).any():
            low = min(low, float(np.nanmin(y_m)) - 0.5 * lane.width_m - VERGE_M)
            high = max(high, float(np.nanmax(y_m)) + 0.5 * lane.width_m + VERGE_M)
    return _Scene(origin, heading_rad, lanes, max(low, -BESIDE_M), min(high, BESIDE_M))


def _sorted(shape: Points) -> tuple[Points, Points]:
    order = np.argsort(shape[:, 0], kind="stable")
    return shape[order, 0], shape[order, 1]


def _row_at(track: Trajectory, vehicle_id: str, t_s: float) -> int | None:
    """Return the vehicle's row nearest to ``t_s``, None where it has none within a second."""
    rows = track.rows_of.get(vehicle_id)
    if rows is None or rows.start == rows.stop:
        return None
    nearest = int(np.argmin(np.abs(track.time_s[rows] - t_s))) + rows.start
    return nearest if abs(track.time_s[nearest] - t_s) <= 1.0 else None


def _draw_view(
    axes: Axes, track: Trajectory, vehicle: Injected, moment: Moment, row: int, scene: _Scene
) -> None:
    axes.set_aspect("equal")
    axes.set_xlim(-BEHIND_M, AHEAD_M)
    axes.set_ylim(scene.low_m, scene.high_m)
    axes.set_facecolor("white")
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    axes.set_yticks([])
    _draw_lanes(axes, scene.lanes)

    mode = mode_style(run_mode(track, row))
    now = np.flatnonzero(track.time_s == track.time_s[row])
    places = scene.place(np.stack([track["x"][now], track["y"][now]], axis=1))
    near = (np.abs(places[:, 0]) < AHEAD_M + 20.0) & (np.abs(places[:, 1]) < BESIDE_M + 5.0)
    for index, place in zip(now[near].tolist(), places[near], strict=True):
        angle = float(track["heading"][index]) - scene.heading_rad
        size = (float(track["length"][index]), float(track["width"][index]))
        if index == row:
            _draw_car(axes, place, angle, size, fill=mode.colour, edge=INK, line=1.6, order=6)
        elif track.bound[index]:
            _draw_car(axes, place, angle, size, fill="white", edge=INK, line=1.8, order=5)
        else:
            _draw_car(axes, place, angle, size, fill=OTHER, edge="white", line=0.6, order=4)
    speed_mps = max(0.0, float(track["measured_speed"][row]))  # a rounded -0.0 reads badly
    title = f"{moment.t_s:.1f} s: {moment.why}. {vehicle.vehicle_id} at {speed_mps:.1f} m/s, {mode.label}"
    axes.set_title(title, loc="left", color=INK, fontsize=9.5, pad=4.0)


def run_mode(track: Trajectory, row: int) -> str:
    """Return the name of the safety mode in a row, empty for a vehicle that is not bound."""
    code = track["safety_mode"][row]
    return "" if np.isnan(code) else track.safety_mode_names.get(int(code), str(int(code)))


def _draw_lanes(axes: Axes, lanes: Sequence[tuple[Lane, Points]]) -> None:
    """Draw asphalt with a solid outer edge and broken lines between the lanes."""
    for lane, shape in lanes:
        axes.add_patch(Polygon(_ribbon(shape, lane.width_m + 0.5), color=ROAD_EDGE, lw=0.8, zorder=1))
    for lane, shape in lanes:
        axes.add_patch(Polygon(_ribbon(shape, lane.width_m), color=ROAD, lw=0.8, zorder=2))
    middles = [shape for _, shape in lanes]
    for lane, shape in lanes:
        for side in (-0.5, 0.5):
            line = shape + side * lane.width_m * _normals(shape)
            if any(_beside(line, other, 0.75 * lane.width_m) for other in middles if other is not shape):
                axes.plot(line[:, 0], line[:, 1], color="white", lw=1.4, ls=(0, (7, 7)), zorder=3)


def _touches(shape: Points) -> bool:
    reach = np.array([AHEAD_M, BESIDE_M]) + 10.0
    return bool((shape.min(axis=0) < reach).all() and (shape.max(axis=0) > -reach).all())


def _beside(line: Points, shape: Points, within_m: float) -> bool:
    """Return whether the middle of ``line`` runs beside ``shape`` rather than before or behind it."""
    middle = 0.5 * (line[0] + line[-1]) if len(line) == 2 else line[len(line) // 2]
    starts, steps = shape[:-1], np.diff(shape, axis=0)
    lengths = np.maximum((steps**2).sum(axis=1), 1e-12)
    along = ((middle - starts) * steps).sum(axis=1) / lengths
    feet = starts + np.clip(along, 0.0, 1.0)[:, None] * steps
    distance_m = np.sqrt(((middle - feet) ** 2).sum(axis=1))
    return bool(((distance_m < within_m) & (along >= 0.0) & (along <= 1.0)).any())


def _normals(shape: Points) -> Points:
    """Return the unit vector to the left at each point of a line."""
    along = np.gradient(shape, axis=0)
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)
    return np.stack([-along[:, 1] / length, along[:, 0] / length], axis=1)


def _ribbon(shape: Points, width_m: float) -> Points:
    side = 0.5 * width_m * _normals(shape)
    return np.concatenate([shape + side, (shape - side)[::-1]])


def _draw_car(
    axes: Axes,
    front: Points,
    angle_rad: float,
    size_m: tuple[float, float],
    *,
    fill: str,
    edge: str,
    line: float,
    order: float,
) -> None:
    """Draw a car as a box with a blunt nose and a windscreen, so that one sees where it heads."""
    length_m, width_m = size_m
    half = 0.5 * width_m
    nose = min(0.9, 0.25 * length_m)
    body = np.array(
        [
            [0, 0.55 * half],
            [-nose, half],
            [-length_m, half],
            [-length_m, -half],
            [-nose, -half],
            [0, -0.55 * half],
        ]
    )
    screen = np.array(
        [[-0.27 * length_m, 0.72 * half], [-0.40 * length_m, 0.78 * half], [-0.40 * length_m, -0.78 * half],
         [-0.27 * length_m, -0.72 * half]]
    )  # fmt: skip
    turn = np.array([[np.cos(angle_rad), np.sin(angle_rad)], [-np.sin(angle_rad), np.cos(angle_rad)]])
    axes.add_patch(Polygon(body @ turn + front, fc=fill, ec=edge, lw=line, zorder=order, joinstyle="round"))
    axes.add_patch(Polygon(screen @ turn + front, fc=edge, ec="none", alpha=0.55, zorder=order + 0.1))
