"""``xgv-cosim init DIR``: a folder with a starter scenario to change."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

import sumo_scenarios
from xgv_cosim.cli.app import app
from xgv_cosim.errors import RecordingError, ScenarioError

STARTER = "hello"
"""The packaged scenario that ``init`` copies."""


@app.command()
def init(folder: Annotated[Path, typer.Argument(metavar="DIR", help="New or empty folder.")]) -> None:
    """Copy a small, commented scenario into DIR, ready to run and to change."""
    if folder.exists() and not folder.is_dir():
        raise ScenarioError(f"{folder} is a file; give the name of a new or empty folder")
    try:
        if folder.exists() and any(folder.iterdir()):
            raise ScenarioError(f"{folder} is not empty; give the name of a new or empty folder")
        source = sumo_scenarios.load(STARTER)
        shutil.copytree(
            source, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__", "*.py")
        )
    except (OSError, shutil.Error) as error:
        raise RecordingError(f"{folder}: cannot be written: {error}") from error
    names = ", ".join(sorted(entry.name for entry in folder.iterdir()))
    typer.echo(f"{folder}: {names}")
    typer.echo(f"next: xgv-cosim run {folder / 'scenario.yaml'}")
