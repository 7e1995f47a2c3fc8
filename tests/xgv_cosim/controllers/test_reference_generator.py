"""References of a fleet by ruckig: batched as single, cheap when idle, and safe from bad numbers."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.xgv_cosim.kernel.fleets import at_rest, driving, merged, random_fleet, setpoints
from xgv_cosim import kernel
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.controllers.checking import profile_axes
from xgv_cosim.controllers.references import ReferenceGenerator
from xgv_cosim.fleet_columns import Reference, Setpoints


def _slot(columns: Reference | Setpoints, slot: int) -> Reference | Setpoints:
    return type(columns)(*(column[slot : slot + 1] for column in columns))


def _spread(num_slots: int, seed: int) -> tuple[Reference, Setpoints]:
    """Return tame references and closed-loop setpoints that differ from slot to slot."""
    rng = np.random.default_rng(seed)
    _, reference = driving(0.0, num_slots)
    reference = reference._replace(speed_mps=rng.uniform(0.0, 30.0, num_slots))
    wanted = setpoints(num_slots)._replace(
        target_speed_mps=rng.uniform(0.0, 30.0, num_slots),
        target_curvature_per_m=rng.uniform(-0.1, 0.1, num_slots),
        jerk_limit_mps3=rng.choice([2.0, 8.0, np.inf], num_slots),
    )
    return reference, wanted


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_ruckig_at_the_end_of_a_step_equals_the_kernels_closed_form(seed: int) -> None:
    motion, reference, wanted, parameters = random_fleet(np.random.default_rng(seed), 24)
    generated, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    _, followed = kernel.advance(motion, reference, wanted, parameters, 10)
    speed_axis, curvature_axis = profile_axes(wanted)
    for name, axis in (
        ("speed_mps", speed_axis),
        ("accel_mps2", speed_axis & np.isfinite(wanted.jerk_limit_mps3)),
        ("curvature_per_m", curvature_axis),
    ):
        np.testing.assert_allclose(
            getattr(generated, name)[axis], getattr(followed, name)[axis], rtol=0.0, atol=1e-7, err_msg=name
        )


def test_a_fleet_of_several_shards_equals_its_vehicles_one_by_one() -> None:
    reference, wanted = _spread(150, seed=3)
    fleet, singles = ReferenceGenerator(), [ReferenceGenerator() for _ in range(150)]
    alone = [_slot(reference, slot) for slot in range(150)]
    for _ in range(5):
        reference, failed = fleet.advance(reference, wanted, 0.1)
        alone = [
            single.advance(part, _slot(wanted, slot), 0.1)[0]
            for slot, (single, part) in enumerate(zip(singles, alone, strict=True))
        ]
        assert not failed.any()
    for name in Reference._fields:
        singly = [getattr(part, name)[0] for part in alone]
        # A trajectory that has ended gives its target exactly; one still running beside it, to an ulp.
        np.testing.assert_allclose(getattr(reference, name), singly, rtol=0.0, atol=1e-14)


def test_only_shards_with_a_change_are_calculated_anew() -> None:
    reference, wanted = _spread(300, seed=4)
    generator = ReferenceGenerator()
    reference, _ = generator.advance(reference, wanted, 0.1)
    assert generator.num_calculated == 3
    for _ in range(50):
        reference, _ = generator.advance(reference, wanted, 0.1)
    assert generator.num_calculated == 3
    wanted.target_speed_mps[200] = 1.0
    reference, _ = generator.advance(reference, wanted, 0.1)
    assert generator.num_calculated == 4
    reference.speed_mps[10] += 0.5  # another vehicle took the slot
    generator.advance(reference, wanted, 0.1)
    assert generator.num_calculated == 5


def test_a_kept_trajectory_is_the_same_motion_as_new_ones_in_every_step() -> None:
    reference, wanted = _spread(20, seed=5)
    kept, renewed = ReferenceGenerator(), reference
    for _ in range(200):
        reference, _ = kept.advance(reference, wanted, 0.1)
        renewed, _ = ReferenceGenerator().advance(renewed, wanted, 0.1)
        np.testing.assert_allclose(reference.speed_mps, renewed.speed_mps, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(reference.speed_mps, wanted.target_speed_mps)
    np.testing.assert_array_equal(reference.accel_mps2, 0.0)


BAD_NUMBERS = [
    ("target_speed_mps", np.nan),
    ("target_speed_mps", np.inf),
    ("accel_limit_mps2", np.nan),
    ("accel_limit_mps2", -1.0),
    ("decel_limit_mps2", -np.inf),
    ("jerk_limit_mps3", np.nan),
    ("jerk_limit_mps3", -4.0),
    ("target_curvature_per_m", -np.inf),
    ("curvature_rate_limit_per_m_s", np.nan),
    ("curvature_jerk_limit_per_m_s2", np.nan),
]


@pytest.mark.parametrize(("name", "value"), BAD_NUMBERS)
def test_a_bad_setpoint_fails_its_vehicle_and_no_other(name: str, value: float) -> None:
    reference, wanted = _spread(150, seed=6)
    undisturbed, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    getattr(wanted, name)[7] = value
    generated, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert np.flatnonzero(failed).tolist() == [7]
    axis = (
        ("curvature_per_m", "curvature_rate_per_m_s") if "curvature" in name else ("speed_mps", "accel_mps2")
    )
    assert getattr(generated, axis[0])[7] == getattr(reference, axis[0])[7]  # held
    assert getattr(generated, axis[1])[7] == 0.0
    others = np.arange(150) != 7
    for mine, expected in zip(generated, undisturbed, strict=True):
        np.testing.assert_array_equal(mine[others], expected[others])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("name", Reference._fields)
def test_a_bad_reference_fails_its_vehicle_and_no_other(name: str, value: float) -> None:
    reference, wanted = _spread(150, seed=7)
    undisturbed, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    getattr(reference, name)[7] = value
    generated, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert np.flatnonzero(failed).tolist() == [7]
    others = np.arange(150) != 7
    for mine, expected in zip(generated, undisturbed, strict=True):
        assert np.isfinite(mine).all()
        np.testing.assert_array_equal(mine[others], expected[others])


def test_garbage_that_ruckig_would_choke_on_is_clipped() -> None:
    """Finite but absurd numbers: a duration above 7600 s makes ruckig refuse the batch without a name."""
    reference, wanted = _spread(10, seed=8)
    wanted.target_speed_mps[0], wanted.accel_limit_mps2[1], wanted.jerk_limit_mps3[2] = 1e300, 1e300, 1e-300
    wanted.accel_limit_mps2[3] = wanted.decel_limit_mps2[3] = 1e-300
    generator = ReferenceGenerator()
    generated, failed = generator.advance(reference, wanted, 0.1)
    assert not failed.any()
    assert generator.num_refused == 0
    assert all(np.isfinite(column).all() for column in generated)


def test_what_ruckig_refuses_without_a_name_advances_by_the_closed_form(
    caplog: pytest.LogCaptureFixture,
) -> None:
    reference, wanted = _spread(150, seed=9)
    undisturbed, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    # Shedding 45 m/s² at the least jerk takes 450 s and ends far away: more than ruckig accepts.
    reference.accel_mps2[7] = 45.0
    wanted.jerk_limit_mps3[7], wanted.decel_limit_mps2[7] = 0.1, 0.05
    generator = ReferenceGenerator()
    with caplog.at_level(logging.WARNING):
        generated, failed = generator.advance(reference, wanted, 0.1)
    assert generator.num_refused == 1
    assert "slots 0 to 127" in caplog.text
    assert not failed.any()
    assert generated.speed_mps[7] == pytest.approx(reference.speed_mps[7] + 4.5, abs=0.01)
    others = np.arange(150) != 7
    np.testing.assert_allclose(generated.speed_mps[others], undisturbed.speed_mps[others], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(generated.curvature_per_m[128:], undisturbed.curvature_per_m[128:])


@pytest.mark.parametrize(("dof", "slot", "axis"), [(3, 3, "speed_mps"), (20 + 5, 5, "curvature_per_m")])
def test_the_vehicle_that_ruckig_names_is_held_and_reported(
    dof: int, slot: int, axis: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A refusal that validation did not foresee, injected into ruckig's answer."""
    from ruckig import RuckigError

    from xgv_cosim.controllers import references

    class Refusing:
        def __init__(self, num_dofs: int) -> None:
            assert num_dofs == 40

        def calculate(self, *_: object) -> None:
            raise RuckigError(f"target velocity nan of DoF {dof} is invalid")

    reference, wanted = _spread(20, seed=10)
    undisturbed, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    monkeypatch.setattr(references, "Ruckig", Refusing)
    generated, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert np.flatnonzero(failed).tolist() == [slot]
    assert getattr(generated, axis)[slot] == getattr(reference, axis)[slot]
    others = np.arange(20) != slot
    for mine, expected in zip(generated, undisturbed, strict=True):
        np.testing.assert_allclose(mine[others], expected[others], rtol=0.0, atol=1e-9)


def test_looking_ahead_names_the_failed_and_changes_no_motion_xgv_71() -> None:
    reference, wanted = _spread(20, seed=11)
    wanted.target_speed_mps[7] = np.nan
    looks, plain, ahead = ReferenceGenerator(), ReferenceGenerator(), reference
    for _ in range(3):
        seen = looks.look_ahead(ahead, wanted)
        assert np.flatnonzero(seen).tolist() == [7]
        ahead, failed = looks.advance(ahead, wanted, 0.1)
        assert failed.tolist() == seen.tolist()
        reference, _ = plain.advance(reference, wanted, 0.1)
        for mine, expected in zip(ahead, reference, strict=True):
            np.testing.assert_array_equal(mine, expected)


@pytest.mark.parametrize("refuses", [False, True])
def test_advance_goes_on_with_what_the_look_ahead_has_calculated(
    refuses: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether ruckig answers, or refuses and the closed form does."""
    if refuses:
        from ruckig import RuckigError

        from xgv_cosim.controllers import references

        class Refusing:
            def __init__(self, num_dofs: int) -> None:
                assert num_dofs == 40

            def calculate(self, *_: object) -> None:
                raise RuckigError("no")

        monkeypatch.setattr(references, "Ruckig", Refusing)
    reference, wanted = _spread(20, seed=12)
    generator = ReferenceGenerator()
    for _ in range(4):
        assert not generator.look_ahead(reference, wanted).any()
        calculated = generator.num_calculated
        reference, _ = generator.advance(reference, wanted, 0.1)
        assert generator.num_calculated == calculated


def test_a_limit_of_zero_holds_the_axis_xgv_70() -> None:
    _, reference = driving(10.0, 2)
    reference.accel_mps2[:], reference.curvature_per_m[:] = 1.0, 0.02
    wanted = setpoints(2, target_speed_mps=20.0, target_curvature_per_m=0.1)
    wanted.accel_limit_mps2[0], wanted.curvature_rate_limit_per_m_s[1] = 0.0, 0.0
    generated, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert not failed.any()
    assert (generated.speed_mps[0], generated.accel_mps2[0]) == (10.0, 0.0)
    assert generated.speed_mps[1] > 10.0
    assert (generated.curvature_per_m[1], generated.curvature_rate_per_m_s[1]) == (0.02, 0.0)
    assert generated.curvature_per_m[0] > 0.02


def test_axes_without_a_profile_pass_through() -> None:
    _, reference = driving(10.0, 8)
    reference = Reference(*(column + 0.001 for column in reference))
    wanted = setpoints(8, lateral=Lateral.LATCH_LAST, target_speed_mps=20.0, target_curvature_per_m=0.1)
    wanted = wanted._replace(longitudinal=np.array(Longitudinal, np.uint8))
    generated, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    governed, _ = profile_axes(wanted)
    assert not failed.any()
    assert governed.tolist() == [True, False, True, False, False, False, False, False]
    np.testing.assert_array_equal(generated.speed_mps == reference.speed_mps, ~governed)
    np.testing.assert_array_equal(generated.curvature_per_m, reference.curvature_per_m)


def test_a_nan_in_an_axis_without_a_profile_is_no_failure() -> None:
    _, reference = driving(10.0, 2)
    wanted = setpoints(2, longitudinal=Longitudinal.DRIVER, lateral=Lateral.DRIVER)
    wanted.target_speed_mps[0] = np.nan
    _, failed = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert not failed.any()


@pytest.mark.parametrize("decel", [0.0, np.nan, np.inf, -2.0])
def test_a_controlled_stop_never_falls_out_for_a_bad_deceleration_xgv_36(decel: float) -> None:
    _, reference = driving(10.0)
    wanted = setpoints(1, longitudinal=Longitudinal.CONTROLLED_STOP, decel_limit_mps2=decel)
    generated, failed = ReferenceGenerator().advance(reference, wanted, 1.0)
    assert failed.tolist() == [True]
    assert generated.speed_mps[0] == pytest.approx(7.5)


def test_a_speed_reference_never_crosses_zero_by_accident() -> None:
    _, reference = driving(0.3, 3)
    reference.accel_mps2[:] = -3.0
    wanted = setpoints(3)
    generator = ReferenceGenerator()
    seen = []
    for _ in range(12):
        reference, _ = generator.advance(reference, wanted, 0.1)
        seen.append(reference.speed_mps[0])
    assert min(seen) == 0.0
    assert seen[-1] == 0.0


def test_a_fleet_may_grow_between_steps() -> None:
    reference, wanted = _spread(140, seed=11)
    generator = ReferenceGenerator()
    small, _ = generator.advance(_first(reference, 32), _first(wanted, 32), 0.1)
    grown, _ = generator.advance(reference, wanted, 0.1)
    np.testing.assert_array_equal(small.speed_mps, grown.speed_mps[:32])


def test_columns_of_different_length_are_refused() -> None:
    """ruckig would read past the end of a short list."""
    reference, wanted = _spread(4, seed=12)
    with pytest.raises(ValueError, match="expected one shape"):
        ReferenceGenerator().advance(reference, _first(wanted, 3), 0.1)


def test_the_reference_waits_for_a_car_that_cannot_keep_up() -> None:
    motion, followed = driving(20.0)
    _, generated = driving(26.0)
    after = merged(generated, followed, setpoints(1), motion)
    assert after.speed_mps.tolist() == [22.0]
    after = merged(generated, followed, setpoints(1, longitudinal=Longitudinal.OPEN_LOOP), motion)
    assert after.speed_mps.tolist() == [20.0]


def test_inputs_are_not_written_to() -> None:
    _, reference = at_rest(4)
    wanted = setpoints(4, target_speed_mps=5.0, target_curvature_per_m=0.1)
    for column in (*reference, *wanted):
        column.flags.writeable = False
    generated, _ = ReferenceGenerator().advance(reference, wanted, 0.1)
    assert (generated.speed_mps > 0.0).all()


def _first(columns: Reference | Setpoints, count: int) -> Reference | Setpoints:
    return type(columns)(*(column[:count] for column in columns))
