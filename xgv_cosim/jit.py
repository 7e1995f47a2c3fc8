"""Typed doors to numba, so that numeric code stays plain Python to readers, tests and mypy."""

from __future__ import annotations

import hashlib
import logging
import platform
import tempfile
from typing import TYPE_CHECKING, TypeVar

import numba
import numpy as np
import platformdirs
from llvmlite.binding import get_host_cpu_name
from numba.core import config
from numba.extending import register_jitable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

logger = logging.getLogger(__name__)

Function = TypeVar("Function", bound="Callable[..., object]")


def inlinable(function: Function) -> Function:
    """Mark a scalar function as callable from the compiled kernel.

    Called from Python it stays the plain function: that is the oracle of the tests.
    """
    marked: Function = register_jitable(function)
    return marked


def compiled(function: Function, sources: Iterable[Path]) -> Function:
    """Return ``function`` as machine code, compiled at the first call and kept on disk.

    numba's own disk cache sees edits of the function's own file only, not of the modules it calls.
    The cache therefore lies in a folder named by ``cache_key(sources)``.

    Args:
        function: A function that numba can compile.
        sources: Every file whose code the machine code contains.
    """
    folder = platformdirs.user_cache_path("xgv-cosim") / "kernels" / cache_key(sources)
    if not _is_writable(folder):
        logger.warning("cannot write to %s: the kernel is compiled anew in every process", folder)
        uncached: Function = numba.njit(function, error_model="numpy")
        return uncached
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = str(folder)  # type: ignore[attr-defined]
    try:
        cached: Function = numba.njit(function, error_model="numpy", cache=True)
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]
    return cached


def cache_key(sources: Iterable[Path]) -> str:
    """Return a name for machine code: source files, Python, numba, numpy and processor in one hash."""
    parts = [platform.python_implementation(), platform.python_version(), numba.__version__, np.__version__]
    parts.append(str(get_host_cpu_name()))
    digest = hashlib.sha256("\n".join(parts).encode())
    for path in sorted(sources):
        content = path.read_bytes()
        digest.update(f"\n{path.name} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()[:32]


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
