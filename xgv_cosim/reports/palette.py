"""The colours of pictures; those of the modes are shared with the window (``mode_styles``)."""

from __future__ import annotations

from typing import Final

from xgv_cosim.mode_styles import (
    DRIVE_BY_WIRE,
    EMERGENCY_OVERRIDE,
    ESTOP_DISABLE,
    ESTOP_PAUSE,
    LEGEND,
    MANUAL_OVERRIDE,
    SOFTWARE_PAUSE,
    UNKNOWN,
    ModeStyle,
    mode_style,
    plain,
)

__all__ = [
    "BRAKE",
    "COMMANDED",
    "DRIVE_BY_WIRE",
    "EMERGENCY_OVERRIDE",
    "ESTOP_DISABLE",
    "ESTOP_PAUSE",
    "EVENT",
    "GRID",
    "INK",
    "LEGEND",
    "MANUAL_OVERRIDE",
    "MEASURED",
    "PANEL",
    "QUIET",
    "REFERENCE",
    "SOFTWARE_PAUSE",
    "THROTTLE",
    "UNKNOWN",
    "ModeStyle",
    "mode_style",
    "plain",
]

INK: Final = "#1d2530"
QUIET: Final = "#667080"
GRID: Final = "#dde2e8"
PANEL: Final = "#f4f6f8"
COMMANDED: Final = "#b06f00"
REFERENCE: Final = "#35b0e6"
MEASURED: Final = "#1d2530"
THROTTLE: Final = "#2f7fbf"
BRAKE: Final = "#b3400b"
EVENT: Final = "#f3d9c4"
