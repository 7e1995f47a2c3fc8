"""Sections ``safestop`` and ``xgv.rearm``: the same defaults and ranges as the profile, and the way there."""

from __future__ import annotations

import json
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from xgv_cosim.errors import ScenarioError
from xgv_cosim.scenario.building import profile_of
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.scenario.safestop_section import SafeStopSection
from xgv_cosim.scenario.xgv_section import RearmSection
from xgv_cosim.vehicles.xgv.rearm import Rearm, RearmCause, RearmPreset, RearmSettings
from xgv_cosim.vehicles.xgv.safestop import SafeStopReaction, SafeStopSettings

NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 0.01, 0.05, 0.5, 0.999, 1.0, 10.0, 10.001, 60.0, 60.01]),
)


def test_defaults_are_those_of_the_profile_xgv_37_xgv_42():
    assert SafeStopSection().settings() == SafeStopSettings()
    assert RearmSection().settings() == RearmSettings()
    assert set(SafeStopSection.model_fields) == {field.name for field in fields(SafeStopSettings)}
    assert set(RearmSection.model_fields) == {field.name for field in fields(RearmSettings)}


@given(
    frame_period_s=NUMBERS, latency_s=NUMBERS, loss_share=NUMBERS, link_timeout_s=NUMBERS,
    link_loss=st.sampled_from(SafeStopReaction), receiver_dead=st.sampled_from(SafeStopReaction),
)  # fmt: skip
def test_the_safestop_section_accepts_what_the_profile_accepts_xgv_42(**data):
    try:
        expected = SafeStopSettings(**data)
    except ScenarioError:
        with pytest.raises(ValidationError):
            SafeStopSection.model_validate_json(json.dumps(data))
    else:
        assert SafeStopSection.model_validate_json(json.dumps(data)).settings() == expected


def test_the_keys_reach_the_profile_and_its_ledger_xgv_37_xgv_42():
    scenario = load_scenario(
        "hello", ["safestop.latency_s=0.1", "xgv.rearm.preset=conservative", "xgv.rearm.door=auto", "seed=7"]
    )
    profile = profile_of(scenario)
    assert profile.seed == 7
    assert profile.settings.safestop.latency_s == 0.1
    assert profile.settings.rearm.of(RearmCause.DOOR) is Rearm.AUTO
    assert profile.settings.rearm.of(RearmCause.ERROR) is Rearm.RESUME_AFTER_RELEASE
    values = {row.key: row.value for row in profile.assumptions()}
    assert values["safestop.latency_s"] == "0.1"
    assert values["xgv.rearm.preset"] == RearmPreset.CONSERVATIVE
    assert values["xgv.rearm.disable"] == "operator"
    assert values["xgv.rearm.door"] == "auto"


def test_every_report_names_the_preset_xgv_37():
    """The preset has its row in every ledger; it counts as exercised when a car was re-armed."""
    (row,) = [
        row for row in profile_of(load_scenario("hello")).assumptions() if row.key == "xgv.rearm.preset"
    ]
    assert (row.value, row.facts) == ("literal", ("rearmed",))


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("safestop.link_timeout_s=0.01", "frame_period_s"),
        ("safestop.loss_share=1", "less than 1"),
        ("xgv.rearm.door=sometimes", "resume_after_release"),
        ("xgv.rearm.preset=strict", "conservative"),
    ],
)
def test_wrong_values_are_named_with_what_is_expected(override, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("hello", [override])
