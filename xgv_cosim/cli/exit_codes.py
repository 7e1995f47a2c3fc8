"""Exit codes of the command line."""

from __future__ import annotations

from xgv_cosim.errors import (
    FolderInUseError,
    RecordingError,
    WorldConfigurationError,
    WorldError,
    XgvCosimError,
)

EXIT_OK = 0
"""Everything as expected."""
EXIT_EXPECTATION_FAILED = 1
"""An expectation failed, or a replay differs."""
EXIT_BAD_INPUT = 2
"""Bad scenario or usage."""
EXIT_SYSTEM_ERROR = 3
"""The machine or an engine failed: disk, libraries, SUMO during the run."""
EXIT_INTERRUPTED = 130
"""Ctrl-C."""


def exit_code_of(error: XgvCosimError) -> int:
    """Return the exit code for an error that reached the command line."""
    if isinstance(error, (WorldConfigurationError, FolderInUseError)):
        return EXIT_BAD_INPUT
    return EXIT_SYSTEM_ERROR if isinstance(error, (WorldError, RecordingError)) else EXIT_BAD_INPUT
