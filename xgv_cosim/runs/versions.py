"""Versions of what a run depends on, for its result and its lock file."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

from xgv_cosim._version import __version__

RECORDED_PACKAGES = ("libsumo", "ruckig", "numba", "numpy", "pyarrow")
"""Packages whose version may change a run."""


def recorded_versions() -> dict[str, str]:
    """Return the versions of this package, Python and the engines, and the processor's kind."""
    found = {"xgv-cosim": __version__, "python": platform.python_version(), "machine": platform.machine()}
    for name in RECORDED_PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed as a package"
    return found
