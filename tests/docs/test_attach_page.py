"""``docs/attach.md`` and its example say what is true."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.test_readme_python import python_blocks
from xgv_cosim.mode_styles import LEGEND
from xgv_cosim.worlds.sumo.attached import WANTED_OPTIONS
from xgv_cosim.worlds.sumo.session import SAFETY

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "attach.md"
EXAMPLE = ROOT / "examples" / "attach_to_script.py"


@pytest.mark.parametrize("page", [PAGE, ROOT / "README.md"])
def test_the_three_lines_are_those_of_the_example(page: Path) -> None:
    lines = [line for line in python_blocks(page)[-1].splitlines() if line]
    assert len(lines) == 3
    own = EXAMPLE.read_text().splitlines()
    assert [line for line in lines if line not in own] in ([], ['plugin.bind("veh0")'])


def test_the_example_runs_in_an_empty_folder(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLE)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    told = [line.split(": ")[1].split(",")[0] for line in done.stdout.splitlines() if " s: " in line]
    assert told == ["drive_by_wire", "estop_pause", "drive_by_wire", "drive_by_wire"]
    assert 15 <= len([line for line in EXAMPLE.read_text().splitlines() if line.strip()]) <= 25


def test_the_page_lists_the_options_that_a_headless_run_sets() -> None:
    told = re.findall(r"^\| `--([\w.-]+) (\S+)` \|", PAGE.read_text(), re.MULTILINE)
    assert dict(told) == SAFETY
    assert {wanted.name: wanted.remedy for wanted in WANTED_OPTIONS} == SAFETY
    assert all(wanted.suits(wanted.remedy) for wanted in WANTED_OPTIONS)


def test_the_page_has_the_legend_of_the_window() -> None:
    told = re.findall(r"^\| [\w ]+ `(#\w{6})` \| ([\w -]+) \|", PAGE.read_text(), re.MULTILINE)
    assert told == [(style.colour, style.label) for style in LEGEND]
