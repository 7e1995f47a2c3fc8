"""Arguments that several commands share: a scenario, and what is added to it."""

from __future__ import annotations

from typing import Annotated

import typer

ScenarioName = Annotated[
    str,
    typer.Argument(
        help="Packaged scenario (see 'xgv-cosim scenarios'), scenario file, its folder, or a SUMO .sumocfg."
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the scenario, e.g. duration_s=30."),
]
BindRows = Annotated[
    list[str] | None,
    typer.Option(
        "--bind",
        metavar="VEHICLES[,KEY=VALUE]",
        help="Bind further vehicles: share=0.25, 'xgv_*,coupling=lane', type=bus.",
    ),
]
InjectionRows = Annotated[
    list[str] | None,
    typer.Option(
        "--inject",
        metavar="'VEHICLES@WHEN KIND'",
        help="Inject further events: 'xgv_3@31.5 estop_pause duration_s=5'.",
    ),
]
KeepStep = Annotated[
    bool,
    typer.Option("--keep-step", help="Keep the step length of a .sumocfg; otherwise the step is 0.1 s."),
]
