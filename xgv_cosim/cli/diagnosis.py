"""What ``xgv-cosim doctor`` looks at: each check does the thing itself, in little.

A check never raises for what it looks at: a problem is a result, with its remedy.
"""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from xgv_cosim.errors import XgvCosimError
from xgv_cosim.worlds.sumo.libraries import SYSTEM_LIBRARIES, missing_libraries, remedy_for

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

DISTRIBUTION = "xgv-cosim"
OLDEST_PYTHON = (3, 11)
NEWEST_PYTHON = (3, 13)
REINSTALL = "Install xgv-cosim again with its dependencies, in an environment of its own (see README)."

_REQUIREMENT_NAME = re.compile(r"[A-Za-z0-9._-]+")
_SELFTEST_DEADLINE_S = 60.0


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check."""

    name: str
    ok: bool
    detail: str
    """What is there, or what is wrong."""
    remedy: str = ""
    """What to do about a problem; empty when all is well."""


def diagnose() -> Iterator[Finding]:
    """Check everything a run needs, cheap things first, and yield each finding as soon as it is known."""
    yield check_python(sys.version_info[:3])
    yield from check_packages(core_packages())
    libraries = check_system_libraries()
    yield libraries
    if libraries.ok:
        yield check_sumo()
    yield check_call("ruckig plans", _plan)
    yield check_call("numba compiles", _compile)
    yield check_writable("working folder", Path.cwd())
    yield check_writable("cache folder", platformdirs.user_cache_path(DISTRIBUTION))


def check_python(version: tuple[int, ...]) -> Finding:
    """Return whether this Python is one that the project supports."""
    shown = ".".join(map(str, version))
    if OLDEST_PYTHON <= version[:2] <= NEWEST_PYTHON:
        return Finding("python", ok=True, detail=shown)
    wanted = f"{'.'.join(map(str, OLDEST_PYTHON))} to {'.'.join(map(str, NEWEST_PYTHON))}"
    return Finding("python", ok=False, detail=shown, remedy=f"Use Python {wanted}.")


def core_packages() -> tuple[str, ...]:
    """Return the names of the packages that the installed xgv-cosim requires, extras aside."""
    required = importlib.metadata.requires(DISTRIBUTION) or []
    found = (_REQUIREMENT_NAME.match(line) for line in required if "extra ==" not in line)
    return tuple(match.group() for match in found if match)


def check_packages(names: tuple[str, ...]) -> Iterator[Finding]:
    """Yield the version of each package, or that it is not installed."""
    for name in names:
        try:
            yield Finding(name, ok=True, detail=importlib.metadata.version(name))
        except importlib.metadata.PackageNotFoundError:
            yield Finding(name, ok=False, detail="not installed", remedy=REINSTALL)


def check_system_libraries() -> Finding:
    """Return whether the system libraries that libsumo links can be loaded."""
    missing = missing_libraries()
    if missing:
        return Finding("system libraries", False, f"missing: {', '.join(missing)}", remedy_for(missing))
    return Finding("system libraries", ok=True, detail=", ".join(SYSTEM_LIBRARIES))


def check_sumo() -> Finding:
    """Return whether libsumo drives a vehicle; in a process of its own, which may crash."""
    command = [sys.executable, "-m", "xgv_cosim.worlds.sumo.selftest"]
    try:
        done = subprocess.run(  # noqa: S603 - our own module in this interpreter
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_SELFTEST_DEADLINE_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Finding("libsumo drives", False, f"no answer within {_SELFTEST_DEADLINE_S:.0f} s", REINSTALL)
    if done.returncode == 0:
        return Finding("libsumo drives", ok=True, detail=done.stdout.strip())
    last_words = "; ".join(done.stderr.strip().splitlines()[-3:])
    return Finding("libsumo drives", False, last_words or f"ended with code {done.returncode}", REINSTALL)


def check_call(name: str, call: Callable[[], str]) -> Finding:
    """Return the finding of a check that returns its detail or raises an error of this package."""
    try:
        return Finding(name, ok=True, detail=call())
    except (XgvCosimError, ImportError) as error:
        return Finding(name, False, str(error), REINSTALL)


def check_writable(name: str, folder: Path) -> Finding:
    """Return whether a file can be written in a folder, which is made if it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"xgv-cosim")
            probe.flush()
    except OSError as error:
        reason = f"cannot write in {folder}: {error.strerror or error}"
        return Finding(name, False, reason, f"Make {folder} writable, or free space there.")
    return Finding(name, ok=True, detail=str(folder))


def _plan() -> str:
    from xgv_cosim.controllers.selftest import plan_speed_gain  # noqa: PLC0415 - loads ruckig

    return plan_speed_gain()


def _compile() -> str:
    from xgv_cosim.kernel import warm_up  # noqa: PLC0415 - loads numba

    warm_up()
    return "the kernel"
