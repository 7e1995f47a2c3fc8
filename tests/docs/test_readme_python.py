"""The README's Python lines are the example, and the example runs as pasted."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def python_blocks(page: Path) -> list[str]:
    """Return the Python code that a page shows."""
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


def test_the_readme_shows_the_example() -> None:
    shown, _ = python_blocks(ROOT / "README.md")
    example = (ROOT / "examples" / "fifteen_lines.py").read_text().split('"""\n\n', 1)[1]
    assert shown == example
    assert len([line for line in example.splitlines() if line.strip()]) <= 15


def test_the_example_runs_in_an_empty_folder(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "examples" / "fifteen_lines.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    paused, resumed, whole = done.stdout.splitlines()
    assert "estop_pause because of ('SafeStop pause relay'" in paused
    assert "drive_by_wire" in resumed
    assert whole.startswith("ok ")
    assert (tmp_path / "runs" / "mine" / "report.html").is_file()
