"""``xgv-cosim modes`` as a person and as a program read it."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.cli.app import app
from xgv_cosim.cli.modes import sections
from xgv_cosim.vehicles.xgv.settings import PauseSteering, XgvSettings


def output_of(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["modes", *arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_json_is_one_list_of_4096_and_nothing_else() -> None:
    rows = json.loads(output_of("--json"))
    assert len(rows) == 4096
    assert {(row["devices"], row["software_ready"]) for row in rows} == {
        (devices, ready) for devices in range(2048) for ready in (False, True)
    }
    assert all(set(row) == {"devices", "software_ready", "safety_mode"} for row in rows)
    assert {row["safety_mode"] for row in rows} == {1, 2, 8, 9, 10, 11}
    by_input = {(row["devices"], row["software_ready"]): row["safety_mode"] for row in rows}
    assert by_input[16, True] == 1
    assert by_input[16, False] == 2
    assert by_input[1 | 4, True] == 11


def test_plain_page_names_every_mode_without_terminal_codes() -> None:
    page = output_of()
    assert "\x1b" not in page
    for words in ("drive-by-wire", "software pause", "e-stop pause", "manual override", "e-stop disable"):
        assert words in page
    assert "brakes at 2.5 m/s², then holds 50% brake" in page
    assert "100% brake, held at standstill" in page


def rows_of(settings: XgvSettings, title: str) -> list[tuple[str, ...]]:
    return next(section.rows for section in sections(settings) if section.title.startswith(title))


def test_causes_stand_in_order_of_precedence() -> None:
    codes = [row[2] for row in rows_of(XgvSettings(), "Safety mode")]
    assert codes[0] == "none (silent)"
    numbers = [int(code) for code in codes[1:]]
    assert numbers == sorted(numbers, reverse=True)


def test_axis_table_has_every_mode_and_says_where_partial_mode_acts() -> None:
    rows = rows_of(XgvSettings(), "What each safety mode")
    assert len({row[0] for row in rows}) == len(SafetyMode)
    acting = {row[0] for row in rows if row[4] != "ignored"}
    assert acting == {"drive-by-wire", "software pause", "e-stop pause"}


def test_axis_table_follows_the_settings() -> None:
    rows = rows_of(
        XgvSettings(pause_decel_mps2=3.5, pause_no_command_steering=PauseSteering.CENTRE), "What each"
    )
    paused = next(row for row in rows if row[:2] == ("software pause", "none"))
    assert "3.5 m/s²" in paused[2]
    assert paused[3] == "goes straight"
