"""The ways in from Python: step a simulation yourself, or make a whole run with its folder."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from xgv_cosim.errors import ScenarioError
from xgv_cosim.runs import Progress, RunResult, run_scenario
from xgv_cosim.scenario.building import ScenarioSimulation, WindowOptions, build
from xgv_cosim.scenario.loading import load_scenario, override
from xgv_cosim.scenario.model import Scenario
from xgv_cosim.simulation import Observer


def simulate(
    scenario: str | Path | Scenario,
    *,
    seed: int | None = None,
    set: Sequence[str] = (),  # noqa: A002 - the name of the option on the command line
    bind: Sequence[str] = (),
    inject: Sequence[str] = (),
    observers: Sequence[Observer] = (),
    gui: bool = False,
    gui_delay_ms: float | None = None,
) -> ScenarioSimulation:
    """Open a scenario to be stepped by the caller; nothing is written to disk.

    Use it as a context manager, since one process holds one SUMO simulation at a time.

    Args:
        scenario: Packaged name, path of a scenario file or of a ``.sumocfg``, or a loaded scenario.
        seed: Replaces the scenario's seed.
        set: ``dotted.key=value`` overrides, as on the command line.
        bind: Further rows of ``bind``, as ``--bind`` takes them; not for a loaded scenario.
        inject: Further rows of ``injections``, as ``--inject`` takes them; not for a loaded scenario.
        observers: Told of each step and event.
        gui: Show it in a window of sumo-gui (extra ``gui``).
        gui_delay_ms: Wall time that each step in the window takes at least; None: as long as it simulates.

    Raises:
        ScenarioError: The scenario is not there, or wrong.
        WorldError: SUMO cannot start, or runs in this process already.
    """
    window = WindowOptions(gui_delay_ms) if gui else None
    return build(_loaded(scenario, seed, set, bind, inject), observers, window)


def run(
    scenario: str | Path | Scenario,
    *,
    seed: int | None = None,
    out: str | Path | None = None,
    set: Sequence[str] = (),  # noqa: A002 - the name of the option on the command line
    bind: Sequence[str] = (),
    inject: Sequence[str] = (),
    progress: Progress | None = None,
    report: bool = True,
    gui: bool = False,
    gui_delay_ms: float | None = None,
) -> RunResult:
    """Run a scenario to its end and return its result, whose ``folder`` holds all that was recorded.

    Args:
        scenario: Packaged name, path of a scenario file or of a ``.sumocfg``, or a loaded scenario.
        seed: Replaces the scenario's seed.
        out: A new or empty folder; None: ``runs/NAME-seedN-TIME``.
        set: ``dotted.key=value`` overrides, as on the command line.
        bind: Further rows of ``bind``, as ``--bind`` takes them; not for a loaded scenario.
        inject: Further rows of ``injections``, as ``--inject`` takes them; not for a loaded scenario.
        progress: Called after each step with (simulated seconds, seconds of the whole run).
        report: Write ``report.html`` too.
        gui: See ``simulate``.
        gui_delay_ms: See ``simulate``.

    Raises:
        ScenarioError: The scenario is not there, or wrong.
        WorldError: SUMO cannot start or failed.
        RecordingError: The folder cannot be written.
    """
    loaded = _loaded(scenario, seed, set, bind, inject)
    folder = default_folder(loaded) if out is None else Path(out)
    window = WindowOptions(gui_delay_ms) if gui else None
    result = run_scenario(loaded, folder, progress=progress, window=window)
    if report:
        from xgv_cosim.reports import write_report  # noqa: PLC0415 - drawing is dear to import

        write_report(folder)
    return result


def default_folder(scenario: Scenario) -> Path:
    """Return a run folder of its own for a run that begins now."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S")
    stem = Path("runs") / f"{scenario.name}-seed{scenario.seed}-{stamp}"
    folder, number = stem, 2
    while folder.exists():
        folder, number = stem.with_name(f"{stem.name}-{number}"), number + 1
    return folder


def _loaded(
    scenario: str | Path | Scenario,
    seed: int | None,
    overrides: Sequence[str],
    bind: Sequence[str],
    inject: Sequence[str],
) -> Scenario:
    chosen = [*overrides] if seed is None else [*overrides, f"seed={seed}"]
    if not isinstance(scenario, Scenario):
        return load_scenario(scenario, chosen, bind=bind, inject=inject)
    if bind or inject:
        raise ScenarioError("bind and inject go with a scenario's name or file; change a loaded one itself")
    return override(scenario, chosen)
