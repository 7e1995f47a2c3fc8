"""What was measured, as rows of words and numbers: for JSON, for Markdown, and for a terminal."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xgv_cosim._version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from xgv_cosim.bench.measuring import Case, Cost

SCHEMA = "xgv-cosim/bench/1"
PACKAGES = ("libsumo", "ruckig", "numba", "numpy")
COLUMNS = (
    "network",
    "coupling",
    "vehicles",
    "bound",
    "with",
    "SUMO alone",
    "floor",
    "bound, all",
    "ratio to plain",
    "ratio to floor",
    "emulator",
    "extras",
)
UNITS = ("", "", "", "", "", *("µs/step",) * 3, "", "", *("µs/veh",) * 2)
NUMBERS_FROM = 2
"""Columns from here on hold numbers, but for the one called ``with``."""


def document(costs: Iterable[Cost], repeats: int) -> dict[str, Any]:
    """Return what ``xgv-cosim bench --json`` prints."""
    return {"schema": SCHEMA, **machine(), "repeats": repeats, "cases": [json_row(cost) for cost in costs]}


def machine() -> dict[str, Any]:
    """Return what was measured on: versions, processor, and how busy it was."""
    versions = {"xgv-cosim": __version__, "python": platform.python_version()}
    versions |= {name: version(name) for name in PACKAGES}
    return {
        "versions": versions,
        "processor": processor(),
        "cores": os.cpu_count(),
        "load_average_1min": round(os.getloadavg()[0], 2),
    }


def processor() -> str:
    """Return what the processor calls itself."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def json_row(cost: Cost) -> dict[str, Any]:
    """Return one case: names say the units, times are µs of processor time."""
    case = cost.case
    return {
        "network": case.traffic.network,
        "coupling": case.coupling.value,
        "vehicles": case.traffic.num_vehicles,
        "bound": cost.num_bound,
        "with": sorted(case.extras),
        "steady": case.steady,
        "ratio_to_plain": round(cost.ratio_to_plain, 3),
        "ratio_to_floor": round(cost.ratio_to_floor, 3),
        "emulator_us": round(cost.emulator_us, 3),
        "extras_us": None if cost.extras_us is None else round(cost.extras_us, 3),
        "plain_us_per_step": round(cost.plain_us, 2),
        "floor_us_per_step": round(cost.floor_us, 2),
        "bound_us_per_step": round(cost.bound_us, 2),
        "steps": case.timed_steps,
        "in_lane_frame_share": round(cost.in_lane_frame, 3),
        "beside_way_max_m": round(cost.beside_m, 3),
        "floor_off_max_m": round(cost.floor_off_m, 6),
        "calls_per_vehicle_and_step": {name: round(count, 4) for name, count in cost.calls.items()},
        "further_calls_per_vehicle_and_step": {n: round(count, 4) for n, count in cost.other_calls.items()},
    }


def switched_on(case: Case) -> str:
    """Return in words what is special about a case."""
    return ", ".join((*sorted(case.extras), *(("steady targets",) if case.steady else ()))) or "-"


def cells(cost: Cost) -> tuple[str, ...]:
    """Return a row below ``COLUMNS``."""
    case = cost.case
    return (
        case.traffic.network,
        case.coupling.value,
        str(case.traffic.num_vehicles),
        str(cost.num_bound),
        switched_on(case),
        f"{cost.plain_us:.0f}",
        f"{cost.floor_us:.0f}",
        f"{cost.bound_us:.0f}",
        f"{cost.ratio_to_plain:.2f}",
        f"{cost.ratio_to_floor:.2f}",
        f"{cost.emulator_us:.2f}",
        "-" if cost.extras_us is None else f"{cost.extras_us:.2f}",
    )


def markdown(costs: Sequence[Cost], repeats: int) -> str:
    """Return the table for a README, with what it was measured on."""
    found = machine()
    versions = ", ".join(f"{name} {number}" for name, number in found["versions"].items())
    titles = [f"{title} ({unit})" if unit else title for title, unit in zip(COLUMNS, UNITS, strict=True)]
    rules = ["---:" if is_number(number) else "---" for number in range(len(COLUMNS))]
    lines = [titles, rules, *(cells(cost) for cost in costs)]
    where = f"{found['processor']}, {found['cores']} cores, load average {found['load_average_1min']:g}"
    head = f"{where}; {versions}; processor time, medians of {repeats}."
    return "\n".join([head, "", *("| " + " | ".join(line) + " |" for line in lines)])


def is_number(column: int) -> bool:
    """Return whether a column is aligned as numbers are."""
    return column >= NUMBERS_FROM and COLUMNS[column] != "with"
