"""Speed, acceleration, brake and throttle of one vehicle around what happened to it."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from xgv_cosim.recording import Trajectory
from xgv_cosim.reports.canvas import as_svg, drawing, stacked, tidy
from xgv_cosim.reports.palette import (
    BRAKE,
    COMMANDED,
    EVENT,
    INK,
    MEASURED,
    QUIET,
    REFERENCE,
    THROTTLE,
    mode_style,
)
from xgv_cosim.reports.run_data import Injected, RunData

BEFORE_S = 8.0
AFTER_S = 12.0


def window_of(run: RunData, vehicle: Injected) -> tuple[float, float]:
    """Return the time span that shows all of a vehicle's injections and what followed."""
    last_s = vehicle.first_s
    for injection in vehicle.injections:
        begin_s = float(injection["at_s"])
        end_s = injection.get("end_s")
        still_s = run.standstill_s(vehicle.vehicle_id, injection)
        last_s = max(last_s, begin_s + 10.0, *(float(t) for t in (end_s, still_s) if t is not None))
    from_s, to_s = max(0.0, vehicle.first_s - BEFORE_S), min(run.end_s, last_s + AFTER_S)
    return from_s, max(to_s, from_s + 1.0)


def traces(run: RunData, track: Trajectory, vehicle: Injected) -> Markup | None:
    """Draw the traces of one vehicle; None where it was never seen in the window."""
    from_s, to_s = window_of(run, vehicle)
    all_rows = track.rows_of.get(vehicle.vehicle_id, slice(0, 0))
    inside = (track.time_s[all_rows] >= from_s) & (track.time_s[all_rows] <= to_s)
    rows = np.arange(all_rows.start, all_rows.stop)[inside]
    if len(rows) < 2:
        return None
    description = f"speed, acceleration, brake and throttle of {vehicle.vehicle_id}"
    time_s = track.time_s[rows]
    with drawing(description):
        figure, (bar, speed, accel, pedals) = stacked(
            [0.2, 2.3, 1.55, 1.55], gap_in=0.12, left_in=0.62, right_in=1.25, top_in=0.06, bottom_in=0.5
        )
        bar.set_xlim(from_s, to_s)
        for axes in (speed, accel, pedals):
            tidy(axes)
            axes.set_xlim(from_s, to_s)
            _shade(axes, run, vehicle, from_s, to_s, name=axes is speed)
        _mode_bar(bar, run, vehicle, from_s, to_s)

        speed.plot(
            time_s, track["commanded_speed"][rows], color=COMMANDED, lw=1.6, ls=(0, (5, 2)), label="commanded"
        )
        speed.plot(time_s, track["measured_speed"][rows], color=MEASURED, lw=2.6, label="measured")
        speed.plot(
            time_s,
            track["reference_speed"][rows],
            color=REFERENCE,
            lw=1.4,
            ls=(0, (1.0, 1.8)),
            label="reference",
        )
        speed.set_ylabel("speed, m/s")
        speed.set_ylim(*_range(speed.dataLim.y0, speed.dataLim.y1, least=6.0))

        accel.axhline(0.0, color=QUIET, lw=0.8)
        accel.plot(time_s, track["measured_accel"][rows], color=MEASURED, lw=1.6, label="measured")
        accel.set_ylabel("acceleration, m/s²")
        accel.set_ylim(*_range(accel.dataLim.y0, accel.dataLim.y1, least=3.0))

        pedals.plot(time_s, 100.0 * track["brake"][rows], color=BRAKE, lw=1.8, label="brake")
        pedals.plot(
            time_s,
            100.0 * track["throttle"][rows],
            color=THROTTLE,
            lw=1.8,
            ls=(0, (4, 1.5)),
            label="throttle",
        )
        pedals.set_ylabel("effort, %")
        pedals.set_ylim(-4.0, 104.0)
        pedals.set_xlabel("time since the start of the run, s")
        for axes in (speed, accel):
            axes.tick_params(labelbottom=False)
        for axes in (speed, accel, pedals):
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=2.6, borderaxespad=0.3)
        return as_svg(figure, description)


def _range(low: float, high: float, *, least: float) -> tuple[float, float]:
    margin = max(0.06 * (high - low), 0.5 * (least - (high - low)))
    return low - margin, high + max(margin, 0.18 * (high - low))


def _shade(axes: Axes, run: RunData, vehicle: Injected, from_s: float, to_s: float, *, name: bool) -> None:
    """Shade the time of each injection and mark the standstill."""
    for injection in vehicle.injections:
        begin_s = float(injection["at_s"])
        end_s = run.end_s if injection.get("end_s") is None else float(injection["end_s"])
        axes.axvspan(max(begin_s, from_s), min(end_s, to_s), color=EVENT, alpha=0.65, lw=0, zorder=0.5)
        axes.axvline(begin_s, color=BRAKE, lw=1.2, zorder=1.5)
        still_s = run.standstill_s(vehicle.vehicle_id, injection)
        if still_s is None or not from_s <= still_s <= to_s:
            continue
        axes.axvline(still_s, color=INK, lw=1.0, ls=(0, (3, 2)), zorder=1.5)
        if name:
            axes.annotate(
                f"stands still, {still_s:.1f} s",
                (still_s, 0.96),
                xycoords=("data", "axes fraction"),
                xytext=(5, 0) if still_s < from_s + 0.75 * (to_s - from_s) else (-5, 0),
                textcoords="offset points",
                ha="left" if still_s < from_s + 0.75 * (to_s - from_s) else "right",
                va="top",
                fontsize=8.5,
                color=INK,
            )


def _mode_bar(axes: Axes, run: RunData, vehicle: Injected, from_s: float, to_s: float) -> None:
    """Draw the safety mode as a coloured bar above the traces."""
    axes.set_axis_off()
    axes.set_ylim(0.0, 1.0)
    ends = [float(row["t_s"]) for row in vehicle.modes[1:]] + [run.end_s]
    for row, end_s in zip(vehicle.modes, ends, strict=True):
        left, right = max(from_s, float(row["t_s"])), min(to_s, end_s)
        if right <= left:
            continue
        style = mode_style(str(row["safety_mode"]))
        axes.axvspan(left, right, color=style.colour, lw=0)
        if (right - left) / (to_s - from_s) > 0.0095 * len(style.label):
            axes.text(
                0.5 * (left + right),
                0.46,
                style.label,
                ha="center",
                va="center",
                fontsize=8.5,
                color=style.ink,
                weight="bold",
            )
