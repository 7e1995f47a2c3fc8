"""Angles of SUMO and of the internal frame; the only place where one becomes the other.

SUMO: degrees clockwise from north, 0 to 360. Internal: radians counter-clockwise from east, -pi to pi.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn


def headings_from_sumo(angle_deg: FloatColumn) -> FloatColumn:
    """Return headings in radians counter-clockwise from east, in (-pi, pi]."""
    wrapped_deg = 180.0 - np.mod(90.0 + angle_deg, 360.0)
    return np.radians(wrapped_deg)


def angle_to_sumo(heading_rad: float) -> float:
    """Return an angle in degrees clockwise from north, in [0, 360)."""
    return math.fmod(math.fmod(90.0 - math.degrees(heading_rad), 360.0) + 360.0, 360.0)


def angles_to_sumo(heading_rad: FloatColumn) -> FloatColumn:
    """Return ``angle_to_sumo`` of a column, shape ``(n,)``."""
    angles_deg: FloatColumn = np.mod(90.0 - np.degrees(heading_rad), 360.0)
    return angles_deg
