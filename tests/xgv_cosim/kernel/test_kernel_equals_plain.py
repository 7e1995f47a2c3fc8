"""The compiled loop is the Python code, slot by slot, and leaves its arguments alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.xgv_cosim.kernel.fleets import at_rest, driving, random_fleet, setpoints
from xgv_cosim import kernel
from xgv_cosim.actuation import Gear, Lateral, Longitudinal
from xgv_cosim.fleet_columns import Motion, Reference
from xgv_cosim.kernel.vehicle import vehicle_of
from xgv_cosim.parameters import ParameterColumns, VehicleParameters, parameter_columns, parameter_table

Answer = tuple[Motion, Reference]


def _assert_close(one: Answer, other: Answer, atol: float) -> None:
    for mine, expected in zip(one, other, strict=True):
        for name in mine._fields:
            np.testing.assert_allclose(
                getattr(mine, name), getattr(expected, name), rtol=1e-12, atol=atol, err_msg=name
            )


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_the_compiled_loop_equals_plain_python(seed: int) -> None:
    fleet = random_fleet(np.random.default_rng(seed), 16)
    _assert_close(kernel.advance(*fleet, 10), kernel.advance_plain(*fleet, 10), atol=1e-12)


@given(seed=st.integers(0, 2**32 - 1), ticks=st.integers(1, 12))
@settings(max_examples=40, deadline=None)
def test_a_fleet_equals_its_vehicles_one_by_one(seed: int, ticks: int) -> None:
    fleet = random_fleet(np.random.default_rng(seed), 8)
    motion, reference = kernel.advance(*fleet, ticks)
    for slot in range(8):
        alone = kernel.advance(
            *(type(part)(*(column[slot : slot + 1].copy() for column in part)) for part in fleet), ticks
        )
        for together, single in zip((motion, reference), alone, strict=True):
            for name in together._fields:
                assert getattr(together, name)[slot] == getattr(single, name)[0], name


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_a_step_may_be_cut_into_segments(seed: int) -> None:
    """XGV-71: a step with an edge in it is advanced in segments, with the same result."""
    motion, reference, wanted, parameters = random_fleet(np.random.default_rng(seed), 12)
    whole = kernel.advance(motion, reference, wanted, parameters, 10)
    first = kernel.advance(motion, reference, wanted, parameters, 3)
    _assert_close(kernel.advance(*first, wanted, parameters, 7), whole, atol=0.0)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_no_vehicle_drives_backwards_in_a_forward_gear_on_level_road_or_leaves_its_ranges(seed: int) -> None:
    motion, reference, wanted, parameters = random_fleet(np.random.default_rng(seed), 32)
    level = (
        (parameters.grade == 0.0)
        & (motion.speed_mps >= 0.0)
        & (motion.gear != Gear.REVERSE)
        & (wanted.gear_wanted != Gear.REVERSE)
    )
    for _ in range(5):
        motion, reference = kernel.advance(motion, reference, wanted, parameters, 10)
        assert (motion.speed_mps[level] >= 0.0).all()
        assert (motion.gear <= max(Gear)).all()
        assert ((motion.shift_s >= 0.0) & (motion.shift_s < 2.0)).all()
        assert ((motion.throttle >= 0.0) & (motion.throttle <= 1.0)).all()
        assert ((motion.brake >= 0.0) & (motion.brake <= 1.0)).all()
        assert all(np.isfinite(column).all() for column in (*motion, *reference))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_vehicle_with_bad_numbers_spoils_no_other(value: float) -> None:
    motion, reference, wanted, parameters = random_fleet(np.random.default_rng(1), 12)
    undisturbed = kernel.advance(motion, reference, wanted, parameters, 10)
    for column in (*motion, *reference, *parameters, *wanted):
        if column.dtype == np.float64:
            column[5] = value
    spoiled = kernel.advance(motion, reference, wanted, parameters, 10)
    others = np.arange(12) != 5
    for mine, expected in zip(spoiled, undisturbed, strict=True):
        for name in mine._fields:
            np.testing.assert_array_equal(getattr(mine, name)[others], getattr(expected, name)[others])


@pytest.mark.parametrize("longitudinal", list(Longitudinal))
@pytest.mark.parametrize("lateral", list(Lateral))
def test_bad_setpoints_leave_the_vehicle_itself_finite(longitudinal: Longitudinal, lateral: Lateral) -> None:
    motion, reference = driving(10.0)
    wanted = setpoints(1, longitudinal=longitudinal, lateral=lateral)
    wanted = wanted._replace(
        **{
            name: np.full(1, np.nan)
            for name, column in zip(wanted._fields, wanted, strict=True)
            if column.dtype == np.float64
        }
    )
    parameters = parameter_columns(VehicleParameters(), 1)
    after, followed = kernel.advance(motion, reference, wanted, parameters, 50)
    assert all(np.isfinite(column).all() for column in (*after, *followed))


@pytest.mark.parametrize("name", Reference._fields)
def test_a_lost_reference_is_found_again_from_the_car(name: str) -> None:
    motion, reference = driving(10.0)
    getattr(reference, name)[0] = np.nan
    wanted = setpoints(1, target_speed_mps=10.0)
    after, followed = kernel.advance(motion, reference, wanted, parameter_columns(VehicleParameters(), 1), 10)
    assert followed.speed_mps[0] == pytest.approx(10.0, abs=0.05)
    assert after.speed_mps[0] == pytest.approx(10.0, abs=0.05)


def test_the_arguments_are_not_written_to() -> None:
    fleet = random_fleet(np.random.default_rng(2), 4)
    before = [column.copy() for part in fleet for column in part]
    kernel.advance(*fleet, 10)
    kernel.advance_plain(*fleet, 10)
    for column, kept in zip((column for part in fleet for column in part), before, strict=True):
        np.testing.assert_array_equal(column, kept)


def test_travelled_distance_goes_on_from_the_value_given() -> None:
    motion, reference = driving(10.0)
    motion.travelled_m[:] = 5.0
    wanted = setpoints(1, longitudinal=Longitudinal.DRIVER)
    after, _ = kernel.advance(motion, reference, wanted, parameter_columns(VehicleParameters(), 1), 10)
    assert after.travelled_m[0] == pytest.approx(6.0)


def test_an_empty_fleet_is_no_special_case() -> None:
    motion, reference = at_rest(0)
    after, _ = kernel.advance(motion, reference, setpoints(0), parameter_columns(VehicleParameters(), 0), 10)
    assert after.speed_mps.shape == (0,)


def test_the_kernel_reads_each_parameter_by_its_own_name() -> None:
    columns = ParameterColumns(
        *(np.array([-1.0, float(index)]) for index in range(len(ParameterColumns._fields)))
    )
    vehicle = vehicle_of(parameter_table(columns), 1)
    for index, name in enumerate(ParameterColumns._fields):
        assert getattr(vehicle, name) == index
