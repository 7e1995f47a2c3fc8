"""One colour per safety mode, in every picture and window, told apart by colour-blind readers too.

Hues follow the Okabe-Ito set; the modes also differ in lightness. Pictures name the mode in words beside its
colour, so that colour never carries a meaning alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ModeStyle:
    """How a safety mode looks and what it is called."""

    label: str
    colour: str
    ink: str
    """Colour of text on top of it."""

    @property
    def rgb(self) -> tuple[int, int, int]:
        """Return red, green and blue, each 0 to 255."""
        red, green, blue = bytes.fromhex(self.colour.removeprefix("#"))
        return red, green, blue


DRIVE_BY_WIRE: Final = ModeStyle("drive-by-wire", "#2f7fbf", "#ffffff")
SOFTWARE_PAUSE: Final = ModeStyle("software pause", "#f0c03f", "#1d2530")
ESTOP_PAUSE: Final = ModeStyle("e-stop pause", "#d9650f", "#ffffff")
MANUAL_OVERRIDE: Final = ModeStyle("manual override", "#c98bb9", "#1d2530")
EMERGENCY_OVERRIDE: Final = ModeStyle("emergency manual override", "#6b3d8f", "#ffffff")
ESTOP_DISABLE: Final = ModeStyle("e-stop disable", "#6e0f1f", "#ffffff")
UNKNOWN: Final = ModeStyle("not reported", "#a4abb5", "#1d2530")

LEGEND: Final = (
    DRIVE_BY_WIRE,
    SOFTWARE_PAUSE,
    ESTOP_PAUSE,
    MANUAL_OVERRIDE,
    EMERGENCY_OVERRIDE,
    ESTOP_DISABLE,
    UNKNOWN,
)
"""Every mode, in rising precedence."""

_WORDS: Final = (
    (("disable",), ESTOP_DISABLE),
    (("emergency",), EMERGENCY_OVERRIDE),
    (("override",), MANUAL_OVERRIDE),
    (("software", "pause"), SOFTWARE_PAUSE),
    (("stop", "pause"), ESTOP_PAUSE),
    (("stop",), ESTOP_DISABLE),
    (("drive",), DRIVE_BY_WIRE),
    (("pause",), SOFTWARE_PAUSE),
)
"""The first row of which every word stands in the mode's name gives its style."""


def mode_style(name: str) -> ModeStyle:
    """Return the style of a safety mode by the profile's name for it, grey for a name without a style."""
    words = name.lower()
    for needed, style in _WORDS:
        if all(word in words for word in needed):
            return style
    return ModeStyle(plain(name) or UNKNOWN.label, UNKNOWN.colour, UNKNOWN.ink)


def plain(name: str) -> str:
    """Return an identifier as words: ``motion_profiles`` becomes ``motion profiles``."""
    return name.replace("_", " ").strip()
