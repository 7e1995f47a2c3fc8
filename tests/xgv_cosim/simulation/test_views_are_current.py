"""What a stack is told of its car's modes is made anew only where something changed; nothing is missed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import xgv_cosim
from xgv_cosim.actuation import Gear
from xgv_cosim.perception import ModeView
from xgv_cosim.simulation.views import mode_view, note_changes

if TYPE_CHECKING:
    from xgv_cosim.endpoint import StackMessage
    from xgv_cosim.observation import Observation


@pytest.mark.parametrize(
    "injections",
    [
        ["*@1.03 estop_pause", "*@4 override"],
        ["*@1.5 estop_disable"],
        ["*@1.2 door duration_s=1", "*@3 emo"],
        ["*@1.2 link duration_s=2", "*@6 error code=9109"],
        ["*@1.2 frozen duration_s=2", "*@2 shutdown"],
    ],
)
def test_a_kept_view_is_what_a_new_one_would_be(injections: list[str]) -> None:
    told = set()
    with xgv_cosim.simulate("hello", inject=injections) as sim:
        while sim.now_s < 8.0:
            sim.step()
            for vehicle, _ in sim.state.vehicles.linked:
                view = vehicle.last_view
                assert view is not None
                told.add((view.safety_mode, view.reasons))
                if vehicle.is_computing:
                    vehicle.is_viewed = False
                    assert mode_view(sim.state, vehicle) == view
    assert len(told) > 1


class Silent:
    """A stack that never says a word."""

    def act(self, observation: Observation) -> list[StackMessage]:
        return []


def test_of_a_car_to_which_nothing_happens_the_view_is_kept() -> None:
    stack = f"{__name__}:Silent"
    with xgv_cosim.simulate("hello", set=[f"bind.0.stack={stack}"], inject=["*@6.03 door"]) as sim:
        views: list[ModeView | None] = []
        while sim.now_s < 8.0:
            sim.step()
            views += [vehicle.last_view for vehicle, _ in sim.state.vehicles.linked[:1]]
    seen = [view for number, view in enumerate(views) if number == 0 or view is not views[number - 1]]
    assert len(views) > 70
    assert 1 < len(seen) < 8
    assert seen[-1] is not None
    assert "door" in " ".join(seen[-1].reasons)


def test_what_changes_without_a_call_and_what_is_called_without_a_change_are_both_told_anew() -> None:
    """A gear that engages within a step touches nobody; who calls an endpoint may have changed a reason."""
    with xgv_cosim.simulate("hello", set=[f"bind.0.stack={__name__}:Silent"]) as sim:
        sim.run_until(2.0)
        one, other = [vehicle for vehicle, _ in sim.state.vehicles.linked]
        note_changes(sim.state)
        assert (one.is_viewed, other.is_viewed) == (True, True)
        sim.fleet.motion.gear[one.slot] = Gear.NEUTRAL
        note_changes(sim.state)
        assert (one.is_viewed, other.is_viewed) == (False, True)
        assert mode_view(sim.state, one).devices.gear == Gear.NEUTRAL
        note_changes(sim.state)
        assert one.is_viewed
        sim.state.alarms.touch(other)
        note_changes(sim.state)
        assert (one.is_viewed, other.is_viewed) == (True, False)
