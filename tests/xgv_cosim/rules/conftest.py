from __future__ import annotations

from tests.xgv_cosim.simulation.conftest import open_hello

__all__ = ["open_hello"]
