"""The command line: ``xgv-cosim run | replay | scenarios | init | check | modes | doctor``."""

from __future__ import annotations

from xgv_cosim.cli.app import main

__all__ = ["main"]
