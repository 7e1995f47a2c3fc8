"""What the packages promise: names in ``__all__`` are there, and nothing of ours is reachable beside them."""

from __future__ import annotations

import importlib
import subprocess
import sys
from types import ModuleType

import pytest

PACKAGES = ["jaus", "sumo_scenarios", "xgv_cosim"]


def reachable(module: ModuleType) -> set[str]:
    """Return the public names of our own making that ``module`` offers, submodules aside."""
    names = set()
    for name in dir(module):
        value = getattr(module, name)
        origin = getattr(value, "__module__", None)
        ours = isinstance(origin, str) and origin.split(".")[0] in PACKAGES
        if not name.startswith("_") and not isinstance(value, ModuleType) and ours:
            names.add(name)
    return names


@pytest.mark.parametrize("package", PACKAGES)
def test_all_is_sorted_and_reachable(package: str) -> None:
    module = importlib.import_module(package)
    exported = list(getattr(module, "__all__", []))
    assert exported == sorted(set(exported))
    for name in exported:
        assert getattr(module, name) is not None, name


@pytest.mark.parametrize("package", PACKAGES)
def test_nothing_is_reachable_that_all_does_not_name(package: str) -> None:
    module = importlib.import_module(package)
    assert reachable(module) <= set(getattr(module, "__all__", []))


def test_dir_shows_all_before_and_after_use() -> None:
    module = importlib.import_module("xgv_cosim")
    assert set(module.__all__) <= set(dir(module))


def test_an_unknown_name_is_an_attribute_error() -> None:
    module = importlib.import_module("xgv_cosim")
    with pytest.raises(AttributeError, match="no_such_name"):
        module.no_such_name  # noqa: B018 - the access is the test


def test_star_import_in_a_fresh_process_brings_all_of_it() -> None:
    code = "import xgv_cosim; from xgv_cosim import *; assert set(xgv_cosim.__all__) <= set(globals())"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
