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
from typing import TYPE_CHECKING

import numpy as np
from ruckig import ControlInterface, InputParameter, Ruckig, RuckigError, Synchronization, Trajectory

from xgv_cosim.controllers.checking import (
    Profiles,
    checked_profiles,
    crossing_slots,
    profile_axes,
    with_speed_at_rest,
)
from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile
from xgv_cosim.fleet import Motion, Reference, Setpoints

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, FloatMatrix

logger = logging.getLogger(__name__)

SLOTS_PER_SHARD = 128
STRAYED_MPS = 2.0
"""Distance of speed and reference at which the reference waits for the car (no grip, no power)."""


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
        self._expected: FloatMatrix = np.empty((0, 0))
        """What the next call brings if nothing changes, a row for each column of its arguments."""

    @property
    def num_calculated(self) -> int:
        """How often a shard was given a new trajectory."""
        return sum(shard.num_calculated for shard in self._shards)

    @property
    def num_refused(self) -> int:
        """How often ruckig refused a shard, which then advanced by the closed form."""
        return sum(shard.num_refused for shard in self._shards)

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
        failed = self.look_ahead(reference, setpoints)
        present = self._expected[: len(reference)]
        after = np.empty_like(present)
        for shard in self._shards:
            rows = shard.advance(duration_s)
            after[:, shard.slots] = np.where(shard.is_governed, rows, present[:, shard.slots])
        self._expected = np.concatenate([after, self._expected[len(reference) :]])
        return Reference(*after), failed

    def look_ahead(self, reference: Reference, setpoints: Setpoints) -> BoolColumn:
        """Return the slots whose command or state is unusable, before anything moves (XGV-71).

        What is calculated for it is what ``advance`` goes on with, if it is given the same.

        Args:
            reference: As for ``advance``.
            setpoints: As for ``advance``.

        Raises:
            ValueError: The columns differ in length.
        """
        columns = (*reference, *setpoints)
        num_slots = len(reference.speed_mps)
        if any(column.shape != (num_slots,) for column in columns):
            shapes = sorted({column.shape for column in columns})
            raise ValueError(f"references and setpoints: got columns of shapes {shapes}, expected one shape")
        given = np.array(columns, np.float64)
        if self._expected.shape == given.shape:
            changed = (given != self._expected).any(axis=0)
        else:
            self._shards = _cut_into_shards(num_slots)
            changed = np.ones(num_slots, np.bool_)
        stale = [shard for shard in self._shards if shard.is_used_up or changed[shard.slots].any()]
        if stale:
            profiles, unusable = checked_profiles(reference, setpoints)
            speed_axis, curvature_axis = profile_axes(setpoints)
            is_governed = np.array([speed_axis, speed_axis, curvature_axis, curvature_axis])
            for shard in stale:
                part = Profiles(*(column[:, shard.slots] for column in profiles))
                shard.retarget(part, is_governed[:, shard.slots], unusable[shard.slots])
        self._expected = given
        failed = np.zeros(num_slots, np.bool_)
        for shard in self._shards:
            failed[shard.slots] = shard.failed
        return failed


@dataclass(slots=True)
class _Shard:
    """The present trajectory of some consecutive slots; ruckig's axes are all speeds, then all curvatures."""

    slots: slice
    otg: Ruckig
    given: InputParameter
    trajectory: Trajectory
    profiles: Profiles
    """From where the trajectory started."""
    by_hand: Profiles
    """The same, but with the speed profiles that ruckig must not follow through zero."""
    crossing: BoolColumn
    """Which those are."""
    is_governed: BoolColumn
    """Shape ``(4, n)``: which rows of the reference the trajectory governs."""
    failed: BoolColumn
    elapsed_s: float = 0.0
    is_valid: bool = False
    num_calculated: int = 0
    num_refused: int = 0

    @property
    def is_used_up(self) -> bool:
        """Return whether it was advanced without a trajectory, so that it starts anew from where it is."""
        return not self.is_valid and self.elapsed_s > 0.0

    def retarget(self, profiles: Profiles, is_governed: BoolColumn, failed: BoolColumn) -> None:
        """Calculate the trajectory that starts from the present references."""
        self.by_hand, self.is_governed, self.failed = profiles, is_governed, failed
        self.crossing = crossing_slots(profiles)
        self.profiles = with_speed_at_rest(profiles, self.crossing)
        self.elapsed_s, self.is_valid = 0.0, False
        self.num_calculated += 1
        try:
            self._calculate()
        except (RuckigError, ValueError) as error:
            # ValueError is how the binding reports a result for which it has no name (-101, -104).
            self.num_refused += 1
            self._hold_the_named(str(error))
        else:
            self.is_valid = True

    def advance(self, duration_s: float) -> FloatMatrix:
        """Return the references after ``duration_s`` more, a row for each column of ``Reference``."""
        self.elapsed_s += duration_s
        if not self.is_valid:
            value, rate = self._by_closed_form(duration_s)
        elif self.elapsed_s >= self.trajectory.duration:
            value, rate = self.profiles.target.copy(), np.zeros_like(self.profiles.target)
        else:
            _, values, rates = self.trajectory.at_time(self.elapsed_s)
            value, rate = np.array(values).reshape(2, -1), np.array(rates).reshape(2, -1)
        for slot in np.flatnonzero(self.crossing).tolist():
            value[0, slot], rate[0, slot] = advance_speed_profile(*_row(self.by_hand, 0, slot), dt=duration_s)
            self.is_valid = False  # from where that ends, the profile has to be looked at again
        return np.array([value[0], rate[0], value[1], rate[1]])

    def _calculate(self) -> None:
        # ruckig checks no lengths: each list has one number per axis because each array has.
        profiles, given = self.profiles, self.given
        given.current_velocity = profiles.value.ravel().tolist()
        given.current_acceleration = profiles.rate.ravel().tolist()
        given.target_velocity = profiles.target.ravel().tolist()
        given.max_acceleration = profiles.rise_limit.ravel().tolist()
        given.min_acceleration = (-profiles.fall_limit).ravel().tolist()
        given.max_jerk = profiles.jerk.ravel().tolist()
        self.otg.calculate(given, self.trajectory)

    def _by_closed_form(self, duration_s: float) -> tuple[FloatMatrix, FloatMatrix]:
        value, rate = self.profiles.value.copy(), self.profiles.rate.copy()
        for axis, slot in np.ndindex(value.shape):
            row = _row(self.profiles, axis, slot)
            value[axis, slot], rate[axis, slot] = advance_profile(*row, dt=duration_s)
        return value, rate

    def _hold_the_named(self, error: str) -> None:
        """Hold and report the slot that an error of ruckig names, if it names one."""
        logger.warning(
            "ruckig refused slots %d to %d: %s", self.slots.start, self.slots.stop - 1, error[:200]
        )
        named = re.search(r"DoF (\d+)", error)
        num_slots = len(self.failed)
        if named is None or int(named.group(1)) >= 2 * num_slots:
            return
        axis, slot = divmod(int(named.group(1)), num_slots)
        self.profiles.rate[axis, slot] = 0.0
        self.profiles.target[axis, slot] = self.profiles.value[axis, slot]
        self.failed[slot] = True


def _row(profiles: Profiles, axis: int, slot: int) -> tuple[float, float, float, float, float, float]:
    value, rate, target, rise, fall, jerk = (float(column[axis, slot]) for column in profiles)
    return value, rate, target, rise, fall, jerk


def _cut_into_shards(num_slots: int) -> list[_Shard]:
    shards: list[_Shard] = []
    calculators: dict[int, Ruckig] = {}
    for first in range(0, num_slots, SLOTS_PER_SHARD):
        slots = slice(first, min(first + SLOTS_PER_SHARD, num_slots))
        size = slots.stop - slots.start
        given = InputParameter(2 * size)
        given.control_interface = ControlInterface.Velocity
        given.synchronization = Synchronization.No
        rest = Profiles(*(np.zeros((2, size)) for _ in Profiles._fields))
        nowhere = np.zeros(size, np.bool_)
        # Calculating keeps no state, so shards of one size share what they calculate with.
        otg = calculators.setdefault(2 * size, Ruckig(2 * size))
        shards.append(
            _Shard(
                slots,
                otg,
                given,
                Trajectory(2 * size),
                rest,
                rest,
                nowhere,
                np.zeros((4, size), np.bool_),
                nowhere,
            )
        )
    return shards
