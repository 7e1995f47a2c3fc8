"""The scenario as data: round trips, defaults, the schema, and agreement with what it configures."""

from __future__ import annotations

import io
import json
from typing import get_args

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from ruamel.yaml import YAML

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.loading import load_scenario, scenario_from_mapping
from xgv_cosim.scenario.model import ModeName, Scenario, json_schema
from xgv_cosim.scenario.units import unit_words, without_unit
from xgv_cosim.scenario.xgv_section import XgvSection
from xgv_cosim.vehicles.xgv.settings import BothClients, ErrorLatch, Firmware, PauseSteering, XgvSettings


@pytest.mark.parametrize("name", ["hello", "freeway_estop"])
@pytest.mark.parametrize("carrier", ["json", "yaml"])
def test_a_lock_file_gives_the_same_scenario(name, carrier):
    scenario = load_scenario(
        name, ["bind.0.vehicles={type: xgv, share: 0.5}", "injections.0.vehicles=[xgv_0, xgv_1]"]
    )
    mapping = scenario.to_mapping()
    if carrier == "json":
        again = json.loads(json.dumps(mapping, allow_nan=False))
    else:
        buffer = io.StringIO()
        YAML(typ="safe", pure=True).dump(mapping, buffer)
        again = YAML(typ="safe", pure=True).load(buffer.getvalue())
    loaded = scenario_from_mapping(again, scenario.source.folder)
    assert loaded == scenario
    assert loaded.to_mapping() == mapping


def test_a_lock_file_writes_defaults_out_and_leaves_absent_keys_away():
    mapping = load_scenario("hello").to_mapping()
    assert mapping["schema"] == "xgv-cosim/scenario/1"
    assert mapping["bind"][0]["driver_reaction_s"] == 1.0
    assert mapping["xgv"]["pause"]["no_command_steering"] == "hold_curvature"
    assert "desired_speed_mps" not in mapping["bind"][0]
    assert set(mapping["expect"][0]) == {"vehicle", "mode", "by_s"}


def test_scenarios_differ_by_data_and_by_folder(tmp_path):
    scenario = load_scenario("hello")
    mapping = scenario.to_mapping()
    assert scenario_from_mapping(mapping, tmp_path) != scenario
    assert scenario_from_mapping({**mapping, "seed": 2}, scenario.source.folder) != scenario


def test_a_scenario_cannot_be_changed():
    with pytest.raises(ValidationError):
        load_scenario("hello").seed = 3


def test_constructing_one_directly_checks_it_as_a_whole():
    mapping = load_scenario("hello").to_mapping()
    mapping["duration_s"] = 3.0
    with pytest.raises(ValidationError, match=r"injections\.0\.at_s: got 5, but the run ends"):
        Scenario.model_validate_json(json.dumps(mapping))


def test_schema_is_valid_and_says_what_keys_mean():
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    injection = schema["$defs"]["InjectionSection"]
    assert injection["additionalProperties"] is False
    assert injection["properties"]["at_s"]["description"].startswith("When it begins, in seconds")
    for name, section in schema["$defs"].items():
        for key, value in section.get("properties", {}).items():
            target = schema["$defs"].get(value.get("$ref", "").rpartition("/")[2], {})
            assert "description" in {**target, **value}, f"{name}.{key} has no description"


@pytest.mark.parametrize(
    "change",
    [{"seed": "1"}, {"duration_s": -1}, {"colour": "red"}, {"bind": [{"vehicles": 7}]}, {"world": {}},
     {"injections": [{"at_s": 1, "vehicles": "a", "kind": "dor"}]}],
)  # fmt: skip
def test_schema_and_model_refuse_the_same(change):
    mapping = {**load_scenario("hello").to_mapping(), **change}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(json_schema()).validate(mapping)
    with pytest.raises(ScenarioError):
        scenario_from_mapping(mapping, ".")


def test_expected_modes_are_the_safety_modes_of_the_xgv():
    """XGV-26 to XGV-32."""
    assert set(get_args(ModeName)) == {mode.name.lower() for mode in SafetyMode}


def test_defaults_of_the_xgv_section_are_those_of_the_profile():
    assert XgvSection().settings() == XgvSettings()


LIMITS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 1e-9, 1.0, 1.0000001, 20.0, 20.000001, 60.0, 60.00001]),
)


@given(
    decel_mps2=LIMITS, hold_brake=LIMITS, timeout_s=LIMITS, period_s=LIMITS, initialize_s=LIMITS,
    steering=st.sampled_from(PauseSteering), both=st.sampled_from(BothClients), allow_both=st.booleans(),
)  # fmt: skip
def test_the_xgv_section_accepts_what_the_profile_accepts(
    decel_mps2, hold_brake, timeout_s, period_s, initialize_s, steering, both, allow_both
):
    """The ranges stand in the schema and in the profile; they must not drift apart."""
    data = {
        "pause": {"decel_mps2": decel_mps2, "hold_brake": hold_brake, "no_command_steering": steering},
        "control_mode": {"both_clients": both},
        "partial": {"allow_both": allow_both},
        "mpd": {"request_period_s": period_s},
        "wrench_timeout_s": timeout_s,
        "initialize_s": initialize_s,
    }
    try:
        expected = XgvSettings(
            decel_mps2, hold_brake, steering, both, timeout_s, allow_both, period_s, initialize_s
        )
    except ScenarioError:
        with pytest.raises(ValidationError):
            XgvSection.model_validate_json(json.dumps(data))
    else:
        assert XgvSection.model_validate_json(json.dumps(data)).settings() == expected


@given(
    timeout_s=LIMITS | st.sampled_from([3600.0, 3600.1]), latch=st.sampled_from(ErrorLatch),
    firmware=st.sampled_from(Firmware), brake=st.lists(st.sampled_from([9101, 9109, 9178, 42]), max_size=3),
    flags=st.tuples(st.booleans(), st.booleans(), st.booleans()),
)  # fmt: skip
def test_control_and_errors_accept_what_the_profile_accepts(timeout_s, latch, firmware, brake, flags):
    """XGV-31, XGV-34, XGV-38, XGV-53, XGV-65, XGV-70: the keys of the endpoint."""
    needs_control, allow_many, engine_off = flags
    data = {
        "control": {"controller_timeout_s": timeout_s},
        "errors": {"latch": latch, "effect": {"brake": brake}},
        "nonmotion": {"needs_control": needs_control},
        "motion": {"allow_many": allow_many},
        "disable": {"engine_off": engine_off},
        "firmware": firmware,
    }
    try:
        expected = XgvSettings(
            controller_timeout_s=timeout_s,
            errors_latch=latch,
            errors_effect_brake=tuple(brake),
            nonmotion_needs_control=needs_control,
            motion_allow_many=allow_many,
            disable_engine_off=engine_off,
            firmware=firmware,
        )
    except ScenarioError:
        with pytest.raises(ValidationError):
            XgvSection.model_validate_json(json.dumps(data))
    else:
        assert XgvSection.model_validate_json(json.dumps(data)).settings() == expected


@pytest.mark.parametrize(
    ("key", "stem", "words"),
    [("at_s", "at", "seconds"), ("at_ms", "at", None), ("decel_mps2", "decel", "m/s²"),
     ("decel_kmh", "decel", None), ("min_gap_m", "min_gap", "metres"), ("kind", "kind", None),
     ("rate_per_m_s", "rate", "1/m per second")],
)  # fmt: skip
def test_units_of_keys(key, stem, words):
    assert without_unit(key) == stem
    assert unit_words(key) == words
