"""``xgv-cosim bench``: what bound vehicles cost on this machine, against SUMO alone and against the floor."""

from __future__ import annotations

import json
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from xgv_cosim.cli.app import app

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from xgv_cosim.bench.measuring import Cost

Words = list[str] | None


@app.command()
def bench(
    network: Annotated[
        Words,
        typer.Option(help="light_freeway, busy_freeway or grid; may be repeated or a list with commas."),
    ] = None,
    coupling: Annotated[Words, typer.Option(help="free, lane or auto; likewise.")] = None,
    vehicles: Annotated[Words, typer.Option(help="How many vehicles; likewise, as 1,100,1000.")] = None,
    share: Annotated[Words, typer.Option(help="Share of them that is bound, 0 to 1; likewise.")] = None,
    extra: Annotated[
        Words,
        typer.Option(
            "--with",
            help="Switched on as well: observations, links or stacks; recording; metrics. Likewise.",
        ),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(help="World steps that are timed; default: by vehicles.")
    ] = None,
    repeat: Annotated[int, typer.Option(help="How often each drive is timed; medians count.")] = 3,
    *,
    full: Annotated[bool, typer.Option("--full", help="The whole table, 1 to 5000 vehicles.")] = False,
    steady: Annotated[
        bool, typer.Option("--steady", help="Targets stay instead of changing at each step.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    as_markdown: Annotated[bool, typer.Option("--markdown", help="Print the table as Markdown.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Measure what bound vehicles cost beside SUMO itself, in processor time.

    Every vehicle is told a new target at each world step of 0.1 s, ten control ticks. SUMO alone drives the
    same traffic; the floor repeats the SUMO calls of the bound drive without a model behind them. The three
    take turns, and medians count. Quick by default: three networks with 1, 100 and 1000 vehicles.

    Raises:
        ScenarioError: An option is wrong.
        WorldError: SUMO failed.
    """
    from xgv_cosim.bench.cases import Chosen, cases_of  # noqa: PLC0415 - engines are dear to import
    from xgv_cosim.bench.measuring import measure  # noqa: PLC0415
    from xgv_cosim.bench.table import document, markdown  # noqa: PLC0415
    from xgv_cosim.errors import ScenarioError  # noqa: PLC0415

    for name, number in (("steps", steps), ("repeat", repeat)):
        if number is not None and number < 1:
            raise ScenarioError(f"{name}: got {number}, expected 1 or more")
    if as_json and as_markdown:
        raise ScenarioError("--json and --markdown exclude each other; choose one")
    chosen = Chosen(
        network or (), coupling or (), vehicles or (), extra or (), share or (), steps or 0, steady
    )
    cases = cases_of(chosen, everything=full)
    costs: list[Cost] = []
    with _progress(len(cases), quiet=quiet) as tell:
        for case in cases:
            name = f"{case.traffic.network}, {case.coupling.value}, {case.traffic.num_vehicles} vehicles"
            costs.append(measure(case, repeat, partial(_tell, tell, len(costs), name)))
    if as_json:
        typer.echo(json.dumps(document(costs, repeat), indent=2))
    elif as_markdown:
        typer.echo(markdown(costs, repeat))
    else:
        _show(costs, repeat)


def _tell(tell: Callable[[int, str], None], done: int, name: str, what: str) -> None:
    tell(done, f"{name}: {what}")


@contextmanager
def _progress(cases: int, *, quiet: bool) -> Iterator[Callable[[int, str], None]]:
    """Yield a function to be called with (cases done, what is being done now)."""
    from rich.console import Console  # noqa: PLC0415 - slow to import
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415

    console = Console(stderr=True)
    if quiet:
        yield _say_nothing
    elif console.is_terminal:
        columns = (BarColumn(bar_width=20), TimeElapsedColumn(), TextColumn("{task.description}"))
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task("", total=cases)
            yield lambda done, what: bar.update(task, completed=done, description=what)
    else:
        told = -1

        def tell(done: int, what: str) -> None:
            nonlocal told
            if done > told:
                told = done
                typer.echo(f"{done + 1} of {cases}: {what.partition(':')[0]}", err=True)

        yield tell


def _say_nothing(_done: int, _what: str) -> None:
    return None


def _show(costs: list[Cost], repeats: int) -> None:
    from rich.console import Console  # noqa: PLC0415 - slow to import
    from rich.table import Table  # noqa: PLC0415

    from xgv_cosim.bench.table import COLUMNS, UNITS, cells, is_number, machine  # noqa: PLC0415

    console = Console()
    if not console.is_terminal:
        console = Console(width=160)
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for number, (title, unit) in enumerate(zip(COLUMNS, UNITS, strict=True)):
        table.add_column(
            f"{title}\n{unit}", justify="right" if is_number(number) else "left", overflow="fold"
        )
    for cost in costs:
        table.add_row(*cells(cost))
    console.print(table)
    found = machine()
    console.print(
        f"\n{found['processor']}, {found['cores']} cores, load average {found['load_average_1min']:g}; "
        f"processor time, medians of {repeats}",
        highlight=False,
    )
