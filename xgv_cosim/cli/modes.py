"""``xgv-cosim modes``: the XGV's mode tables, computed from the rules that also drive the simulation."""

from __future__ import annotations

import json
import sys
from typing import NamedTuple

import typer

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.cli.app import app
from xgv_cosim.commands import CommandKind
from xgv_cosim.vehicles.xgv import modes as rules
from xgv_cosim.vehicles.xgv.settings import PauseSteering, XgvSettings


class Section(NamedTuple):
    """One table of the printed page."""

    title: str
    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


# What alone asks for each safety mode: words, device bits, software ready, system active.
_CAUSES = (
    ("system not active", 0, True, False),
    ("SafeStop stop relay", rules.SAFESTOP_STOP, True, True),
    ("emergency stop button", rules.ESTOP_BUTTON, True, True),
    ("emergency manual override", rules.EMERGENCY_OVERRIDE_ENGAGED, True, True),
    ("manual override", rules.MANUAL_OVERRIDE_ENGAGED, True, True),
    ("SafeStop pause relay", rules.SAFESTOP_PAUSE, True, True),
    ("door or liftgate open", rules.DOOR_OPEN, True, True),
    ("internal error", rules.ERRORS_DETECTED, True, True),
    ("steering needs initialisation", rules.STEERING_UNINITIALISED, True, True),
    ("steering initialisation awaits user", rules.STEERING_AWAITS_USER, True, True),
    ("control or ready mode is software pause", 0, False, True),
    ("none of these", 0, True, True),
)

_LIVE_COMMANDS = (
    ("motion profiles", ControlMode.MOTION_PROFILES, CommandKind.MOTION_PROFILE),
    ("wrench efforts", ControlMode.WRENCH_EFFORTS, CommandKind.WRENCH_EFFORT),
    ("none", ControlMode.MOTION_PROFILES, CommandKind.NONE),
)

_CLIENT = JausAddress(1, 2, 4, 1)
_MPD = JausAddress(1, 1, ComponentId.MOTION_PROFILE_DRIVER, 1)

# The three configurations of figure A: holders of Primitive Driver and Motion Profile Driver.
_CONFIGURATIONS = (
    ("a client", _CLIENT, "nobody", None),
    ("the Motion Profile Driver", _MPD, "a client", _CLIENT),
    ("nobody", None, "nobody", None),
)


def mode_words(mode: SafetyMode | ControlMode | ReadyMode) -> str:
    """Return a mode's name as the application note writes it."""
    words = mode.name.lower().replace("_", " ")
    return words.replace("estop", "e-stop").replace("drive by wire", "drive-by-wire")


def decision_rows() -> list[dict[str, int | bool]]:
    """Return the safety mode of each of the 4096 inputs: device word by software ready."""
    return [
        {
            "devices": devices,
            "software_ready": ready,
            "safety_mode": int(rules.resolve_safety_mode(devices, software_ready=ready)),
        }
        for ready in (False, True)
        for devices in range(rules.DEVICE_WORDS)
    ]


def sections(settings: XgvSettings) -> list[Section]:
    """Return the page: control and ready mode, safety mode, and what each mode does to each axis."""
    return [
        Section(
            "Control mode and ready mode: who controls which driver",
            ("Primitive Driver", "Motion Profile Driver", "control mode", "ready when"),
            _control_rows(settings),
        ),
        Section(
            "Safety mode: the first line that applies",
            ("cause", "safety mode", "wire code"),
            [_cause_row(*cause) for cause in _CAUSES],
        ),
        Section(
            "What each safety mode does to each axis (released: the driver's, if one is aboard)",
            ("safety mode", "live command", "speed", "steering", "partial mode"),
            _axis_rows(settings),
        ),
    ]


def _control_rows(settings: XgvSettings) -> list[tuple[str, ...]]:
    both = settings.control_mode_both_clients
    rows: list[tuple[str, ...]] = []
    for pd_words, pd_controller, mpd_words, mpd_controller in _CONFIGURATIONS:
        mode = rules.resolve_control_mode(pd_controller, mpd_controller, mpd_address=_MPD, both_clients=both)
        rows.append((pd_words, mpd_words, mode_words(mode), _ready_when(mode)))
    rows.append(("in all other cases", "", mode_words(ControlMode.SOFTWARE_PAUSE), "never"))
    return rows


def _ready_when(mode: ControlMode) -> str:
    """Return which components have to be ready, asked of the rule itself."""
    ready, standby = ComponentStatus.READY, ComponentStatus.STANDBY
    if rules.resolve_ready_mode(mode, ready, standby) is ReadyMode.READY:
        return "the Primitive Driver is ready"
    if rules.resolve_ready_mode(mode, ready, ready) is ReadyMode.READY:
        return "both drivers are ready"
    return "never"


def _cause_row(words: str, devices: int, software_ready: bool, active: bool) -> tuple[str, ...]:
    mode = rules.resolve_safety_mode(devices, software_ready=software_ready, active=active)
    code = str(int(mode)) if mode is not SafetyMode.INACTIVE else "none (silent)"
    return words, mode_words(mode), code


def _axis_rows(settings: XgvSettings) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for mode in sorted(SafetyMode, key=_precedence):
        answers = [
            (words, _axis_words(mode, control, kind, settings)) for words, control, kind in _LIVE_COMMANDS
        ]
        if len({answer for _, answer in answers}) == 1:
            answers = [("any or none", answers[0][1])]
        rows += [(mode_words(mode), words, *answer) for words, answer in answers]
    return rows


def _precedence(mode: SafetyMode) -> int:
    return max(SafetyMode) + 1 if mode is SafetyMode.INACTIVE else mode


def _axis_words(
    mode: SafetyMode, control: ControlMode, kind: CommandKind, settings: XgvSettings
) -> tuple[str, str, str]:
    """Return what happens to speed and steering, and what the partial mode changes."""
    steering_rule = settings.pause_no_command_steering
    speed, speed_if_manual = (
        rules.resolve_longitudinal(mode, control, kind, partial) for partial in (0, rules.MANUAL_SPEED)
    )
    steering, steering_if_manual = (
        rules.resolve_lateral(mode, control, kind, partial, without_command=steering_rule)
        for partial in (0, rules.MANUAL_STEERING)
    )
    speed_words = {
        Longitudinal.CLOSED_LOOP: "follows the commanded speed",
        Longitudinal.OPEN_LOOP: "throttle and brake as commanded",
        Longitudinal.CONTROLLED_STOP: (
            f"throttle 0, brakes at {settings.pause_decel_mps2:g} m/s², then holds "
            f"{settings.pause_hold_brake:.0%} brake"
        ),
        Longitudinal.FULL_BRAKE: "100% brake, held at standstill",
        Longitudinal.FREE: "released",
    }
    steering_words = {
        Lateral.CLOSED_LOOP: "follows the commanded curvature",
        Lateral.OPEN_LOOP: "angle as commanded",
        Lateral.LATCH_LAST: "keeps the angle",
        Lateral.FREE: "released",
    }
    if not rules.has_live_command(control, kind):
        steering_words[Lateral.CLOSED_LOOP] = (
            "goes straight" if steering_rule is PauseSteering.CENTRE else "keeps the curvature"
        )
    acts = speed_if_manual is not speed and steering_if_manual is not steering
    return (
        speed_words[speed],
        steering_words[steering],
        "releases the manual axis" if acts else "ignored",
    )


@app.command()
def modes(
    as_json: bool = typer.Option(False, "--json", help="Print one JSON list of all 4096 inputs."),
) -> None:
    """Show the XGV's decision table and what each mode does to each axis.

    With --json: for each word of the safety devices (Report Vehicle Mode, field 6), with and without
    "software ready" (neither control nor ready mode is software pause), the safety mode's wire code.
    """
    if as_json:
        typer.echo(json.dumps(decision_rows()))
        return
    page = sections(XgvSettings())
    if sys.stdout.isatty():
        _print_tables(page)
    else:
        _print_lines(page)


def _print_lines(page: list[Section]) -> None:
    for section in page:
        rows = [section.header, *section.rows]
        widths = [max(len(row[column]) for row in rows) for column in range(len(section.header))]
        typer.echo(section.title)
        for row in rows:
            cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
            typer.echo(f"  {'  '.join(cells).rstrip()}")
        typer.echo("")


def _print_tables(page: list[Section]) -> None:
    from rich import box  # noqa: PLC0415 - heavy to import, and only a terminal needs it
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    console = Console()
    for section in page:
        table = Table(title=section.title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
        for name in section.header:
            table.add_column(name, overflow="fold")
        for row in section.rows:
            table.add_row(*row)
        console.print(table)
