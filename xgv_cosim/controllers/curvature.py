"""The curvature controller: from path curvature to road-wheel angle by a bicycle model (XGV-06)."""

from __future__ import annotations

import math

from xgv_cosim.controllers.limits import clipped
from xgv_cosim.jit import inlinable


@inlinable
def steer_for_curvature_rad(
    curvature_per_m: float,
    speed_mps: float,
    wheelbase_m: float,
    understeer_rad_s2_per_m: float,
    max_steer_rad: float,
) -> float:
    """Return the road-wheel angle that leads to a curvature, counter-clockwise positive, within its stops.

    ``delta = atan(kappa (L + Ku v²))``, which is ``atan(kappa L) + Ku kappa v²`` for small angles and
    the exact inverse of the steady turn of the plant for all.
    """
    effective_wheelbase_m = wheelbase_m + understeer_rad_s2_per_m * speed_mps * speed_mps
    return clipped(math.atan(curvature_per_m * effective_wheelbase_m), -max_steer_rad, max_steer_rad)
