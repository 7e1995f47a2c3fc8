"""What happened, in plain words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from xgv_cosim.reports.palette import mode_style
from xgv_cosim.reports.run_data import Injected, RunData

_INJECTION_NAMES: Final = {
    "estop_pause": "SafeStop pause",
    "estop_disable": "SafeStop stop",
    "estop_button": "emergency stop button",
    "override": "manual override",
    "emo": "emergency manual override",
    "door": "door open",
    "error": "internal error",
    "cmd_loss": "commands lost",
    "link": "SafeStop link lost",
    "pause_request": "pause request",
    "shutdown": "shutdown",
    "reinit": "reinitialise",
}


def injection_name(kind: str) -> str:
    """Return an injection kind in words."""
    return _INJECTION_NAMES.get(kind, kind.replace("_", " "))


HELD: Final = frozenset({"ok", "passed"})
"""Statuses of an expectation that held."""


@dataclass(frozen=True, slots=True)
class Metric:
    """A measured value as the table shows it."""

    key: str
    name: str
    unit: str
    digits: int
    help: str
    most: float = math.inf
    """Beyond this a value says no more than that it is large."""

    def cell(self, value: float | None) -> str:
        """Return the value as the table shows it."""
        if value is not None and value > self.most:
            return f"over {self.most:.0f} {self.unit}"
        return number(value, self.digits, self.unit)


METRICS: Final = (
    Metric(
        "speed_at_event_mps", "speed at the event", "m/s", 1, "How fast the car drove when the event began."
    ),
    Metric("time_to_standstill_s", "time to standstill", "s", 1, "From the event until the car stood still."),
    Metric(
        "stopping_distance_m",
        "stopping distance",
        "m",
        1,
        "How far the car drove from the event to standstill.",
    ),
    Metric(
        "ideal_stopping_distance_m",
        "ideal stopping distance",
        "m",
        1,
        "v²/2a: the distance with the mode's set deceleration at once and throughout.",
    ),
    Metric(
        "stopping_distance_ratio",
        "stopping distance / ideal",
        "",
        2,
        "1.00 is ideal; above it the brakes came late or weak.",
    ),
    Metric(
        "peak_decel_mps2",
        "hardest braking",
        "m/s²",
        1,
        "Greatest deceleration; 9 is about all a dry road gives.",
    ),
    Metric(
        "min_ttc_s",
        "least time to collision, ahead",
        "s",
        1,
        "If both kept their speed, time until this car hits the one ahead. Below 1.5 s is critical.",
        60.0,
    ),
    Metric(
        "min_ttc_follower_s",
        "least time to collision, behind",
        "s",
        1,
        "The same for the car behind hitting this one: the risk that a stop puts on others.",
        60.0,
    ),
    Metric("min_gap_m", "smallest gap", "m", 1, "Least distance between bumpers to the car ahead or behind."),
    Metric(
        "unattended_speed_s",
        "speed in nobody's hands",
        "s",
        1,
        "Time in which neither computer nor driver governed speed: released, and not yet taken.",
    ),
    Metric("unattended_steering_s", "steering in nobody's hands", "s", 1, "The same for steering."),
    Metric("collisions", "collisions", "", 0, "Contacts with other vehicles."),
    Metric(
        "placement_error_m",
        "largest placement error",
        "m",
        3,
        "Largest distance between where the vehicle model had the car and where SUMO had it.",
    ),
    Metric(
        "placement_error_deg",
        "largest heading error",
        "°",
        2,
        "Largest difference between the heading of the vehicle model and SUMO's.",
    ),
    Metric(
        "share_in_lane_frame",
        "share written in its lane",
        "",
        3,
        "Share of steps written as speed and lateral position in the lane rather than as a free pose.",
    ),
)


def number(value: Any, digits: int = 1, unit: str = "") -> str:  # noqa: ANN401 - a cell of result.json
    """Return a number as text with its unit, a dash for none."""
    if value is None or isinstance(value, (str, Mapping)):
        return str(value) if isinstance(value, str) else "\N{EN DASH}"
    return f"{value:.{digits}f}{' ' + unit if unit else ''}"


def verdict(run: RunData) -> tuple[str, str]:
    """Return the tone (``good``, ``bad`` or ``partial``) and the headline of the run."""
    result = run.result
    status = result.get("status")
    expectations = result.get("expectations", [])
    held = sum(row["status"] in HELD for row in expectations)
    if status == "ok":
        if not expectations:
            return "good", "Completed; the scenario states no expectations."
        what = "its one expectation" if held == 1 else f"all {held} expectations"
        return "good", f"Passed: {what} held."
    if status == "failed":
        return "bad", f"Failed: {len(expectations) - held} of {len(expectations)} expectations did not hold."
    if status == "interrupted":
        return "partial", "Interrupted: this is what was recorded until then."
    if status == "error":
        return "bad", "Ended by an error: this is what was recorded until then."
    return "partial", "Incomplete: the run left no result, only what was recorded until it broke off."


def summary(run: RunData) -> str:
    """Return one sentence about the whole run."""
    result = run.result
    cars = result.get("num_vehicles_max")
    parts = [f"{result.get('scenario', run.folder.name)} ran for {run.end_s:.0f} s of simulated time"]
    if cars is not None:
        emulated = result.get("num_bound_max", 0)
        parts.append(
            f"with up to {cars} vehicles at once, {emulated} of them emulated drive-by-wire vehicles"
        )
    collisions = result.get("collisions")
    if collisions is not None:
        parts.append(_count(len(collisions), "collision"))
    return "; ".join([" ".join(parts[:2]), *parts[2:]]) + "."


def _count(number_of: int, what: str) -> str:
    return f"no {what}" if number_of == 0 else f"{number_of} {what}{'s' if number_of > 1 else ''}"


def story(run: RunData, vehicle: Injected) -> str:
    """Return what happened to one vehicle, in a few sentences."""
    metrics = vehicle.metrics
    spans = []
    for injection in vehicle.injections:
        end_s = injection.get("end_s")
        until = "the end of the run" if end_s is None else f"{end_s:.1f} s"
        spans.append(f"{injection_name(injection['kind'])} from {injection['at_s']:.1f} s to {until}")
    text = "; ".join(spans)
    text = text[0].upper() + text[1:]
    if metrics.get("speed_at_event_mps") is not None:
        text += f", met at {metrics['speed_at_event_mps']:.1f} m/s"
    text += "."
    modes = _modes_entered(vehicle)
    if modes:
        text += f" Safety mode: {' → '.join(modes)}."
    if metrics.get("time_to_standstill_s") is not None:
        text += f" It stood still after {metrics['time_to_standstill_s']:.1f} s"
        if metrics.get("stopping_distance_m") is not None:
            text += f" and {metrics['stopping_distance_m']:.0f} m"
        if metrics.get("ideal_stopping_distance_m") is not None:
            text += f" (ideal {metrics['ideal_stopping_distance_m']:.0f} m)"
        text += "."
    elif all(run.standstill_s(vehicle.vehicle_id, injection) is None for injection in vehicle.injections):
        text += " It did not come to a standstill."
    if metrics.get("collisions") is not None:
        text += f" {_count(int(metrics['collisions']), 'collision').capitalize()}."
    return text


def _modes_entered(vehicle: Injected) -> list[str]:
    """Return the safety modes from the one in force at the first injection on."""
    names: list[str] = []
    for row in vehicle.modes:
        if row["safety_mode"] == "unknown":
            continue
        label = mode_style(str(row["safety_mode"])).label
        if row["t_s"] < vehicle.first_s:
            names = [label]
        elif not names or names[-1] != label:
            names.append(label)
    return names
