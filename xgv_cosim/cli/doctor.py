"""``xgv-cosim doctor``: says whether a run will work here, and what to do where it will not."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from xgv_cosim.cli.app import app
from xgv_cosim.cli.exit_codes import EXIT_OK, EXIT_SYSTEM_ERROR
from xgv_cosim.errors import WorldError

if TYPE_CHECKING:
    from xgv_cosim.cli.diagnosis import Finding


@app.command()
def doctor(
    fix: bool = typer.Option(False, "--fix", help="Get the system libraries that libsumo lacks."),
    as_json: bool = typer.Option(False, "--json", help="Print one JSON object."),
) -> int:
    """Check Python, packages, libsumo, ruckig, numba and folders; exit 0 if a run will work here, else 3.

    With --fix the system libraries that libsumo lacks are installed, as root or with a sudo that asks no
    password, else fetched into your own data folder. Then everything is checked and only problems are shown.
    """
    from xgv_cosim.cli.diagnosis import diagnose  # noqa: PLC0415 - reached only by this command

    findings = _fix() if fix else []
    findings += diagnose()
    problems = [finding for finding in findings if not finding.ok]
    if as_json:
        typer.echo(
            json.dumps({"ok": not problems, "findings": [asdict(finding) for finding in findings]}, indent=2)
        )
    else:
        _show(problems if fix else findings)
        typer.echo(
            f"{len(problems)} of {len(findings)} checks found a problem" if problems else "all checks passed"
        )
    return EXIT_SYSTEM_ERROR if problems else EXIT_OK


def _fix() -> list[Finding]:
    """Get missing system libraries; return a finding where there was something to do."""
    from xgv_cosim.cli.diagnosis import Finding  # noqa: PLC0415
    from xgv_cosim.worlds.sumo.provisioning import provide_libraries  # noqa: PLC0415

    try:
        provided = provide_libraries(lambda line: typer.echo(line, err=True))
    except WorldError as error:
        return [Finding("fix", ok=False, detail=str(error))]
    return [Finding("fix", ok=True, detail=f"got {', '.join(provided)}")] if provided else []


def _show(findings: list[Finding]) -> None:
    """Print findings: a table on a terminal, plain lines elsewhere."""
    if not findings:
        return
    if not sys.stdout.isatty():
        for finding in findings:
            remedy = f" -> {finding.remedy}" if finding.remedy else ""
            typer.echo(f"{'ok' if finding.ok else 'problem':<8}{finding.name:<18}{finding.detail}{remedy}")
        return
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("", "check", "result"):
        table.add_column(title, overflow="fold")
    for finding in findings:
        mark = Text("✓", style="green") if finding.ok else Text("✗", style="bold red")
        result = Text(finding.detail)
        if finding.remedy:
            result.append(f"\n{finding.remedy}", style="yellow")
        table.add_row(mark, finding.name, result)
    Console().print(table)
