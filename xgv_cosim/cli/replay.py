"""``xgv-cosim replay``: does a recorded run come out the same again?"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from xgv_cosim.cli.app import app
from xgv_cosim.cli.exit_codes import EXIT_EXPECTATION_FAILED, EXIT_OK
from xgv_cosim.cli.progress import progress_of


@app.command()
def replay(
    folder: Annotated[Path, typer.Argument(help="A run folder made by 'xgv-cosim run'.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> int:
    """Run a run folder's scenario again; say whether it is identical, else the first step that differs."""
    from xgv_cosim.runs import replay as run_again  # noqa: PLC0415 - engines are dear to import

    with progress_of(f"replay of {folder}", quiet=as_json) as progress:
        outcome = run_again(folder, progress)
    first = outcome.difference
    if as_json:
        row = {
            "identical": outcome.identical,
            "steps": outcome.steps,
            "recorded_hash": outcome.recorded_hash,
            "replayed_hash": outcome.replayed_hash,
            "first_difference": None
            if first is None
            else {"step": first.step, "tick": first.tick, "t_s": first.t_s},
            "changed_inputs": list(outcome.changed_inputs),
            "changed_versions": {name: list(pair) for name, pair in outcome.changed_versions.items()},
        }
        typer.echo(json.dumps(row))
    elif outcome.identical:
        typer.echo(f"identical: {outcome.steps} steps, trace {outcome.recorded_hash}")
    else:
        where = (
            "the traces agree, the final hashes do not" if first is None else _where(first.step, first.t_s)
        )
        typer.echo(f"different: {where}")
        for name in outcome.changed_inputs:
            typer.echo(f"  input file changed since: {name}")
        for name, (then, now) in outcome.changed_versions.items():
            typer.echo(f"  {name} was {then}, is {now}")
    return EXIT_OK if outcome.identical else EXIT_EXPECTATION_FAILED


def _where(step: int, t_s: float) -> str:
    return f"first in step {step}, which ends at {t_s:g} s"
