"""What a component is before anybody speaks to it, and entries of its table that a talk does not show."""

from __future__ import annotations

import pytest

from jaus.address import JausAddress
from jaus.component import (
    CONTROL_TRANSITIONS,
    Component,
    ComponentStatus,
    ControlEffect,
    ControlInput,
    ControlReply,
    Situation,
)

OWN = JausAddress(1, 1, 33, 1)


def test_a_component_begins_in_initialize_and_in_nobodys_control_xgv_21() -> None:
    component = Component(OWN)
    assert component.address == OWN
    assert component.status is ComponentStatus.INITIALIZE
    assert component.control is None
    assert component.controller is None


@pytest.mark.parametrize("situation", [each for each in Situation if each is not Situation.SENDER_CONTROLS])
def test_a_release_of_anyone_but_the_controller_does_nothing_xgv_20(situation: Situation) -> None:
    """XGV-20: also in a situation that a release, which carries no authority, cannot come into."""
    assert CONTROL_TRANSITIONS[situation, ControlInput.RELEASE] == (ControlReply.NOTHING, ControlEffect.NONE)


@pytest.mark.parametrize("situation", [Situation.UNCONTROLLED, Situation.OTHER_OUTRANKED])
def test_whoever_takes_control_takes_it_with_his_own_authority_xgv_20(situation: Situation) -> None:
    _, effect = CONTROL_TRANSITIONS[situation, ControlInput.REQUEST]
    assert effect is ControlEffect.TAKE
