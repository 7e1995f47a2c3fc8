"""One run: a scenario in, a run folder out, however the run ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from xgv_cosim.clock import tick_at_or_after
from xgv_cosim.errors import RecordingError, ScenarioError, XgvCosimError
from xgv_cosim.metrics import Watch
from xgv_cosim.recording import Recorder, prepare_run_folder
from xgv_cosim.recording.disk import fail
from xgv_cosim.runs.interrupts import InterruptsBetweenSteps
from xgv_cosim.runs.lock import write_lock
from xgv_cosim.runs.pacing import RealTime
from xgv_cosim.runs.result import RunOutcome, RunResult, RunStatus, result_of, write_result
from xgv_cosim.runs.standing import unexplained
from xgv_cosim.scenario.building import ScenarioSimulation, WindowOptions, build, named_vehicles, profile_of
from xgv_cosim.scenario.files import require_files
from xgv_cosim.scenario.model import Scenario
from xgv_cosim.simulation import Simulation

if TYPE_CHECKING:
    from xgv_cosim.links.jaus_network import JausOptions
    from xgv_cosim.simulation.wire import Announce

Progress = Callable[[float, float], None]
"""Called after each world step with (simulated seconds, seconds of the whole run)."""


def run_scenario(
    scenario: Scenario,
    folder: Path,
    *,
    progress: Progress | None = None,
    num_steps: int | None = None,
    window: WindowOptions | None = None,
    jaus: JausOptions | None = None,
    announce: Announce | None = None,
) -> RunResult:
    """Run a scenario and return its result; the folder holds everything but the report.

    An interrupt (Ctrl-C) ends the run after the step in which it comes, a second one at once; the status
    is ``interrupted`` and what was recorded is written.

    Args:
        scenario: What to run, seed included.
        folder: A new or empty folder.
        progress: Told of each step.
        num_steps: End after this many world steps rather than after ``duration_s``, which counts as whole
            world steps, the last one begun included.
        window: Show the run in a window of sumo-gui.
        jaus: Let clients that speak JAUS reach every bound vehicle; the run then goes on in real time.
        announce: Told of each vehicle that they can reach: its id, its subsystem number, place of its port.

    Raises:
        ScenarioError: Something the scenario names does not exist or cannot be done.
        LinkError: The port for clients cannot be opened.
        WorldError: SUMO cannot start or failed.
        RecordingError: The folder cannot be written.

    If an input file is missing or the folder cannot be taken into use, there is no run and no
    ``result.json``. Once the recording has begun, whatever is raised is raised after all that was recorded
    has been written, with ``result.json`` of status ``error``, as far as the disk takes it.
    """
    require_files(scenario)
    _require_a_way_in(scenario, jaus)
    prepare_run_folder(folder)
    try:
        write_lock(scenario, folder)
    except OSError as error:
        fail(folder, error, "Nothing was recorded.")
    watch = Watch(_watched(scenario))
    recorder = Recorder(folder, safety_mode_name=profile_of(scenario).safety_mode_name)
    outcome = RunOutcome(started_at=datetime.now(UTC))
    wanted = num_steps if num_steps is not None else steps_of(scenario)
    raised: Exception | None = None
    simulation: ScenarioSimulation | None = None
    try:
        simulation = build(scenario, (recorder, watch), window)
        with simulation:
            road = simulation.world.road
            recorder.use_road(road)
            outcome.lane_ids, outcome.rows_met = road.lane_ids, simulation.rows_met
            real_time = None
            if jaus is not None:
                network = jaus.open()
                simulation.connect(network, announce, lockstep=False)
                real_time, outcome.wire = RealTime(simulation.communicate), network.counts
            _advance(simulation, scenario, wanted, outcome, progress, real_time)
            outcome.standing = unexplained(simulation, watch.standing.lasts_s())
    except KeyboardInterrupt:
        outcome.status = RunStatus.INTERRUPTED
    except Exception as error:  # noqa: BLE001 - recorded with all there is, then raised again
        words = str(error) if isinstance(error, XgvCosimError) else f"{type(error).__name__}: {error}"
        outcome.status, outcome.error, raised = RunStatus.ERROR, words, error
    if simulation is not None:
        outcome.notes = simulation.world.messages  # only now: SUMO writes its log when it is closed
    outcome.num_steps = recorder.num_steps
    raised = _close(recorder, outcome, raised)
    result = result_of(scenario, folder, recorder.trace_hash, watch, outcome)
    try:
        write_result(result)
    except RecordingError as error:
        raised = raised or error
    if raised is not None:
        raise raised
    return result


def steps_of(scenario: Scenario) -> int:
    """Return the world steps of a whole run: as many as it takes to reach ``duration_s``.

    A length that is no multiple of ``step_s`` is rounded up rather than refused, so that either can be
    changed alone (``--set step_s=0.05``), and what has to hold to the end is judged to the end.
    """
    return -(-tick_at_or_after(scenario.duration_s) // tick_at_or_after(scenario.step_s))


def _watched(scenario: Scenario) -> set[str]:
    expected = {row.vehicle for row in scenario.expect if row.vehicle is not None}
    return expected.union(*(named_vehicles(row.vehicles) for row in scenario.injections))


def _require_a_way_in(scenario: Scenario, jaus: JausOptions | None) -> None:
    """Refuse a scenario whose vehicles wait for a client that cannot reach them."""
    waiting = [number for number, row in enumerate(scenario.bind) if row.stack == "external"]
    if waiting and jaus is None:
        raise ScenarioError(
            f"bind.{waiting[0]}.stack: got external, but no client can reach the vehicles; run it with "
            "--jaus 127.0.0.1:3794, or name a stack"
        )


def _advance(
    simulation: Simulation,
    scenario: Scenario,
    wanted: int,
    outcome: RunOutcome,
    progress: Progress | None,
    real_time: RealTime | None,
) -> None:
    """Step to the end, timing what the steps take."""
    began = time.perf_counter()
    try:
        with InterruptsBetweenSteps() as interrupts:
            for _ in range(wanted):
                interrupts.check()
                simulation.step()
                outcome.ended_by = simulation.ended_by
                if real_time is not None:
                    real_time.wait_until(simulation.now_s)
                    outcome.most_behind_s = real_time.most_behind_s
                if progress is not None:
                    progress(simulation.now_s, wanted * scenario.step_s)
                if outcome.ended_by:
                    break
    finally:
        outcome.wall_s = time.perf_counter() - began


def _close(recorder: Recorder, outcome: RunOutcome, raised: Exception | None) -> Exception | None:
    """Write what is written at the end; the first error is the one that counts."""
    try:
        recorder.close()
    except RecordingError as error:
        if raised is None:
            outcome.status, outcome.error = RunStatus.ERROR, str(error)
            return error
    return raised
