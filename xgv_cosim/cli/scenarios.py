"""``xgv-cosim scenarios``: the scenarios that come with the package."""

from __future__ import annotations

import json
from typing import Annotated

import typer

import sumo_scenarios
from xgv_cosim.cli.app import app


@app.command()
def scenarios(
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON list instead.")] = False,
) -> None:
    """List the scenarios that come with the package, and how to run each."""
    rows = [
        {
            "name": info.name,
            "description": info.description,
            "command": f"xgv-cosim run {info.name}",
            "folder": str(info.folder),
        }
        for info in sumo_scenarios.list_scenarios()
    ]
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
        return
    _print_table(rows)


def _print_table(rows: list[dict[str, str]]) -> None:
    from rich.console import Console  # noqa: PLC0415 - slow to import, and not needed for --json
    from rich.table import Table  # noqa: PLC0415 - likewise

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("name", style="bold", no_wrap=True)
    table.add_column("what it shows")
    table.add_column("command", no_wrap=True, style="cyan")
    for row in rows:
        table.add_row(row["name"], row["description"], row["command"])
    Console().print(table)
