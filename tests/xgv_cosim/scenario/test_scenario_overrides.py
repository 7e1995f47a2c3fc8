"""``--set dotted.key=value`` changes a scenario before it is checked."""

from __future__ import annotations

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.scenario.overrides import apply_overrides


def test_values_are_read_as_yaml_and_lists_by_index():
    scenario = load_scenario(
        "hello",
        ["seed=7", "injections.0.at_s=4.5", "bind.0.vehicles={share: 0.5, seed: 2}", "xgv.pause.decel_mps2=3",
         "expect=[]", "world.sumo.options=[--step-log.period, '10']"],
    )  # fmt: skip
    assert scenario.seed == 7
    assert scenario.injections[0].at_s == 4.5
    assert scenario.bind[0].vehicles.share == 0.5
    assert scenario.xgv.settings().pause_decel_mps2 == 3.0
    assert scenario.expect == ()
    assert scenario.world.sumo.options == ("--step-log.period", "10")
    assert scenario.source.overrides[0] == "seed=7"


@pytest.mark.parametrize(
    ("option", "expected"),
    [
        ("seed", "--set seed: expected dotted.key=value"),
        ("=3", "--set =3: expected dotted.key=value"),
        ("a..b=3", "expected dotted.key=value"),
        ("seed=x", "--set seed=x: seed: got 'x', expected a whole number"),
        ("sed=3", "--set sed=3: sed: unknown key (did you mean 'seed'?)"),
        ("seed=[1", "--set seed=[1: seed: the value is not valid YAML"),
        ("injections.1.at_s=3", "injections.1.at_s: 'injections' has entries 0 to 0; there is no entry 1"),
        ("injections.first.at_s=3", "give the number of an entry, counted from 0, not 'first'"),
        ("seed.x=3", "seed.x: 'seed' is the value 1 and has no keys"),
        ("injections.0.at_s=99", "--set injections.0.at_s=99: injections.0.at_s: got 99, but the run ends"),
        ("xgv.pause.decel_mps2=.nan", "xgv.pause.decel_mps2: got nan, expected a finite number"),
    ],
)
def test_a_wrong_option_is_named(option, expected):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("hello", [option])
    assert len(caught.value.problems) == 1
    assert expected in caught.value.problems[0]


def test_the_last_of_two_options_counts_and_the_data_itself_stays():
    data = {"a": [{"b": 1}], "c": None}
    changed, applied, problems = apply_overrides(data, ["a.0.b=2", "a.0.b=3", "c.d=4"])
    assert changed == {"a": [{"b": 3}], "c": {"d": 4}}
    assert data == {"a": [{"b": 1}], "c": None}
    assert [override.path for override in applied] == [("a", 0, "b"), ("a", 0, "b"), ("c", "d")]
    assert problems == []
