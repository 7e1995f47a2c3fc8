"""``world.environment``, ``bind.plant`` and ``xgv.engine``: from the scenario to the vehicle's parameters."""

from __future__ import annotations

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.parameters import VehicleParameters, load_preset
from xgv_cosim.scenario.building import parameters_of, profile_of
from xgv_cosim.scenario.loading import load_scenario


def _parameters(*overrides: str) -> VehicleParameters:
    scenario = load_scenario("hello", list(overrides))
    return parameters_of(scenario.bind[0], scenario.world.environment)


def test_without_a_word_the_preset_counts() -> None:
    assert _parameters() == load_preset("ford_escape_hybrid")


def test_friction_and_grade_come_from_the_environment_and_a_bind_row_has_the_last_word() -> None:
    wet = ("world.environment.friction=0.5", "world.environment.grade=0.04")
    assert (_parameters(*wet).friction, _parameters(*wet).grade) == (0.5, 0.04)
    own = (*wet, "bind.0.plant.friction=0.2", "bind.0.plant.grade=0.0")
    assert (_parameters(*own).friction, _parameters(*own).grade) == (0.2, 0.0)


def test_released_steering_is_a_key_of_each_binding_xgv_64() -> None:
    """``plant.released_steering = self_align | hold``."""
    assert _parameters().released_steering_self_aligns == 1.0
    assert _parameters("bind.0.plant.released_steering=hold").released_steering_self_aligns == 0.0


@pytest.mark.parametrize(
    "override",
    [
        "world.environment.friction=0",
        "world.environment.grade=0.5",
        "bind.0.plant.friction=2.0",
        "bind.0.plant.released_steering=spring",
    ],
)
def test_roads_that_are_none_are_refused(override: str) -> None:
    with pytest.raises(ScenarioError, match=override.split("=", maxsplit=1)[0].rsplit(".", maxsplit=1)[-1]):
        load_scenario("hello", [override])


def test_brake_authority_depends_on_the_engine_only_if_the_scenario_says_so_xgv_31() -> None:
    """``xgv.engine.brake_assist_lost``, default false."""
    assert not profile_of(load_scenario("hello")).stop_settings.brake_needs_engine
    lost = load_scenario("hello", ["xgv.engine.brake_assist_lost=true"])
    assert profile_of(lost).stop_settings.brake_needs_engine
