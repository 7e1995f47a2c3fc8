"""The command line: ``xgv-cosim run | replay | scenarios | init | check | modes | doctor``."""

from __future__ import annotations

from xgv_cosim.cli import doctor as _doctor  # noqa: F401 - importing a module of commands registers them
from xgv_cosim.cli.app import main

__all__ = ["main"]
