"""README and CI say the same, and what README says exists."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from xgv_cosim.cli.app import app

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def command(name: str) -> str:
    """Return the one line that README gives under a marker."""
    found = re.search(rf"^<!-- command: {name} -->\n```sh\n(?P<line>[^\n]+)\n```$", README, re.MULTILINE)
    assert found, f"README.md gives no single line under <!-- command: {name} -->"
    return found["line"]


@pytest.mark.parametrize(
    ("name", "last"), [("run", "xgv-cosim run freeway_estop"), ("test", "python -m pytest -q")]
)
def test_each_command_does_all_the_set_up(name: str, last: str) -> None:
    steps = command(name).split(" && ")
    assert steps[0] == "python3 -m venv .venv"
    assert steps[1].startswith(".venv/bin/pip install -q -c constraints.txt -e ")
    assert steps[2] == ".venv/bin/xgv-cosim doctor --fix"
    assert steps[3:] == [f".venv/bin/{last}"]


def test_ci_reads_the_test_command_from_the_readme() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "readme_command test" in script
    extraction = script[script.index("readme_command() {") :].split("\n}\n")[0] + "\n}\n"
    done = subprocess.run(
        ["bash", "-c", f"{extraction}readme_command test"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.rstrip("\n") == command("test")


def test_ci_refuses_an_option_that_it_does_not_know() -> None:
    done = subprocess.run(
        ["bash", str(ROOT / ".ci" / "run"), "--fast"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "--slow" in done.stdout


def test_readme_lists_the_commands_that_exist() -> None:
    listed = set(re.findall(r"^\| `xgv-cosim (\w+)", README, re.MULTILINE))
    existing = {info.name or info.callback.__name__ for info in app.registered_commands if info.callback}
    existing |= {str(group.name) for group in app.registered_groups}
    assert listed == existing


def test_files_that_readme_links_exist() -> None:
    targets = re.findall(r"\]\((?!https?:|#)([^)]+)\)", README)
    assert targets
    assert [target for target in targets if not (ROOT / target.split("#")[0]).exists()] == []
