"""``import xgv_cosim`` loads no engine: it stays quick, and works where an engine does not."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = [
    "highway_env",
    "libsumo",
    "matplotlib",
    "numba",
    "numpy",
    "pyarrow",
    "pydantic",
    "rich",
    "ruckig",
    "zenoh",
]


def loaded_by(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has loaded after ``statement``."""
    code = f"{statement}; import sys; print(' '.join({{name.split('.')[0] for name in sys.modules}}))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


@pytest.mark.parametrize("package", ["jaus", "sumo_scenarios", "xgv_cosim"])
def test_importing_a_package_loads_nothing_heavy(package: str) -> None:
    assert package in (loaded := loaded_by(f"import {package}"))
    assert loaded.isdisjoint(HEAVY)


def test_the_command_line_starts_without_an_engine() -> None:
    """Only what shows text and the tables of modes is loaded: a mistake in usage answers at once."""
    loaded = loaded_by("import xgv_cosim.cli")
    assert "typer" in loaded
    assert loaded.isdisjoint(set(HEAVY) - {"numpy", "pydantic", "rich"})
