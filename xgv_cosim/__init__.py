"""xgv-cosim: SUMO vehicles bound to emulated drive-by-wire vehicles.

``simulate`` opens a scenario to be stepped, ``run`` makes a whole run with its folder, ``attach`` takes part
in a script that runs SUMO itself. Importing this package loads no engine; the first use of a name does.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from xgv_cosim._version import __version__
from xgv_cosim.errors import (
    CommandError,
    FolderInUseError,
    MissingLibraryError,
    RecordingError,
    ReplayError,
    ScenarioError,
    UnknownVehicleError,
    WorldConfigurationError,
    WorldError,
    XgvCosimError,
)

if TYPE_CHECKING:
    from xgv_cosim.entry import run, simulate
    from xgv_cosim.plugin import Plugin
    from xgv_cosim.script_warnings import SumoOptionsWarning
    from xgv_cosim.simulation import Simulation, VehicleHandle
    from xgv_cosim.step_listener import attach

__all__ = [
    "CommandError",
    "FolderInUseError",
    "MissingLibraryError",
    "Plugin",
    "RecordingError",
    "ReplayError",
    "ScenarioError",
    "Simulation",
    "SumoOptionsWarning",
    "UnknownVehicleError",
    "VehicleHandle",
    "WorldConfigurationError",
    "WorldError",
    "XgvCosimError",
    "__version__",
    "attach",
    "run",
    "simulate",
]

_LAZY = {
    "Plugin": "xgv_cosim.plugin",
    "Simulation": "xgv_cosim.simulation",
    "SumoOptionsWarning": "xgv_cosim.script_warnings",
    "VehicleHandle": "xgv_cosim.simulation",
    "attach": "xgv_cosim.step_listener",
    "run": "xgv_cosim.entry",
    "simulate": "xgv_cosim.entry",
}


def __getattr__(name: str) -> object:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
