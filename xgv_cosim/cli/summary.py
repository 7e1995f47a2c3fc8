"""The table at the end of a run: what happened to each injected vehicle, and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

STATUS_WORDS = {
    "ok": "as expected",
    "failed": "an expectation failed",
    "interrupted": "interrupted",
    "error": "error",
}


def print_summary(data: dict[str, Any], folder: Path) -> None:
    """Print a run's result: a table on a terminal, plain lines without one."""
    console = Console()
    rows = sorted(data["vehicles"].items(), key=_first_injection_s)
    injected = {name: row for name, row in rows if row["injected"]}
    if console.is_terminal:
        if injected:
            console.print(_table(injected))
    else:
        for name, row in injected.items():
            typer.echo("; ".join(f"{title}: {cell}" for title, cell in _cells(name, row)).replace("\n", ", "))
    for line in _closing_lines(data, folder):
        console.print(Text(line)) if console.is_terminal else typer.echo(line)


def _table(injected: dict[str, Any]) -> Table:
    table = Table(title="What happened to the injected vehicles", title_justify="left", show_lines=True)
    for title, _ in _cells(*next(iter(injected.items()))):
        table.add_column(title, overflow="fold")
    for name, row in injected.items():
        table.add_row(*(Text(cell) for _, cell in _cells(name, row)))
    return table


def _cells(name: str, row: dict[str, Any]) -> list[tuple[str, str]]:
    metrics = row["metrics"]
    return [
        ("vehicle", name),
        ("injected", "\n".join(_injection(injection) for injection in row["injections"])),
        ("modes and reasons", "\n".join(_modes(row))),
        ("standstill", _value(metrics.get("time_to_standstill_s"), "after {:.1f} s", "none")),
        ("stopping distance", _distance(metrics)),
        ("min TTC", _ttc(metrics)),
        ("collisions", str(metrics["collisions"])),
    ]


def _injection(injection: dict[str, Any]) -> str:
    until = "to the end" if injection["end_s"] is None else f"to {injection['end_s']:g} s"
    return f"{injection['kind']} {injection['at_s']:g} s {until}"


def _modes(row: dict[str, Any]) -> list[str]:
    """Return the safety modes from the last before the first injection on."""
    begin = row["injections"][0]["at_s"]
    changes: list[dict[str, Any]] = []
    for mode in row["modes"]:
        if not changes or mode["safety_mode"] != changes[-1]["safety_mode"]:
            changes.append(mode)
    earlier = [mode for mode in changes if mode["t_s"] < begin - 1e-9]
    shown = earlier[-1:] + [mode for mode in changes if mode["t_s"] >= begin - 1e-9]
    return [_mode(mode) for mode in shown] or ["none"]


def _first_injection_s(item: tuple[str, dict[str, Any]]) -> float:
    injections = item[1]["injections"]
    return float(injections[0]["at_s"]) if injections else 0.0


def _mode(mode: dict[str, Any]) -> str:
    """Return a mode with its reasons; drive-by-wire needs none, it is what is left."""
    told = mode["reasons"] and mode["safety_mode"] != "drive_by_wire"
    reasons = f" ({'; '.join(mode['reasons'])})" if told else ""
    return f"{mode['t_s']:.2f} s {mode['safety_mode']}{reasons}"


def _value(value: float | None, shape: str, absent: str) -> str:
    return absent if value is None else shape.format(value)


def _distance(metrics: dict[str, Any]) -> str:
    driven, ideal = metrics.get("stopping_distance_m"), metrics.get("ideal_stopping_distance_m")
    if driven is None:
        return "did not stop" if ideal is not None else "no stop demanded"
    return f"{driven:.1f} m" if ideal is None else f"{driven:.1f} m (v²/2a {ideal:.1f} m)"


def _ttc(metrics: dict[str, Any]) -> str:
    ahead = _value(metrics.get("min_ttc_s"), "{:.1f} s", "none")
    behind = _value(metrics.get("min_ttc_follower_s"), "{:.1f} s", "none")
    return f"ahead {ahead}\nbehind {behind}"


def _closing_lines(data: dict[str, Any], folder: Path) -> list[str]:
    lines = [f"warning: {line}" for line in data["warnings"]]
    lines += [f"expectation {row['status']}: {row['text']}: {row['detail']}" for row in _unmet(data)]
    factor = data["real_time_factor"]
    met = sum(row["status"] == "ok" for row in data["expectations"])
    lines.append(
        f"{data['scenario']} (seed {data['seed']}): {STATUS_WORDS[data['status']]}; "
        f"{met} of {len(data['expectations'])} expectations met; "
        f"{data['simulated_s']:g} s simulated{'' if factor is None else f', {factor:.1f} x real time'}; "
        f"{data['num_vehicles_max']} vehicles, {data['num_bound_max']} bound; "
        f"{len(data['collisions'])} collisions, {len(data['teleports'])} teleports"
    )
    lines.append(f"trace {data['trace_hash'][:16]}; run folder {folder}; report {folder / 'report.html'}")
    return lines


def _unmet(data: dict[str, Any]) -> list[dict[str, Any]]:
    return [row for row in data["expectations"] if row["status"] != "ok"]
