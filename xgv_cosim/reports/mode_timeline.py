"""The mode timeline: control, ready and safety mode of each injected vehicle as bars, reasons on hover."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from xgv_cosim.reports.palette import UNKNOWN, ModeStyle, mode_style, plain
from xgv_cosim.reports.run_data import Injected, RunData
from xgv_cosim.reports.wording import injection_name

WIDTH: Final = 1000.0
"""Width of the drawing; the page scales it."""
LEFT: Final = 176.0
BAR: Final = 20.0
ROW: Final = 24.0
_LETTER: Final = 6.4

_QUIET_STYLES: Final = {
    "motion_profiles": ModeStyle("motion profiles", "#c5d9ea", "#1d2530"),
    "wrench_efforts": ModeStyle("wrench efforts", "#cfe3cb", "#1d2530"),
    "software_pause": ModeStyle("software pause", "#f6e3ae", "#1d2530"),
    "ready": ModeStyle("ready", "#d6e6f2", "#1d2530"),
}
"""Control and ready modes are paler than the safety mode, which is the outcome."""


@dataclass(frozen=True, slots=True)
class Bar:
    """A stretch of time in one mode."""

    x: float
    y: float
    width: float
    style: ModeStyle
    text: str
    """What stands in it: empty where it would not fit."""
    hover: str


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time in which an injection was at work."""

    x: float
    y: float
    width: float
    height: float
    text: str
    hover: str


@dataclass(frozen=True, slots=True)
class VehicleRows:
    """The bars of one vehicle."""

    name: str
    y: float
    bars: tuple[Bar, ...]
    spans: tuple[Span, ...]


@dataclass(frozen=True, slots=True)
class Timeline:
    """The whole drawing in its own units, for the template."""

    width: float
    height: float
    left: float
    vehicles: tuple[VehicleRows, ...]
    ticks: tuple[tuple[float, str], ...]


def mode_timeline(run: RunData, injected: Sequence[Injected]) -> Timeline | None:
    """Lay out the timeline; None without injected vehicles or without time."""
    end_s = run.end_s
    if not injected or end_s <= 0.0:
        return None

    def x_of(t_s: float) -> float:
        return LEFT + (WIDTH - LEFT - 26.0) * min(max(t_s, 0.0), end_s) / end_s

    vehicles = []
    y = 8.0
    for vehicle in injected:
        top = y
        y += ROW
        bars: list[Bar] = []
        for key in ("control_mode", "ready_mode", "safety_mode"):
            bars += _bars(vehicle.modes, key, y, end_s, x_of)
            y += ROW
        spans = []
        for injection in vehicle.injections:
            begin_s = float(injection["at_s"])
            stop_s = end_s if injection.get("end_s") is None else float(injection["end_s"])
            x = x_of(begin_s)
            name = injection_name(injection["kind"])
            until = "the end of the run" if injection.get("end_s") is None else f"{stop_s:.1f} s"
            fits = len(name) * _LETTER < WIDTH - x
            spans.append(
                Span(
                    x,
                    top,
                    max(2.0, x_of(stop_s) - x),
                    4 * ROW,
                    name if fits else "",
                    f"{name}: {begin_s:.1f} s to {until}",
                )
            )
        vehicles.append(VehicleRows(vehicle.vehicle_id, top, tuple(bars), tuple(spans)))
        y += 16.0
    return Timeline(WIDTH, y + 26.0, LEFT, tuple(vehicles), tuple((x_of(t), f"{t:g}") for t in _ticks(end_s)))


def _bars(modes: Sequence[Mapping[str, Any]], key: str, y: float, end_s: float, x_of: Any) -> list[Bar]:  # noqa: ANN401 - local function
    """Return the bars of one row; neighbours of the same mode become one."""
    stretches: list[tuple[str, float, list[str]]] = []
    for row in modes:
        name, t_s, reasons = (
            str(row[key]),
            float(row["t_s"]),
            [str(reason) for reason in row.get("reasons", ())],
        )
        if stretches and stretches[-1][0] == name:
            continue
        stretches.append((name, t_s, reasons))
    ends = [t_s for _, t_s, _ in stretches[1:]] + [end_s]
    bars = []
    for (name, t_s, reasons), stop_s in zip(stretches, ends, strict=True):
        style = (
            mode_style(name)
            if key == "safety_mode"
            else _QUIET_STYLES.get(name.lower().replace(" ", "_"), _pale(name))
        )
        x, width = x_of(t_s), max(1.0, x_of(stop_s) - x_of(t_s))
        fits = len(style.label) * _LETTER + 8.0 < width
        hover = f"{plain(key)}: {style.label}, {t_s:.2f} s to {stop_s:.2f} s"
        if reasons:
            hover += "\nwhy: " + "\n  ".join(reasons)
        bars.append(Bar(x, y, width, style, style.label if fits else "", hover))
    return bars


def _pale(name: str) -> ModeStyle:
    return ModeStyle(plain(name) or UNKNOWN.label, "#e3e7ec", "#1d2530")


def _ticks(end_s: float) -> list[float]:
    """Return up to about ten round times from 0 to ``end_s``."""
    for step in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0):
        if end_s / step <= 11.0:
            return [step * number for number in range(int(end_s / step) + 1)]
    return [0.0, end_s]
