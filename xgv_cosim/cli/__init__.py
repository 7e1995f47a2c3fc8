"""The command line: ``xgv-cosim run | replay | scenarios | init | check | modes | doctor | bench | jaus``."""

from __future__ import annotations

from xgv_cosim.cli import bench as _bench  # noqa: F401 - importing a module of commands registers them
from xgv_cosim.cli import check as _check  # noqa: F401 - likewise
from xgv_cosim.cli import doctor as _doctor  # noqa: F401 - likewise
from xgv_cosim.cli import init as _init  # noqa: F401 - likewise
from xgv_cosim.cli import jaus as _jaus  # noqa: F401 - likewise
from xgv_cosim.cli import modes as _modes  # noqa: F401 - likewise
from xgv_cosim.cli import replay as _replay  # noqa: F401 - likewise
from xgv_cosim.cli import run as _run  # noqa: F401 - likewise
from xgv_cosim.cli import scenarios as _scenarios  # noqa: F401 - likewise
from xgv_cosim.cli.app import main

__all__ = ["main"]
