"""Reference generation by ruckig: how far each profile has come at the end of a step.

ruckig advances a whole batch in one call, and refuses the whole batch for one bad number. So the
fleet is cut into shards; each number is checked and clipped before the call; a trajectory is kept and
only read as long as nothing about it changes; and a shard that ruckig still refuses advances by the
closed form (``controllers.profile``), which gives the same motion. A vehicle whose command or
reference is unusable is held and reported, and no other vehicle is touched by that.
"""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from ruckig import ControlInterface, InputParameter, Ruckig, RuckigError, Synchronization, Trajectory

from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.columns import BoolColumn, FloatColumn, FloatMatrix
from xgv_cosim.controllers.limits import (
    FALLBACK_STOP_DECEL_MPS2,
    MAX_ACCEL_MPS2,
    MAX_CURVATURE_PER_M,
    MAX_CURVATURE_RATE_PER_M_S,
    MAX_JERK,
    MAX_SPEED_MPS,
    MAX_STATE_ACCEL_MPS2,
    MAX_STATE_CURVATURE_PER_M,
    MAX_STATE_CURVATURE_RATE_PER_M_S,
    MAX_STATE_SPEED_MPS,
    MIN_ACCEL_MPS2,
    MIN_CURVATURE_RATE_PER_M_S,
    MIN_JERK,
)
from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile
from xgv_cosim.fleet import Motion, Reference, Setpoints

logger = logging.getLogger(__name__)

SLOTS_PER_SHARD = 128
STRAYED_MPS = 2.0
"""Distance of speed and reference at which the reference waits for the car (no grip, no power)."""


class _Profiles(NamedTuple):
    """Checked profiles of both axes; every array has shape ``(2, num_slots)``, row 0 speed, row 1 curvature."""

    value: FloatMatrix
    rate: FloatMatrix
    target: FloatMatrix
    rise_limit: FloatMatrix
    fall_limit: FloatMatrix
    jerk: FloatMatrix


@dataclass(slots=True)
class _Shard:
    """The present trajectory of some consecutive slots."""

    slots: slice
    otg: Ruckig
    given: InputParameter
    trajectory: Trajectory
    elapsed_s: float = 0.0
    is_valid: bool = False


def profile_axes(setpoints: Setpoints) -> tuple[BoolColumn, BoolColumn]:
    """Return which slots follow a profile in speed, and which in curvature."""
    stops = setpoints.longitudinal == Longitudinal.CONTROLLED_STOP
    return (
        setpoints.longitudinal == Longitudinal.CLOSED_LOOP
    ) | stops, setpoints.lateral == Lateral.CLOSED_LOOP


def merge_references(
    generated: Reference, followed: Reference, setpoints: Setpoints, motion: Motion
) -> Reference:
    """Return ruckig's reference where an axis follows a profile, and the kernel's elsewhere.

    Where the car cannot keep up, because grip or power lack, the speed reference waits within
    ``STRAYED_MPS`` of it, so that a later, lower command acts at once.

    Args:
        generated: From ``ReferenceGenerator.advance`` over the step.
        followed: From ``kernel.advance`` over the same step.
        setpoints: Those of the step.
        motion: At the end of the step.
    """
    speed_axis, curvature_axis = profile_axes(setpoints)
    near = np.clip(generated.speed_mps, motion.speed_mps - STRAYED_MPS, motion.speed_mps + STRAYED_MPS)
    return Reference(
        np.where(speed_axis, near, followed.speed_mps),
        np.where(speed_axis, generated.accel_mps2, followed.accel_mps2),
        np.where(curvature_axis, generated.curvature_per_m, followed.curvature_per_m),
        np.where(curvature_axis, generated.curvature_rate_per_m_s, followed.curvature_rate_per_m_s),
    )


class ReferenceGenerator:
    """Advances the references of a fleet; keeps ruckig's trajectories from step to step.

    The trajectories are a view: whatever is passed in counts, and a trajectory that does not continue
    it is calculated anew. So slots may change hands, and the fleet may grow, between any two steps.
    """

    def __init__(self) -> None:
        self._shards: list[_Shard] = []
        self._before: _Profiles | None = None
        self.num_fallbacks = 0
        """How often a shard advanced by the closed form because ruckig refused it."""

    def advance(
        self, reference: Reference, setpoints: Setpoints, duration_s: float
    ) -> tuple[Reference, BoolColumn]:
        """Return the references ``duration_s`` later, and the slots whose command or state is unusable.

        An axis that follows no profile passes through unchanged. A failed axis is held: its value
        stays and its rate is 0; a failed controlled stop goes on at the default deceleration.

        Args:
            reference: Present references; every column has shape ``(num_slots,)``.
            setpoints: What each axis has to do.
            duration_s: Time ahead.

        Raises:
            ValueError: The columns differ in length.
        """
        num_slots = len(reference.speed_mps)
        if any(column.shape != (num_slots,) for column in (*reference, *setpoints)):
            lengths = sorted({column.shape for column in (*reference, *setpoints)})
            raise ValueError(
                f"references and setpoints: got columns of shapes {lengths}, expected one shape (n,)"
            )
        profiles, failed = _checked_profiles(reference, setpoints)
        by_hand = _crosses_zero(profiles)
        driven = _idle_where(profiles, by_hand)
        value, rate = self._advance_shards(driven, duration_s, failed)
        for slot in np.flatnonzero(by_hand):
            value[0, slot], rate[0, slot] = advance_speed_profile(
                *(float(column[0, slot]) for column in profiles), duration_s
            )
        self._before = _Profiles(value, rate, *driven[2:])
        speed_axis, curvature_axis = profile_axes(setpoints)
        return Reference(
            np.where(speed_axis, value[0], reference.speed_mps),
            np.where(speed_axis, rate[0], reference.accel_mps2),
            np.where(curvature_axis, value[1], reference.curvature_per_m),
            np.where(curvature_axis, rate[1], reference.curvature_rate_per_m_s),
        ), failed

    def _advance_shards(
        self, profiles: _Profiles, duration_s: float, failed: BoolColumn
    ) -> tuple[FloatMatrix, FloatMatrix]:
        num_slots = profiles.value.shape[1]
        if self._before is None or self._before.value.shape[1] != num_slots:
            self._shards = _cut_into_shards(num_slots)
            changed = np.ones(num_slots, np.bool_)
        else:
            pairs = zip(profiles, self._before, strict=True)
            changed = np.any(np.stack([now != before for now, before in pairs]), axis=(0, 1))
        value, rate = np.empty_like(profiles.value), np.empty_like(profiles.rate)
        for shard in self._shards:
            part = _Profiles(*(column[:, shard.slots] for column in profiles))
            try:
                if not shard.is_valid or changed[shard.slots].any():
                    _calculate(shard, part)
                shard.elapsed_s += duration_s
                new_value, new_rate = _sampled(shard)
            except (RuckigError, ValueError) as error:
                # ValueError is how the binding reports a result for which it has no name (-101, -104).
                shard.is_valid = False
                self.num_fallbacks += 1
                new_value, new_rate = _by_closed_form(part, duration_s)
                _blame(error, shard, part, new_value, new_rate, failed)
            value[:, shard.slots], rate[:, shard.slots] = new_value, new_rate
        return value, rate


def _checked_profiles(reference: Reference, setpoints: Setpoints) -> tuple[_Profiles, BoolColumn]:
    """Return profiles that ruckig accepts; an axis without one, held or unusable rests where it is."""
    speed_axis, curvature_axis = profile_axes(setpoints)
    stops = setpoints.longitudinal == Longitudinal.CONTROLLED_STOP
    decel = setpoints.decel_limit_mps2
    decel_usable = np.isfinite(decel) & (decel > 0.0)
    decel = np.where(stops & ~decel_usable, FALLBACK_STOP_DECEL_MPS2, decel)
    value = np.stack([reference.speed_mps, reference.curvature_per_m])
    rate = np.stack([reference.accel_mps2, reference.curvature_rate_per_m_s])
    target = np.stack([np.where(stops, 0.0, setpoints.target_speed_mps), setpoints.target_curvature_per_m])
    rise = np.stack(
        [np.where(stops, decel, setpoints.accel_limit_mps2), setpoints.curvature_rate_limit_per_m_s]
    )
    fall = np.stack([decel, setpoints.curvature_rate_limit_per_m_s])
    jerk = np.stack(
        [np.where(stops, np.inf, setpoints.jerk_limit_mps3), setpoints.curvature_jerk_limit_per_m_s2]
    )

    governed = np.stack([speed_axis, curvature_axis])
    max_value = np.array([[MAX_STATE_SPEED_MPS], [MAX_STATE_CURVATURE_PER_M]])
    max_rate = np.array([[MAX_STATE_ACCEL_MPS2], [MAX_STATE_CURVATURE_RATE_PER_M_S]])
    known = (np.abs(value) <= max_value) & (np.abs(rate) <= max_rate)
    usable = known & np.isfinite(target) & (rise >= 0.0) & (fall >= 0.0) & (jerk >= 0.0)
    failed = (governed & ~usable).any(axis=0) | (stops & ~decel_usable)
    moving = governed & usable & (rise > 0.0) & (fall > 0.0)

    value = np.where(known, value, 0.0)
    lowest = np.array([[MIN_ACCEL_MPS2], [MIN_CURVATURE_RATE_PER_M_S]])
    highest = np.array([[MAX_ACCEL_MPS2], [MAX_CURVATURE_RATE_PER_M_S]])
    farthest = np.array([[MAX_SPEED_MPS], [MAX_CURVATURE_PER_M]])
    jerk = np.where(np.isinf(jerk), jerk, np.clip(jerk, MIN_JERK, MAX_JERK))
    checked = _Profiles(
        value,
        np.where(moving, rate, 0.0),
        np.where(moving, np.clip(target, -farthest, farthest), value),
        np.where(moving, np.clip(rise, lowest, highest), 1.0),
        np.where(moving, np.clip(fall, lowest, highest), 1.0),
        np.where(moving, jerk, 1.0),
    )
    return checked, failed


def _crosses_zero(profiles: _Profiles) -> BoolColumn:
    """Return the slots whose speed would pass through zero by accident; see ``advance_speed_profile``."""
    speed, accel, target, jerk = (
        column[0] for column in (profiles.value, profiles.rate, profiles.target, profiles.jerk)
    )
    undershoots = np.isfinite(jerk) & (
        accel * accel > 2.0 * np.where(np.isfinite(jerk), jerk, 0.0) * np.abs(speed)
    )
    forward = (speed >= 0.0) & (target >= 0.0) & (accel < 0.0)
    backward = (speed <= 0.0) & (target <= 0.0) & (accel > 0.0)
    crossing: BoolColumn = undershoots & (forward | backward)
    return crossing


def _idle_where(profiles: _Profiles, slots: BoolColumn) -> _Profiles:
    """Return the profiles with the speed axis of some slots at rest."""
    if not slots.any():
        return profiles
    idle = _Profiles(*(column.copy() for column in profiles))
    for column, rest in zip(idle, (0.0, 0.0, 0.0, 1.0, 1.0, 1.0), strict=True):
        column[0, slots] = rest
    return idle


def _cut_into_shards(num_slots: int) -> list[_Shard]:
    shards, by_size = [], {}
    for first in range(0, num_slots, SLOTS_PER_SHARD):
        slots = slice(first, min(first + SLOTS_PER_SHARD, num_slots))
        dofs = 2 * (slots.stop - slots.start)
        otg = by_size.setdefault(dofs, Ruckig(dofs))
        given = InputParameter(dofs)
        given.control_interface = ControlInterface.Velocity
        given.synchronization = Synchronization.No
        shards.append(_Shard(slots, otg, given, Trajectory(dofs)))
    return shards


def _calculate(shard: _Shard, profiles: _Profiles) -> None:
    """Give a shard the trajectory that starts from the present state."""
    # ruckig checks no lengths: each list has one number per degree of freedom by construction.
    given = shard.given
    given.current_velocity = profiles.value.ravel().tolist()
    given.current_acceleration = profiles.rate.ravel().tolist()
    given.target_velocity = profiles.target.ravel().tolist()
    given.max_acceleration = profiles.rise_limit.ravel().tolist()
    given.min_acceleration = (-profiles.fall_limit).ravel().tolist()
    given.max_jerk = profiles.jerk.ravel().tolist()
    shard.is_valid = False
    shard.otg.calculate(given, shard.trajectory)
    shard.elapsed_s, shard.is_valid = 0.0, True


def _sampled(shard: _Shard) -> tuple[FloatMatrix, FloatMatrix]:
    _, velocity, acceleration = shard.trajectory.at_time(shard.elapsed_s)
    return np.array(velocity).reshape(2, -1), np.array(acceleration).reshape(2, -1)


def _by_closed_form(profiles: _Profiles, duration_s: float) -> tuple[FloatMatrix, FloatMatrix]:
    rows = zip(*(column.ravel().tolist() for column in profiles), strict=True)
    after = np.array([advance_profile(*row, duration_s) for row in rows])
    shape = profiles.value.shape
    return after[:, 0].reshape(shape), after[:, 1].reshape(shape)


def _blame(
    error: Exception,
    shard: _Shard,
    profiles: _Profiles,
    value: FloatMatrix,
    rate: FloatMatrix,
    failed: BoolColumn,
) -> None:
    """Hold and report the slot that an error of ruckig names, if it names one."""
    text = str(error)
    named = re.search(r"DoF (\d+)", text)
    logger.warning("ruckig refused slots %d to %d: %s", shard.slots.start, shard.slots.stop - 1, text[:200])
    if named is None:
        return
    axis, index = divmod(int(named.group(1)), profiles.value.shape[1])
    value[axis, index], rate[axis, index] = profiles.value[axis, index], 0.0
    failed[shard.slots.start + index] = True
