"""Run tests against mutants of one module; one forked process per mutant, nothing written to the checkout.

Reads one JSON object from standard input::

    {"module": "jaus.component", "path": ".../component.py", "tests": ["tests/jaus"], "limit_s": 60,
     "mutants": {"name": "source"}}

and writes one JSON line per mutant: its name, ``killed``, ``survived`` or ``unended``, and the processor time
that its tests took. Unended are tests that took more than ``limit_s`` of processor time, which other work on
the machine does not shorten, or fell asleep. The libraries are imported once, before the first fork; the
project's own modules anew in each process, with the mutant in its place.
"""

from __future__ import annotations

import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import resource
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import hypothesis
import hypothesis.stateful
import numba  # noqa: F401 - imported here, so that no mutant's process has to; likewise below
import numpy as np  # noqa: F401 - loaded before the fork, for every mutant
import pytest
import ruckig  # noqa: F401 - loaded before the fork, for every mutant

OPTIONS = (
    *("-x", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider"),
    *("-o", "addopts=", "--import-mode=importlib"),
    "--assert=plain",  # nobody reads why a test failed, and rewriting assertions takes time
)
BROKEN = 70
"""Exit code of a process in which pytest itself did not come to an end."""
LONGEST_SLEEP = 30
"""Wall time for each second of processor time, after which a process is taken to be asleep for good."""
KILLED = {pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.INTERRUPTED}
"""A failed test, or a module that can no longer be imported."""


class InPlaceOf(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module another source."""

    def __init__(self, module: str, path: str, source: str) -> None:
        self._module, self._path, self._source = module, path, source

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if fullname != self._module:
            return None
        return importlib.util.spec_from_loader(fullname, self, origin=self._path)

    def exec_module(self, module: ModuleType) -> None:
        exec(compile(self._source, self._path, "exec"), module.__dict__)


def verdict_on(module: str, path: str, source: str, tests: list[str], limit_s: float) -> str:
    """Run the tests in a process of its own.

    Raises:
        RuntimeError: pytest found no test, or could not run at all.
    """
    child = os.fork()
    if child == 0:
        try:
            signal.setitimer(signal.ITIMER_PROF, limit_s)  # an endless loop ends by its signal
            signal.setitimer(signal.ITIMER_REAL, LONGEST_SLEEP * limit_s)
            with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
                os.dup2(nowhere.fileno(), 1)
                os.dup2(nowhere.fileno(), 2)
            sys.meta_path.insert(0, InPlaceOf(module, path, source))
            os._exit(pytest.main([*OPTIONS, *tests]))
        finally:
            os._exit(BROKEN)  # never back into the loop of the parent
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) in {signal.SIGPROF, signal.SIGALRM}:
        return "unended"
    code = os.waitstatus_to_exitcode(status)
    if code == pytest.ExitCode.OK:
        return "survived"
    if code in KILLED:
        return "killed"
    raise RuntimeError(f"the tests of {module} could not run: pytest left with {code}")


def main() -> None:
    """Take the order from standard input and answer line by line."""
    order = json.load(sys.stdin)
    loaded = [name for name in sys.modules if name.split(".")[0] == order["module"].split(".")[0]]
    if loaded:
        raise RuntimeError(f"{loaded} must not be imported before the mutants are")
    # Shrinking a counter-example costs much and changes no verdict; the same examples for every mutant.
    hypothesis.settings.register_profile(
        "mutants",
        derandomize=True,
        database=None,
        deadline=None,
        phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate),
    )
    hypothesis.settings.load_profile("mutants")
    for name, source in order["mutants"].items():
        before_s = _children_s()
        verdict = verdict_on(order["module"], order["path"], source, order["tests"], order["limit_s"])
        print(json.dumps([name, verdict, _children_s() - before_s]), flush=True)  # noqa: T201 - the answer


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
