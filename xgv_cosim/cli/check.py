"""``xgv-cosim check FILE``: everything that is wrong with a scenario, or one line that it is right."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from xgv_cosim.cli.app import app
from xgv_cosim.cli.exit_codes import EXIT_BAD_INPUT, EXIT_OK
from xgv_cosim.cli.scenario_options import BindRows, InjectionRows, KeepStep, Overrides
from xgv_cosim.errors import ScenarioError


@app.command()
def check(
    file: Annotated[
        str | None,
        typer.Argument(
            metavar="FILE", help="Scenario file, its folder, a packaged name, or a SUMO .sumocfg."
        ),
    ] = None,
    overrides: Overrides = None,
    bind: BindRows = None,
    inject: InjectionRows = None,
    *,
    keep_step: KeepStep = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of lines.")] = False,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON Schema of scenario files.")
    ] = False,
) -> int:
    """Check a scenario without running it: all mistakes at once, each with its line and column.

    Raises:
        ScenarioError: FILE is missing where it is needed, or cannot be found.
    """
    # pydantic and the YAML reader cost a third of a second, which the other commands need not pay.
    from xgv_cosim.scenario.files import file_problems  # noqa: PLC0415
    from xgv_cosim.scenario.loading import Additions, examine_scenario  # noqa: PLC0415
    from xgv_cosim.scenario.model import json_schema  # noqa: PLC0415
    from xgv_cosim.scenario.problems import Problem  # noqa: PLC0415

    if schema:
        typer.echo(json.dumps(json_schema(), indent=2))
        return EXIT_OK
    if file is None:
        raise ScenarioError("check needs a FILE, for example: xgv-cosim check scenario.yaml")
    name = file
    additions = Additions(tuple(overrides or ()), tuple(bind or ()), tuple(inject or ()), keep_step)
    problems: tuple[Problem, ...] = ()
    try:
        examination = examine_scenario(file, additions)
    except ScenarioError as error:
        if not as_json:
            raise
        problems = (Problem(str(error)),)
    else:
        name, problems = examination.name, examination.problems
        if examination.scenario is not None:
            problems += file_problems(examination.scenario)
    if as_json:
        rows = [problem.as_row() for problem in problems]
        typer.echo(json.dumps({"file": name, "valid": not problems, "problems": rows}, indent=2))
    elif problems:
        for problem in problems:
            typer.echo(str(problem), err=True)
        count = len(problems)
        typer.echo(f"{name}: {count} problem{'s' if count > 1 else ''}", err=True)
    else:
        typer.echo(f"{name}: ok")
    return EXIT_BAD_INPUT if problems else EXIT_OK
