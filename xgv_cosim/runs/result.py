"""``result.json``: what came of a run, in one file that a person or a script can read."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from xgv_cosim.errors import ReplayError
from xgv_cosim.events import Event
from xgv_cosim.metrics import VehicleSeries, Watch
from xgv_cosim.recording import RESULT, RESULT_SCHEMA, write_whole_file
from xgv_cosim.recording.disk import fail
from xgv_cosim.runs import standing
from xgv_cosim.runs.effects import facts_that_acted, handovers_s
from xgv_cosim.runs.expectations import CollisionFact, Outcome, RunFacts, VehicleFacts, evaluate
from xgv_cosim.runs.teleports import teleport_rows
from xgv_cosim.runs.vehicles import by_vehicle, vehicle_rows
from xgv_cosim.runs.versions import recorded_versions
from xgv_cosim.runs.warnings import warnings_of
from xgv_cosim.scenario.building import profile_of
from xgv_cosim.scenario.model import Scenario

if TYPE_CHECKING:
    from xgv_cosim.links.jaus_network import WireCounts


class RunStatus(StrEnum):
    """How a run ended."""

    OK = "ok"
    FAILED = "failed"
    """It ran to its end, but an expectation was not met."""
    INTERRUPTED = "interrupted"
    ERROR = "error"


@dataclass(slots=True)
class RunOutcome:
    """What the run itself knows when it has ended."""

    started_at: datetime
    status: RunStatus = RunStatus.OK
    error: str = ""
    ended_by: str = ""
    """What ended it before its time, other than an error or an interrupt; empty: nothing."""
    num_steps: int = 0
    wall_s: float = 0.0
    lane_ids: tuple[str, ...] | None = None
    """The world's lanes, None as long as they are not known."""
    rows_met: set[int] | None = None
    """Rows of ``bind`` that have matched a vehicle, None where the run did not begin."""
    standing: dict[str, float] = field(default_factory=dict)
    """Who has stood for long at the end, and for how long, for no reason that the run knows."""
    notes: tuple[str, ...] = ()
    """The traffic engine's own warnings."""
    wire: WireCounts | None = None
    """What went over the network; None without one."""
    most_behind_s: float = 0.0
    """How far a run in real time was behind the wall clock at most."""


@dataclass(frozen=True, slots=True)
class RunResult:
    """The result of one run: the content of ``result.json`` and where it lies."""

    folder: Path
    status: RunStatus
    data: dict[str, Any]

    @property
    def trace_hash(self) -> str:
        """Return the trace hash."""
        return str(self.data["trace_hash"])

    @property
    def vehicles(self) -> dict[str, Any]:
        """Return the row of each bound vehicle."""
        rows: dict[str, Any] = self.data["vehicles"]
        return rows


def result_of(
    scenario: Scenario, folder: Path, trace_hash: str, watch: Watch, outcome: RunOutcome
) -> RunResult:
    """Return the result of a run that has ended, in whatever way."""
    series, events = watch.series(), watch.events
    simulated_s = outcome.num_steps * scenario.step_s
    expectations = evaluate(scenario.expect, facts_of(watch, series, simulated_s, scenario.duration_s))
    status = outcome.status
    if status is RunStatus.OK and any(row.outcome is not Outcome.OK for row in expectations):
        status = RunStatus.FAILED
    data: dict[str, Any] = {
        "schema": RESULT_SCHEMA,
        "status": status.value,
        "error": outcome.error or None,
        "ended_by": outcome.ended_by or None,
        "scenario": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "versions": recorded_versions(),
        "started_at": outcome.started_at.isoformat(timespec="seconds"),
        "num_steps": outcome.num_steps,
        "step_s": scenario.step_s,
        "simulated_s": round(simulated_s, 9),
        "duration_s": scenario.duration_s,
        "wall_s": outcome.wall_s,
        "real_time_factor": simulated_s / outcome.wall_s if outcome.wall_s > 0.0 else None,
        "trace_hash": trace_hash,
        "num_vehicles_max": watch.num_vehicles_max,
        "num_bound_max": watch.num_bound_max,
        "collisions": [contact._asdict() for contact in watch.collisions],
        "teleports": teleport_rows(events, outcome.notes),
        "vehicles": vehicle_rows(series, events, watch.collisions, simulated_s, watch.placements),
        "expectations": [
            {"text": row.expected, "status": row.outcome.value, "detail": row.seen} for row in expectations
        ],
        "warnings": []  # nothing can be said of a run that has not begun but why
        if outcome.rows_met is None
        else [
            *warnings_of(scenario, events, outcome.lane_ids, outcome.rows_met),
            *standing.warning_of(outcome.standing),
        ],
        "notes": list(outcome.notes),
        "jaus": None
        if outcome.wire is None
        else {**asdict(outcome.wire), "most_behind_s": outcome.most_behind_s},
        "assumptions": assumption_rows(scenario, events),
    }
    return RunResult(folder, status, data)


def facts_of(watch: Watch, series: dict[str, VehicleSeries], end_s: float, duration_s: float) -> RunFacts:
    """Return what the expectations are held against.

    A vehicle that is not watched has modes and gaps, but no speeds: no expectation asks for them.
    """
    nothing = np.zeros(0)
    lows = watch.gap_lows
    handed_over = handovers_s(watch.events)
    vehicles: dict[str, VehicleFacts] = {}
    for name, events in by_vehicle(watch.events).items():
        if not any(event.kind == "bound" for event in events):
            continue
        seen, gaps = series.get(name), lows.get(name)
        modes = [event for event in events if event.kind == "safety_mode"]
        vehicles[name] = VehicleFacts(
            t_s=seen.t_s if seen else nothing,
            speed_mps=seen.speed_mps if seen else nothing,
            gap_t_s=gaps.t_s if gaps else nothing,
            gap_ahead_m=gaps.ahead_m if gaps else nothing,
            gap_behind_m=gaps.behind_m if gaps else nothing,
            mode_t_s=[event.t_s for event in modes],
            modes=[event.after for event in modes],
            handover_s=handed_over.get(name, -np.inf),
        )
    collisions = [CollisionFact(row.t_s, (row.collider, row.victim)) for row in watch.collisions]
    return RunFacts(end_s, duration_s, vehicles, collisions)


def assumption_rows(scenario: Scenario, events: list[Event]) -> list[dict[str, Any]]:
    """Return the ledger: every reading that the sources leave open, and whether it had an effect."""
    facts = facts_that_acted(events)
    rows = []
    for assumption in profile_of(scenario).assumptions():
        row = asdict(assumption)
        row.pop("facts")
        rows.append(row | {"exercised": not facts.isdisjoint(assumption.facts)})
    return rows


def write_result(result: RunResult) -> None:
    """Write ``result.json``.

    Raises:
        RecordingError: It cannot be written.
    """
    path = result.folder / RESULT
    text = json.dumps(result.data, indent=2, ensure_ascii=False, allow_nan=False)
    try:
        write_whole_file(path, (text + "\n").encode())
    except OSError as error:
        fail(path, error, "The other files of the run are readable.")


def read_result(folder: Path) -> dict[str, Any]:
    """Return the content of a run folder's ``result.json``.

    Raises:
        ReplayError: It is missing or not a result.
    """
    path = folder / RESULT
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ReplayError(f"{path}: cannot be read ({error.strerror}); expected a run folder") from error
    except ValueError as error:
        raise ReplayError(f"{path}: not JSON: {error}") from error
    if not isinstance(data, dict) or data.get("schema") != RESULT_SCHEMA:
        got = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise ReplayError(f"{path}: got schema {got!r}, expected {RESULT_SCHEMA!r}")
    return data
