"""Re-arming after a stop, over every cause and every value of its key (XGV-37)."""

from __future__ import annotations

from itertools import product

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.xgv.rearm import (
    PRESETS,
    Rearm,
    RearmCause,
    Rearming,
    RearmPreset,
    RearmSettings,
)


@pytest.mark.parametrize(("cause", "wanted"), list(product(RearmCause, Rearm)))
def test_each_cause_with_each_value(cause: RearmCause, wanted: Rearm) -> None:
    rearming = Rearming(RearmSettings(**{cause.value: wanted}))
    standby = rearming.follow({cause})
    assert bool(standby) == (wanted is not Rearm.AUTO)
    assert bool(rearming.refusal) == (wanted is not Rearm.AUTO)
    assert rearming.rearm() == ()  # it lasts: the operator cannot re-arm yet
    assert rearming.follow({cause}) == ""  # once, not at every tick
    assert rearming.follow(set()) == ""
    assert bool(rearming.refusal) == (wanted is Rearm.OPERATOR)
    assert rearming.rearm() == ((cause,) if wanted is Rearm.OPERATOR else ())
    assert rearming.refusal == ""
    assert bool(rearming.follow({cause})) == (wanted is not Rearm.AUTO)  # and the next time again


@pytest.mark.parametrize("wanted", list(Rearm))
def test_a_preemption_strikes_and_does_not_last_xgv_66(wanted: Rearm) -> None:
    rearming = Rearming(RearmSettings(preemption=wanted))
    assert bool(rearming.strike(RearmCause.PREEMPTION)) == (wanted is not Rearm.AUTO)
    assert bool(rearming.refusal) == (wanted is Rearm.OPERATOR)
    rearming.rearm()
    assert rearming.refusal == ""


def test_two_causes_hold_until_both_are_gone() -> None:
    rearming = Rearming(RearmSettings(preset=RearmPreset.CONSERVATIVE))
    assert "e-stop pause" in rearming.follow({RearmCause.ESTOP_PAUSE})
    assert "door" in rearming.follow({RearmCause.ESTOP_PAUSE, RearmCause.DOOR})
    rearming.follow({RearmCause.DOOR})
    assert rearming.refusal == "Resume is refused: the open door or liftgate lasts"
    rearming.follow(set())
    assert rearming.refusal == ""


def test_literal_is_the_default_and_all_auto() -> None:
    assert RearmSettings().preset is RearmPreset.LITERAL
    assert {RearmSettings().of(cause) for cause in RearmCause} == {Rearm.AUTO}


def test_conservative_asks_something_after_every_cause() -> None:
    conservative = PRESETS[RearmPreset.CONSERVATIVE]
    assert Rearm.AUTO not in conservative.values()
    assert conservative[RearmCause.DISABLE] is Rearm.OPERATOR


def test_a_key_of_its_own_beats_the_preset() -> None:
    settings = RearmSettings(preset=RearmPreset.CONSERVATIVE, door=Rearm.AUTO)
    assert settings.of(RearmCause.DOOR) is Rearm.AUTO
    assert settings.of(RearmCause.ERROR) is Rearm.RESUME_AFTER_RELEASE


@pytest.mark.parametrize("wrong", [{"preset": "lax"}, {"door": "never"}])
def test_unknown_values_are_named(wrong: dict[str, str]) -> None:
    with pytest.raises(ScenarioError, match="expected one of"):
        RearmSettings(**wrong)


def test_plain_words_become_members_and_a_preset_is_needed_xgv_37() -> None:
    settings = RearmSettings(preset="conservative", door="operator")  # type: ignore[arg-type]
    assert isinstance(settings.preset, RearmPreset)
    assert isinstance(settings.door, Rearm)
    assert settings.disable is None
    with pytest.raises(ScenarioError, match=r"rearm\.preset: got None"):
        RearmSettings(preset=None)  # type: ignore[arg-type]
