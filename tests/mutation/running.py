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

from tests.mutation.mutants import Mutant, mutants_of

ROOT = Path(__file__).parents[2]
WORKER = Path(__file__).with_name("worker.py")
UNCHANGED = "(unchanged)"


def mutants_of_module(name: str) -> tuple[str, list[Mutant]]:
    """Return the path of a module and all its mutants."""
    module = importlib.import_module(name)
    enums = {key: value for key, value in vars(module).items() if isinstance(value, EnumType)}
    return str(module.__file__), mutants_of(inspect.getsource(module), enums)


def survivors(
    module: str, path: str, mutants: list[Mutant], tests: list[str], scratch: Path, *, limit_s: int = 60
) -> set[str]:
    """Return the names of the mutants that all tests pass.

    Raises:
        RuntimeError: The tests fail without any fault, or a worker failed.
    """
    unchanged = Mutant(UNCHANGED, Path(path).read_text(encoding="utf-8"))
    if UNCHANGED not in _work(module, path, [unchanged], tests, scratch, limit_s):
        raise RuntimeError(f"{tests} fail without any fault in {module}")
    shares = [mutants[start :: os.cpu_count() or 1] for start in range(os.cpu_count() or 1)]
    with ThreadPoolExecutor(len(shares)) as pool:
        parts = pool.map(lambda share: _work(module, path, share, tests, scratch, limit_s), shares)
        return set().union(*parts)


def _work(
    module: str, path: str, mutants: list[Mutant], tests: list[str], scratch: Path, limit_s: int
) -> set[str]:
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
    verdicts = dict(json.loads(line) for line in done.stdout.splitlines())
    if done.returncode or len(verdicts) != len(mutants):
        raise RuntimeError(f"the worker on {module} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return {name for name, verdict in verdicts.items() if verdict == "survived"}
