"""Progress of a run: a bar on a terminal, a line now and then without one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

PLAIN_LINES = 5
"""Lines of progress that a run prints without a terminal."""


@contextmanager
def progress_of(name: str, *, quiet: bool) -> Iterator[Callable[[float, float], None] | None]:
    """Yield a function to be called after each step with (simulated seconds, seconds in all)."""
    console = Console(stderr=True)
    if quiet:
        yield None
    elif console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task(f"{name}: opening SUMO, loading the compiled kernel", total=None)

            def show(now_s: float, duration_s: float) -> None:
                bar.update(task, description=name, completed=now_s, total=duration_s)

            yield show
    else:
        yield _plain_lines(name)


@contextmanager
def working_on(what: str, *, quiet: bool) -> Iterator[None]:
    """Say on a terminal what is being done meanwhile."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield
    else:
        with console.status(what):
            yield


def _bar(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None),
        TextColumn("{task.completed:.1f} s simulated"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
    )


def _plain_lines(name: str) -> Callable[[float, float], None]:
    shown = 0

    def show(now_s: float, duration_s: float) -> None:
        nonlocal shown
        share = int(PLAIN_LINES * now_s / duration_s + 1e-9)
        if share > shown:
            shown = share
            typer.echo(f"{name}: {now_s:g} of {duration_s:g} s simulated", err=True)

    return show
