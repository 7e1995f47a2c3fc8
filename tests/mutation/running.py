"""Share the mutants of a module among worker processes, and collect the survivors."""

from __future__ import annotations

import importlib
import inspect
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from enum import EnumType
from pathlib import Path
from typing import NamedTuple

from tests.mutation.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
WORKER = Path(__file__).with_name("worker.py")
UNCHANGED = "(unchanged)"
MORE_TIME = 3
"""How much more time the tests of a mutant have that are tried again."""


class Finding(NamedTuple):
    """What a worker says of one mutant."""

    verdict: str
    spent_s: float
    """Processor time of its tests."""


def mutants_of_module(name: str) -> tuple[str, list[Mutant]]:
    """Return the path of a module and all its mutants."""
    module = importlib.import_module(name)
    enums = {key: value for key, value in vars(module).items() if isinstance(value, EnumType)}
    return str(module.__file__), mutants_of(inspect.getsource(module), enums)


def survivors(
    module: str,
    path: str,
    mutants: list[Mutant],
    tests: list[str],
    scratch: Path,
    *,
    limit_s: float | None = None,
) -> set[str]:
    """Return the names of the mutants that all tests pass.

    Those whose tests do not end are tried again alone, with more time; if they do not end then either, the
    fault is one that was seen.

    Args:
        module: Name of the module.
        path: Its file.
        mutants: Its mutants.
        tests: Test files, quickest first.
        scratch: A folder of the caller's.
        limit_s: Processor time that the tests of one mutant may take; None: several times what they take
            without any fault.

    Raises:
        RuntimeError: The tests fail without any fault, or a worker failed.
    """
    unchanged = Mutant(UNCHANGED, Path(path).read_text(encoding="utf-8"))
    plain = _work(module, path, [unchanged], tests, scratch, limit_s or 600.0)[UNCHANGED]
    if plain.verdict != "survived":
        raise RuntimeError(f"{tests} fail without any fault in {module}")
    limit_s = limit_s or 10.0 + MORE_TIME * plain.spent_s
    # under pytest-xdist the other workers have the other cores
    num_workers = 1 if "PYTEST_XDIST_WORKER" in os.environ else os.cpu_count() or 1
    shares = [mutants[start::num_workers] for start in range(num_workers)]
    found: dict[str, Finding] = {}
    with ThreadPoolExecutor(num_workers) as pool:
        for part in pool.map(lambda share: _work(module, path, share, tests, scratch, limit_s), shares):
            found |= part
    again = [mutant for mutant in mutants if found[mutant.name].verdict == "unended"]
    found |= _work(module, path, again, tests, scratch, MORE_TIME * limit_s)
    return {name for name, finding in found.items() if finding.verdict == "survived"}


def _work(
    module: str, path: str, mutants: list[Mutant], tests: list[str], scratch: Path, limit_s: float
) -> dict[str, Finding]:
    """Return what was found of each mutant, by name."""
    if not mutants:
        return {}
    order = {
        "module": module,
        "path": path,
        "tests": tests,
        "limit_s": limit_s,
        "mutants": {mutant.name: mutant.source for mutant in mutants},
    }
    done = subprocess.run(
        [sys.executable, str(WORKER)],
        input=json.dumps(order),
        cwd=ROOT,
        env=os.environ
        | {
            "HYPOTHESIS_STORAGE_DIRECTORY": str(scratch),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    if done.returncode or len(rows) != len(mutants):
        raise RuntimeError(f"the worker on {module} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return {name: Finding(verdict, spent_s) for name, verdict, spent_s in rows}
