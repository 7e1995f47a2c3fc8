"""``xgv-cosim run``: one scenario, a progress bar, a table of what happened, and a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from xgv_cosim.cli.app import app
from xgv_cosim.cli.exit_codes import EXIT_EXPECTATION_FAILED, EXIT_INTERRUPTED, EXIT_OK
from xgv_cosim.cli.jaus_options import (
    AllowNetwork,
    JausPeers,
    JausPlace,
    JausRecord,
    jaus_options,
    print_subsystem,
)
from xgv_cosim.cli.progress import progress_of, working_on
from xgv_cosim.cli.scenario_options import BindRows, InjectionRows, KeepStep, Overrides, ScenarioName
from xgv_cosim.cli.summary import print_summary


@app.command()
def run(
    scenario: ScenarioName,
    seed: Annotated[int | None, typer.Option(help="Seed of the run; replaces the scenario's.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="New folder for the run; default runs/NAME-seedN-TIME.", show_default=False),
    ] = None,
    overrides: Overrides = None,
    bind: BindRows = None,
    inject: InjectionRows = None,
    *,
    keep_step: KeepStep = False,
    gui: Annotated[
        bool, typer.Option("--gui", help="Show it in sumo-gui, cars in the colours of their modes.")
    ] = False,
    gui_delay: Annotated[
        float | None,
        typer.Option(min=0, metavar="MS", help="Wall time of a step in the window; default: real time."),
    ] = None,
    jaus: JausPlace = None,
    jaus_peer: JausPeers = None,
    jaus_record: JausRecord = None,
    allow_network: AllowNetwork = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> int:
    """Run a scenario and write its run folder with report.html; headless, unless --gui asks for a window.

    A SUMO configuration needs no scenario file: it is run from its begin to its end (300 s if it names
    none), with the vehicles of --bind bound and the events of --inject. With --jaus it goes on in real time,
    and clients that speak JAUS can drive the vehicles.
    """
    from xgv_cosim.entry import default_folder  # noqa: PLC0415 - engines are dear to import
    from xgv_cosim.reports import write_report  # noqa: PLC0415 - likewise drawing
    from xgv_cosim.runs import RunStatus, run_scenario  # noqa: PLC0415
    from xgv_cosim.scenario.building import WindowOptions  # noqa: PLC0415
    from xgv_cosim.scenario.loading import load_scenario  # noqa: PLC0415

    chosen = [*(overrides or []), *([] if seed is None else [f"seed={seed}"])]
    loaded = load_scenario(scenario, chosen, bind=bind or (), inject=inject or (), keep_step=keep_step)
    window = WindowOptions(gui_delay) if gui else None
    folder = out if out is not None else default_folder(loaded)
    network = jaus_options(jaus, jaus_peer or (), allow_network=allow_network, record=jaus_record)
    with progress_of(loaded.name, quiet=quiet) as progress:
        result = run_scenario(
            loaded,
            folder,
            progress=progress,
            window=window,
            jaus=network,
            announce=None if quiet else print_subsystem,
        )
    with working_on("drawing report.html", quiet=quiet):
        write_report(folder)
    if not quiet:
        print_summary(result.data, folder)
    if result.status is RunStatus.INTERRUPTED:
        return EXIT_INTERRUPTED
    return EXIT_OK if result.status is RunStatus.OK else EXIT_EXPECTATION_FAILED
