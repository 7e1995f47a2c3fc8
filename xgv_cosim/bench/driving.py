"""The commands of a measured fleet: every car follows what the same car did under SUMO's own driver."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, FloatMatrix
    from xgv_cosim.fleet import Motion

_LOOK_AHEAD_STEPS = 6
_LOOK_AHEAD_M = 6.0
_CATCH_UP_PER_S = 0.4


class Recording(NamedTuple):
    """Where SUMO's own drivers were; every matrix has shape ``(steps, n)``, frame east-north-up."""

    ids: tuple[str, ...]
    front_x_m: FloatMatrix
    front_y_m: FloatMatrix
    speed_mps: FloatMatrix


def targets(
    recording: Recording, step: int, motion: Motion, reach_m: FloatColumn
) -> tuple[FloatColumn, FloatColumn]:
    """Return commanded speed and curvature towards the recording: pursuit of a point ahead on its way.

    Args:
        recording: What SUMO's drivers did.
        step: The step that is about to be made.
        motion: State of the same vehicles, in the order of the recording.
        reach_m: From rear axle to front bumper.
    """
    last = len(recording.speed_mps) - 1
    here, then = min(step, last), min(step + 1, last)
    cosine, sine = np.cos(motion.heading_rad), np.sin(motion.heading_rad)
    front_x_m, front_y_m = motion.x_m + reach_m * cosine, motion.y_m + reach_m * sine
    behind_m = (recording.front_x_m[here] - front_x_m) * cosine + (
        recording.front_y_m[here] - front_y_m
    ) * sine
    speed_mps = recording.speed_mps[then] + _CATCH_UP_PER_S * behind_m
    goal = np.minimum(step + _LOOK_AHEAD_STEPS, last)
    east_m, north_m = recording.front_x_m[goal] - motion.x_m, recording.front_y_m[goal] - motion.y_m
    ahead_m, left_m = east_m * cosine + north_m * sine, north_m * cosine - east_m * sine
    distance_m = np.hypot(ahead_m, left_m)
    pursues = ahead_m > _LOOK_AHEAD_M
    curvature = np.where(pursues, 2.0 * left_m / np.where(pursues, distance_m * distance_m, 1.0), 0.0)
    return np.clip(speed_mps, 0.0, None), np.clip(curvature, -0.2, 0.2)
