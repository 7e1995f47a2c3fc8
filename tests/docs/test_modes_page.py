"""``docs/modes.md`` says what the code does: its tables and diagrams are computed, and up to date."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from jaus.component import ComponentStatus
from jaus.vehicle_mode import SafetyMode
from xgv_cosim.cli.modes import mode_words
from xgv_cosim.injection import InjectionKind
from xgv_cosim.vehicles.xgv.errors import ERRORS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "modes.md"


@pytest.fixture
def generate(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Return the generator's command line, which finds its helpers beside itself."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    main: Callable[[list[str]], int] = importlib.import_module("generate").main
    return lambda *arguments: main(list(arguments))


def part(name: str) -> str:
    page = PAGE.read_text(encoding="utf-8")
    return page.split(f"<!-- generated: {name} -->")[1].split(f"<!-- end of {name} -->")[0]


def test_the_page_is_up_to_date() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "docs" / "generate.py"), "--check"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_a_changed_cell_is_found_and_made_good(
    tmp_path: Path, generate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "modes.md"
    text = PAGE.read_text(encoding="utf-8")
    wrong = text.replace(
        "| emergency stop button | e-stop disable |", "| emergency stop button | e-stop pause |"
    )
    assert wrong != text
    copy.write_text(wrong, encoding="utf-8")
    assert generate("--check", str(copy)) == 1
    assert "modes.md: 'causes' is out of date; run python docs/generate.py\n" in capsys.readouterr().err
    assert copy.read_text(encoding="utf-8") == wrong  # a check changes nothing
    assert generate(str(copy)) == 0
    assert generate("--check", str(copy)) == 0
    assert "| emergency stop button | e-stop disable |" in copy.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("<!-- end of causes -->", ""),
        ("<!-- generated: causes -->", "<!-- generated: clauses -->"),
        ("# What the XGV does", "<!-- generated: axes -->"),
    ],
)
def test_a_broken_marker_is_a_mistake(
    tmp_path: Path, generate: Callable[..., int], capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    copy = tmp_path / "modes.md"
    copy.write_text(PAGE.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    assert generate("--check", str(copy)) == 2
    assert "markers" in capsys.readouterr().err


def test_every_injection_error_and_mode_has_its_row() -> None:
    kinds = re.findall(r"^\| `(\w+)` \|", part("injections"), re.MULTILINE)
    assert kinds == [kind.value for kind in InjectionKind]
    codes = re.findall(r"^\| (\d+) \|", part("errors"), re.MULTILINE)
    assert codes == [str(code) for code in sorted(ERRORS)]
    for mode in SafetyMode:
        assert f'(["{mode_words(mode)}"])' in part("safety chain")


def test_every_key_and_kind_has_a_meaning() -> None:
    """A key or kind without words is one that nobody can use."""
    for name, meaning in (("xgv keys", 3), ("safestop keys", 3), ("bind keys", 3), ("injections", 1)):
        rows = [line.strip("| ").split(" | ") for line in part(name).strip().splitlines()[2:]]
        assert [row[0] for row in rows if not row[meaning].strip()] == []


def test_the_status_diagram_shows_every_status_and_how_each_is_entered_xgv_21() -> None:
    """Failure too, which no command leads to: from all but shutdown, which stays."""
    edges = re.findall(r"^    (\w+) --> (\w+) :", part("status diagram"), re.MULTILINE)
    names = {status.name.lower() for status in ComponentStatus}
    assert {after for _, after in edges} == names
    assert {before for before, after in edges if after == "failure"} == names - {"failure", "shutdown"}


def test_the_table_of_devices_says_who_moves_what_xgv_09_xgv_31_xgv_34_xgv_41() -> None:
    """A few cells, read from the note and not from the code."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in part("devices moved").splitlines()]
    cells = {(row[0], row[1]): row[2:] for row in rows if len(row) > 1}
    assert len(cells) == 2 + 2 * 3 + 4
    assert cells["drive-by-wire", "no"][0] == "a controller, in wrench efforts"
    assert cells["drive-by-wire", "yes"][0] == "-"
    for pause in ("software pause", "e-stop pause"):
        for human in ("no", "yes"):
            gear, engine, _, release, signals = cells[pause, human]
            assert gear == release == "-"
            assert engine.startswith("anyone; with ")
            assert signals == "anyone"
        assert cells[pause, "no"][2].startswith("anyone; with ")
        assert cells[pause, "yes"][2] == "-"
    for mode in ("manual override", "emergency manual override", "e-stop disable", "inactive"):
        assert cells[mode, "ignored"] == ["-"] * 5
