"""What a report reads: one run folder, complete or not."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xgv_cosim.errors import ReplayError
from xgv_cosim.metrics.standstill import first_standstill_s
from xgv_cosim.metrics.stops import judged_until_s
from xgv_cosim.recording import EVENTS, RESULT, RESULT_SCHEMA, ROAD, TRAJECTORY, Trajectory, read_trajectory


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane as ``road.json`` has it."""

    lane_id: str
    length_m: float
    width_m: float
    shape_m: npt.NDArray[np.float64]
    """Centre line, shape ``(k, 2)``, frame east-north-up."""


@dataclass(frozen=True, slots=True)
class Injected:
    """A vehicle to which something was done."""

    vehicle_id: str
    injections: tuple[Mapping[str, Any], ...]
    """Rows (kind, at_s, end_s)."""
    modes: tuple[Mapping[str, Any], ...]
    """Rows (t_s, control_mode, ready_mode, safety_mode, reasons), each in force until the next."""
    metrics: Mapping[str, Any]

    @property
    def first_s(self) -> float:
        """Return when the first injection began."""
        return float(min(row["at_s"] for row in self.injections))


@dataclass(frozen=True, slots=True)
class RunData:
    """A run folder in memory."""

    folder: Path
    result: Mapping[str, Any]
    events: tuple[Mapping[str, Any], ...]
    trajectory: Trajectory | None
    lanes: tuple[Lane, ...]
    problems: tuple[str, ...]
    """What is missing from the folder, in words for the reader."""

    @property
    def end_s(self) -> float:
        """Return how long the run lasted."""
        if self.trajectory is not None and self.trajectory.num_rows:
            return float(self.trajectory.time_s.max())
        return float(self.result.get("simulated_s") or 0.0)

    @property
    def injected(self) -> tuple[Injected, ...]:
        """Return the vehicles with injections, in the order of their first one."""
        rows = [
            Injected(name, tuple(row["injections"]), tuple(row.get("modes", ())), row.get("metrics", {}))
            for name, row in self.result.get("vehicles", {}).items()
            if row.get("injections")
        ]
        return tuple(sorted(rows, key=lambda row: (row.first_s, row.vehicle_id)))

    def standstill_s(self, vehicle_id: str, injection: Mapping[str, Any]) -> float | None:
        """Return when the vehicle came to a standstill because of an injection, None if it did not.

        Standstill is what ``metrics.standstill`` says: slow enough for long enough.
        """
        track = self.trajectory
        if track is None or vehicle_id not in track.rows_of:
            return None
        rows = track.rows_of[vehicle_id]
        until_s = judged_until_s(injection.get("end_s"))
        speed_mps = track["measured_speed"][rows]
        return first_standstill_s(track.time_s[rows], speed_mps, float(injection["at_s"]), until_s)


def read_run(folder: Path) -> RunData:
    """Read a run folder; what is missing or unreadable is named in ``problems``.

    Raises:
        ReplayError: It is not a run folder, or ``result.json`` is of another schema.
    """
    if not folder.is_dir():
        raise ReplayError(f"{folder}: no such run folder")
    problems: list[str] = []
    result = _read_result(folder / RESULT, problems)
    events = _read_events(folder / EVENTS, problems)
    if not result and not events and not (folder / TRAJECTORY).exists():
        raise ReplayError(f"{folder}: holds none of {RESULT}, {EVENTS}, {TRAJECTORY}; not a run folder")
    trajectory = None
    try:
        trajectory = read_trajectory(folder / TRAJECTORY)
    except ReplayError as error:
        problems.append(f"The trajectories are missing, so there are no pictures of the motion. ({error})")
    return RunData(folder, result, events, trajectory, _read_lanes(folder / ROAD), tuple(problems))


def _read_result(path: Path, problems: list[str]) -> dict[str, Any]:
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        problems.append(f"{RESULT} is missing or unreadable, so this report lacks results. ({error})")
        return {}
    if not isinstance(result, dict) or result.get("schema") != RESULT_SCHEMA:
        got = result.get("schema") if isinstance(result, dict) else type(result).__name__
        raise ReplayError(f"{path}: got schema {got!r}, expected {RESULT_SCHEMA!r}")
    return result


def _read_events(path: Path, problems: list[str]) -> tuple[dict[str, Any], ...]:
    rows = []
    try:
        for line in path.read_text(encoding="utf-8").splitlines():
            rows.append(json.loads(line))  # noqa: PERF401 - rows before a broken one are kept
    except (OSError, ValueError) as error:
        problems.append(f"{EVENTS} could be read in part only. ({error})")
    return tuple(rows)


def _read_lanes(path: Path) -> tuple[Lane, ...]:
    if not path.exists():
        return ()
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["lanes"]
        return tuple(
            Lane(
                row["id"],
                row["length_m"],
                row["width_m"],
                np.array(row["shape_m"], np.float64).reshape(-1, 2),
            )
            for row in rows
        )
    except (OSError, ValueError, KeyError) as error:
        raise ReplayError(f"{path}: cannot read the road: {error!r}") from error
