"""Each compiled loop over the fleet's columns is its own Python code: random fleets, all results the same."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.xgv_cosim.kernel.fleets import random_fleet
from xgv_cosim import kernel
from xgv_cosim.actuation import Driver, Gear, Lateral, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers import checking
from xgv_cosim.fleet_columns import motion_table, reference_table, setpoint_tables
from xgv_cosim.kernel import driven, placing, setting, settling, watching
from xgv_cosim.parameters import parameter_table

NUM_SLOTS = 24


class Random:
    """Columns and tables of a random fleet."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        motion, reference, wanted, parameters = random_fleet(self.rng, NUM_SLOTS)
        self.motion, self.gear = motion_table(motion), motion.gear
        self.reference, self.parameters = reference_table(reference), parameter_table(parameters)
        self.numbers, self.codes = setpoint_tables(wanted)

    def code(self, *choices: int) -> np.ndarray:
        return self.rng.choice(np.array(choices, np.uint8), NUM_SLOTS)

    def truth(self) -> np.ndarray:
        return self.rng.random(NUM_SLOTS) < 0.5

    def number(self, *choices: float) -> np.ndarray:
        return self.rng.choice(np.array(choices), NUM_SLOTS)


def _watching(a: Random) -> tuple[object, ...]:
    codes = [a.code(*range(4)) for _ in range(5)]
    return (
        a.rng.integers(0, 3, (2, NUM_SLOTS)),
        a.motion,
        a.parameters,
        a.rng.integers(0, 2**11, NUM_SLOTS).astype(np.uint16),
        *codes,
        a.code(*range(16)),
        a.code(*Longitudinal),
        a.code(*Lateral),
        a.code(*Gear),
        a.code(*Gear),
        a.code(*Driver),
        *(a.truth() for _ in range(4)),
        *(a.number(0.0, 0.05, 0.5, -3.0) for _ in range(3)),
        a.number(0.05, 1.0),
        a.number(1.0, 2.0, np.inf),
        a.number(1.0, 2.0, np.inf),
        2.05,
    )


def _setting(a: Random) -> tuple[object, ...]:
    return (
        np.zeros((NUM_SLOTS, 11)),
        np.zeros((NUM_SLOTS, 6), np.uint8),
        a.motion,
        a.reference,
        a.parameters,
        a.code(*Longitudinal),
        a.code(*Lateral),
        a.code(*Gear),
        a.code(*Gear),
        a.code(*range(16)),
        *(a.truth() for _ in range(4)),
        *(a.number(0.2, 1.0, 2.5) for _ in range(6)),
        a.code(*CommandKind),
        a.number(0.0, -2.0, 9.0, np.nan, np.inf),
        a.number(0.0, 2.0, np.nan),
        a.number(0.0, -0.4, 0.02, np.nan, np.inf),
        *(a.number(0.0, 0.3, -0.5) for _ in range(4)),
    )


def _settling(a: Random) -> tuple[object, ...]:
    gears = [a.code(*Gear) for _ in range(3)]
    return (a.reference, a.reference + a.number(0.0, 3.0)[:, None], a.motion, a.gear, *gears, a.codes, 0.095)


def _placing(a: Random) -> tuple[object, ...]:
    slots = np.array([0, 3, 4, 17])
    placed, owned = np.zeros((5, 4)), np.zeros((2, 4), np.bool_)
    return placed, owned, slots, a.motion, a.parameters, a.truth(), a.truth()


def _adopting(a: Random) -> tuple[object, ...]:
    before = a.motion + 0.1 * a.rng.random(a.motion.shape)
    seen = a.rng.uniform(-9.0, 9.0, (5, NUM_SLOTS))
    return a.motion, before, a.parameters, np.arange(NUM_SLOTS), a.truth(), a.truth(), seen


def _checking(a: Random) -> tuple[object, ...]:
    a.reference[3, 0], a.reference[7, 3], a.reference[9, 2] = np.nan, np.inf, 11.0
    a.reference[11, :2], a.codes[11, 0], a.numbers[11, 0], a.numbers[11, 3] = (0.3, -3.0), 0, 0.0, 4.0
    size = NUM_SLOTS - 4
    truths = [np.zeros(size, np.bool_) for _ in range(2)]
    governed = np.zeros((2, size), np.bool_)
    return np.zeros((6, 2, size)), governed, *truths, a.reference, a.numbers, a.codes, 4


def _noting(a: Random) -> tuple[object, ...]:
    kept = [a.reference.copy(), a.numbers.copy(), a.codes.copy()]
    kept[0][2, 1] += 1.0
    kept[2][21, 5] += 1
    return np.zeros(3, np.bool_), *kept, a.reference, np.nan_to_num(a.numbers), a.codes, 8


def _taking(a: Random) -> tuple[object, ...]:
    values, rates = a.rng.random((2, 2, NUM_SLOTS - 4))
    return a.reference, np.array([a.truth(), a.truth()])[:, 4:], values, rates, 4


def _expiring(a: Random) -> tuple[object, ...]:
    return a.number(1.0, 2.0, np.inf), a.truth()


def _taking_over(a: Random) -> tuple[object, ...]:
    released = [a.number(1.0, 2.0, np.inf) for _ in range(2)]
    return a.code(*Driver), a.number(0.3, 1.0), a.code(*Longitudinal), a.code(*Lateral), *released


def _engaging(a: Random) -> tuple[object, ...]:
    return a.codes, a.gear, a.motion, a.parameters


LOOPS: list[tuple[Callable[..., object], Callable[..., object], Callable[[Random], tuple[object, ...]]]] = [
    (kernel.note_inputs, watching.note_inputs_in_place, _watching),
    (kernel.set_points, setting.set_points_in_place, _setting),
    (driven.settle, settling.settle_in_place, _settling),
    (kernel.next_expiry, settling.next_expiry_in, _expiring),
    (kernel.next_take_over, settling.next_take_over_in, _taking_over),
    (kernel.next_engagement, settling.next_engagement_in, _engaging),
    (kernel.place, placing.place_in_place, _placing),
    (kernel.adopt, placing.adopt_in_place, _adopting),
    (checking.check, checking.check_in_place, _checking),
    (checking.note_changes, checking.note_changes_in_place, _noting),
    (checking.take, checking.take_in_place, _taking),
]


@pytest.mark.parametrize(("fast", "plain", "arguments"), LOOPS, ids=[plain.__name__ for _, plain, _ in LOOPS])
def test_a_compiled_loop_equals_plain_python(
    fast: Callable[..., object],
    plain: Callable[..., object],
    arguments: Callable[[Random], tuple[object, ...]],
) -> None:
    for seed in range(10):
        mine, expected = arguments(Random(seed)), arguments(Random(seed))
        assert fast(*mine) == plain(*expected)
        for one, other in zip(mine, expected, strict=True):
            if isinstance(one, np.ndarray):
                np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_one_bit_of_any_input_of_the_modes_is_noticed() -> None:
    """Whatever the modes and their reports read, as it stands in the words."""
    given = list(_watching(Random(1)))
    assert kernel.note_inputs(*given)
    assert not kernel.note_inputs(*given)
    for position, column in enumerate(given[3:], 3):
        if not isinstance(column, np.ndarray) or column.dtype == np.float64:
            continue
        changed = column.copy()
        changed[5] = not changed[5] if changed.dtype == np.bool_ else changed[5] ^ 1
        assert kernel.note_inputs(*given[:position], changed, *given[position + 1 :]), position
        assert kernel.note_inputs(*given), position


@pytest.mark.parametrize(
    ("position", "before", "after"),
    [("speed", 0.0, 0.01), ("speed", 0.01, -0.01), ("command", 0.0, 1.0), ("brake", 0.0, 0.5)],
)
@pytest.mark.parametrize("matters", [True, False])
def test_a_threshold_that_is_passed_is_noticed_where_it_matters_and_a_mere_number_is_not(
    position: str, before: float, after: float, matters: bool
) -> None:
    """In a stop, against the parking brake, while a shift waits."""
    given: list[np.ndarray] = list(_watching(Random(2)))  # type: ignore[arg-type]
    longitudinal, gear_wanted, gear, frozen, parking_brake = (given[index] for index in (10, 12, 13, 15, 18))
    motion, commanded_mps, commanded_brake = given[1], given[19], given[21]
    commanded_brake[:] = 0.0
    frozen[5], parking_brake[5], gear_wanted[5] = False, matters, Gear.DRIVE
    longitudinal[5] = Longitudinal.FULL_BRAKE if matters else Longitudinal.CLOSED_LOOP
    gear[5] = Gear.REVERSE if matters else Gear.DRIVE
    where = {"speed": motion[:, 3], "command": commanded_mps, "brake": motion[:, 8]}[position]
    where[5] = before
    kernel.note_inputs(*given)
    where[5] = after
    assert kernel.note_inputs(*given) == matters
    where[5] = 1.1 * after
    assert not kernel.note_inputs(*given)
