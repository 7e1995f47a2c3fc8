"""The commands of a measured fleet: every car follows what the same car did under SUMO's own driver."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, FloatMatrix, IntColumn

REACTION_S = 0.25
"""From a new target until the wheels and the yaw follow it: the car is steered where it will be then."""
PULL_M = 4.0
"""Way in which a car that is beside its way comes back to it, at low speed."""
PULL_S = 1.7
"""And time, at high speed."""
CATCH_UP_PER_S = 0.5
LONGEST_LAG_M = 8.0
"""A car that is further behind catches up no faster for it."""
MAX_ANGLE_RAD = 0.75
MAX_CURVATURE_PER_M = 0.23
_HALF_CHORD_M = 0.75
"""The direction of a way is that of a chord, so that the steps of the recording make no corners."""
_STANDS_M = 1e-3


class Recording(NamedTuple):
    """Where SUMO's own drivers were; every matrix has shape ``(steps, n)``, frame east-north-up."""

    ids: tuple[str, ...]
    front_x_m: FloatMatrix
    front_y_m: FloatMatrix
    heading_rad: FloatMatrix
    speed_mps: FloatMatrix

    def of(self, chosen: IntColumn) -> Recording:
        """Return the recording of some of the vehicles."""
        ids = tuple(self.ids[index] for index in chosen.tolist())
        return Recording(ids, *(matrix[:, chosen] for matrix in self[1:]))


class CarMotion(NamedTuple):
    """How the cars move; each column of shape ``(n,)``, reference point at the rear axle."""

    x_m: FloatColumn
    y_m: FloatColumn
    heading_rad: FloatColumn
    speed_mps: FloatColumn
    curvature_per_m: FloatColumn


class Targets(NamedTuple):
    """What the cars are told, each column of shape ``(n,)``."""

    speed_mps: FloatColumn
    curvature_per_m: FloatColumn


@dataclass(slots=True)
class Pursuit:
    """Keeps the front bumper of each car on the way that the recorded one has drawn, and in its time.

    The front bumper of a car that rolls on its rear axle moves at the angle ``atan(curvature * reach)`` to
    the car. So this angle is chosen: the way's direction where the car will be when it reacts, plus a pull
    towards the way.

    Args:
        recording: What SUMO's drivers did.
        reach_m: From rear axle to front bumper, shape ``(n,)``.
    """

    recording: Recording
    reach_m: FloatColumn
    way_m: FloatMatrix = field(init=False)
    """Distance that the recorded cars have driven, shape ``(steps, n)``."""
    driven_m: FloatColumn = field(init=False)
    """Where on its way each car is."""
    beside_m: FloatColumn = field(init=False)
    """How far left of its way each car is."""

    def __post_init__(self) -> None:
        x_m, y_m = self.recording.front_x_m, self.recording.front_y_m
        steps_m = np.hypot(np.diff(x_m, axis=0), np.diff(y_m, axis=0))
        self.way_m = np.vstack([np.zeros(x_m.shape[1]), np.cumsum(steps_m, axis=0)])
        self.driven_m, self.beside_m = np.zeros(x_m.shape[1]), np.zeros(x_m.shape[1])

    def targets(self, step: int, motion: CarMotion) -> Targets:
        """Return what to tell the cars before a step.

        Args:
            step: The step that is about to be made, counted from the beginning of the recording.
            motion: State of the same vehicles, in the order of the recording.
        """
        self._find(motion)
        last = len(self.way_m) - 1
        here, then = min(step, last), min(step + 1, last)
        behind_m = np.clip(self.way_m[here] - self.driven_m, -LONGEST_LAG_M, LONGEST_LAG_M)
        speed_mps = np.clip(self.recording.speed_mps[then] + CATCH_UP_PER_S * behind_m, 0.0, None)
        ahead_m = np.maximum(motion.speed_mps, 0.0) * REACTION_S
        turns_rad = motion.curvature_per_m * ahead_m
        pull_rad = np.arctan(self.beside_m / np.maximum(PULL_M, PULL_S * motion.speed_mps))
        angle_rad = _between(
            self._direction(self.driven_m + ahead_m) - pull_rad - motion.heading_rad - turns_rad
        )
        angle_rad = np.clip(angle_rad, -MAX_ANGLE_RAD, MAX_ANGLE_RAD)
        curvature_per_m = np.clip(np.tan(angle_rad) / self.reach_m, -MAX_CURVATURE_PER_M, MAX_CURVATURE_PER_M)
        return Targets(speed_mps, curvature_per_m)

    def _find(self, motion: CarMotion) -> None:
        """Find the cars on their ways; they go on only."""
        front_x_m = motion.x_m + self.reach_m * np.cos(motion.heading_rad)
        front_y_m = motion.y_m + self.reach_m * np.sin(motion.heading_rad)
        for _ in range(3):
            x_m, y_m = self._point(self.driven_m)
            direction_rad = self._direction(self.driven_m)
            cosine, sine = np.cos(direction_rad), np.sin(direction_rad)
            east_m, north_m = front_x_m - x_m, front_y_m - y_m
            self.driven_m = np.maximum(self.driven_m, self.driven_m + east_m * cosine + north_m * sine)
            self.beside_m = north_m * cosine - east_m * sine

    def _direction(self, at_m: FloatColumn) -> FloatColumn:
        """Return which way the recorded cars went there; at a standstill, where they pointed."""
        behind_x_m, behind_y_m = self._point(at_m - _HALF_CHORD_M)
        ahead_x_m, ahead_y_m = self._point(at_m + _HALF_CHORD_M)
        return np.arctan2(ahead_y_m - behind_y_m, ahead_x_m - behind_x_m)

    def _point(self, at_m: FloatColumn) -> tuple[FloatColumn, FloatColumn]:
        """Return the points of the ways at some distance; before and behind them, straight on."""
        columns = np.arange(at_m.size)
        last = len(self.way_m) - 1
        lower = np.clip((self.way_m <= at_m).sum(axis=0) - 1, 0, last)
        upper = np.minimum(lower + 1, last)
        begin_m, end_m = self.way_m[lower, columns], self.way_m[upper, columns]
        length_m = end_m - begin_m
        moves = length_m > _STANDS_M
        share = np.where(moves, (at_m - begin_m) / np.where(moves, length_m, 1.0), 0.0)
        beyond_m = np.where(moves & (at_m >= 0.0), 0.0, at_m - begin_m)
        share = np.where(at_m >= 0.0, share, 0.0)
        heading_rad = self.recording.heading_rad[lower, columns]
        x_m, y_m = self.recording.front_x_m, self.recording.front_y_m
        return (
            x_m[lower, columns] * (1.0 - share)
            + x_m[upper, columns] * share
            + beyond_m * np.cos(heading_rad),
            y_m[lower, columns] * (1.0 - share)
            + y_m[upper, columns] * share
            + beyond_m * np.sin(heading_rad),
        )


def _between(angle_rad: FloatColumn) -> FloatColumn:
    """Return the same angle within half a turn."""
    return np.remainder(angle_rad + np.pi, 2.0 * np.pi) - np.pi
