"""xgv-cosim: SUMO vehicles bound to emulated drive-by-wire vehicles."""

from __future__ import annotations

from xgv_cosim._version import __version__

__all__ = ["__version__"]
