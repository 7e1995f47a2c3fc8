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
    check,
    note_changes,
    take,
    with_speed_at_rest,
)
from xgv_cosim.controllers.profile import advance_profile, advance_speed_profile
from xgv_cosim.fleet_columns import Reference, Setpoints, reference_in, reference_table, setpoint_tables

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, BoolMatrix, FloatBlock, FloatMatrix, UInt8Matrix

logger = logging.getLogger(__name__)

SLOTS_PER_SHARD = 128
_VALUE, _RATE, _TARGET = (Profiles._fields.index(name) for name in ("value", "rate", "target"))


class ReferenceGenerator:
    """Advances the references of a fleet; keeps ruckig's trajectories from step to step.

    The trajectories are a view: whatever is passed in counts, and a trajectory that does not continue
    it is calculated anew. So slots may change hands, and the fleet may grow, between any two steps.
    """

    def __init__(self) -> None:
        self._shards: list[_Shard] = []
        self._expected = _Kept(0)
        """What the next call brings if nothing changes."""

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
        return self.go_on(duration_s), failed

    def go_on(self, duration_s: float) -> Reference:
        """Return the references ``duration_s`` after those that ``look_ahead`` was given."""
        after = self._expected.reference.copy()
        for shard in self._shards:
            take(after, shard.is_governed, *shard.advance(duration_s), shard.slots.start)
        self._expected.reference = after.copy()  # what is returned is the caller's to change
        return reference_in(after)

    def look_ahead(self, reference: Reference, setpoints: Setpoints) -> BoolColumn:
        """Return the slots whose command or state is unusable, before anything moves (XGV-71).

        What is calculated for it is what ``advance`` goes on with, if it is given the same.

        Args:
            reference: As for ``advance``.
            setpoints: As for ``advance``.

        Raises:
            ValueError: The columns differ in length.
        """
        table, (numbers, codes) = reference_table(reference), setpoint_tables(setpoints)
        num_slots = len(table)
        if len(numbers) != num_slots or len(codes) != num_slots:
            raise ValueError(
                f"references and setpoints: {num_slots} and {len(numbers)} slots, expected one shape"
            )
        kept = self._expected
        if len(kept.reference) != num_slots:
            self._shards = _cut_into_shards(num_slots)
            self._expected = kept = _Kept(num_slots)
        for number, shard in enumerate(self._shards):
            kept.is_stale[number] = kept.is_new or shard.is_used_up
        kept.is_new = False
        if note_changes(
            kept.is_stale, kept.reference, kept.numbers, kept.codes, table, numbers, codes, SLOTS_PER_SHARD
        ):
            for number in np.flatnonzero(kept.is_stale).tolist():
                self._shards[number].retarget(table, numbers, codes)
        if len(self._shards) == 1:
            return self._shards[0].failed.copy()
        return np.concatenate([shard.failed for shard in self._shards] or [np.zeros(0, np.bool_)])


class _Kept:
    """What the generator was given last, the references as far as they have come since."""

    def __init__(self, num_slots: int) -> None:
        self.reference: FloatMatrix = np.zeros((num_slots, 4))
        self.numbers: FloatMatrix = np.zeros((num_slots, 11))
        self.codes: UInt8Matrix = np.zeros((num_slots, 6), np.uint8)
        self.is_stale: BoolColumn = np.zeros(-(-num_slots // SLOTS_PER_SHARD), np.bool_)
        """Shape ``(number of shards,)``."""
        self.is_new = True


@dataclass(slots=True)
class _Shard:
    """The present trajectory of some consecutive slots; ruckig's axes are all speeds, then all curvatures."""

    slots: slice
    otg: Ruckig
    given: InputParameter
    trajectory: Trajectory
    profiles: FloatBlock
    """From where the trajectory started, shape ``(6, 2, n)``: the arrays of ``Profiles``."""
    by_hand: FloatBlock
    """The same, but with the speed profiles that ruckig must not follow through zero."""
    crossing: BoolColumn
    """Which those are."""
    is_governed: BoolMatrix
    """Shape ``(2, n)``: which axes the trajectory governs."""
    failed: BoolColumn
    limits: FloatBlock
    """The limits that ruckig was given last, shape ``(3, 2, n)``."""
    is_crossing: bool = False
    elapsed_s: float = 0.0
    is_valid: bool = False
    num_calculated: int = 0
    num_refused: int = 0

    @property
    def is_used_up(self) -> bool:
        """Return whether it was advanced without a trajectory, so that it starts anew from where it is."""
        return not self.is_valid and self.elapsed_s > 0.0

    def retarget(self, reference: FloatMatrix, numbers: FloatMatrix, codes: UInt8Matrix) -> None:
        """Calculate the trajectory that starts from the present references."""
        self.by_hand = self.profiles = np.empty_like(self.by_hand)
        self.is_crossing = check(
            self.by_hand,
            self.is_governed,
            self.failed,
            self.crossing,
            reference,
            numbers,
            codes,
            self.slots.start,
        )
        if self.is_crossing:
            self.profiles = with_speed_at_rest(self.by_hand, self.crossing)
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

    def advance(self, duration_s: float) -> tuple[FloatMatrix, FloatMatrix]:
        """Return value and rate after ``duration_s`` more, of shape ``(2, n)`` each."""
        self.elapsed_s += duration_s
        if not self.is_valid:
            value, rate = self._by_closed_form(duration_s)
        elif self.elapsed_s >= self.trajectory.duration:
            value = self.profiles[_TARGET].copy()
            rate = np.zeros_like(value)
        else:
            _, values, rates = self.trajectory.at_time(self.elapsed_s)
            value, rate = np.array(values).reshape(2, -1), np.array(rates).reshape(2, -1)
        if self.is_crossing:
            for slot in np.flatnonzero(self.crossing).tolist():
                row = _row(self.by_hand, 0, slot)
                value[0, slot], rate[0, slot] = advance_speed_profile(*row, dt=duration_s)
                self.is_valid = False  # from where that ends, the profile has to be looked at again
        return value, rate

    def _calculate(self) -> None:
        # ruckig checks no lengths: each list has one number per axis because each array has.
        profiles, given = self.profiles.reshape(6, -1), self.given
        given.current_velocity = profiles[0].tolist()
        given.current_acceleration = profiles[1].tolist()
        given.target_velocity = profiles[2].tolist()
        if not np.array_equal(self.limits, self.profiles[3:]):  # they change seldom
            given.max_acceleration = profiles[3].tolist()
            given.min_acceleration = (-profiles[4]).tolist()
            given.max_jerk = profiles[5].tolist()
            self.limits = self.profiles[3:].copy()
        self.otg.calculate(given, self.trajectory)

    def _by_closed_form(self, duration_s: float) -> tuple[FloatMatrix, FloatMatrix]:
        value, rate = self.profiles[_VALUE].copy(), self.profiles[_RATE].copy()
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
        self.profiles[_RATE, axis, slot] = 0.0
        self.profiles[_TARGET, axis, slot] = self.profiles[_VALUE, axis, slot]
        self.failed[slot] = True


def _row(profiles: FloatBlock, axis: int, slot: int) -> tuple[float, float, float, float, float, float]:
    value, rate, target, rise, fall, jerk = profiles[:, axis, slot].tolist()
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
        rest = np.zeros((len(Profiles._fields), 2, size))
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
                np.zeros(size, np.bool_),
                np.zeros((2, size), np.bool_),
                np.zeros(size, np.bool_),
                np.zeros((3, 2, size)),
            )
        )
    return shards
