"""The in-process link: order, lockstep, and stacks that raise."""

from __future__ import annotations

import math

from jaus.address import ComponentId, JausAddress
from tests.xgv_cosim.autonomy.test_reference_stack import seen
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import ReleaseControl, RequestControl, StackMessage
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Observation

ME = JausAddress(1, 2, 2, 1)


class TwoMessages:
    def act(self, observation: Observation) -> list[StackMessage]:
        return [
            RequestControl(ComponentId.MOTION_PROFILE_DRIVER),
            ReleaseControl(ComponentId.PRIMITIVE_DRIVER),
        ]


class NotANumber:
    """A stack whose planner divided zero by zero."""

    def act(self, observation: Observation) -> list[StackMessage]:
        return [MotionProfile(math.nan, 1.0, 0.0, 0.1, 0.4)]


def test_messages_arrive_once_in_order_with_their_sender() -> None:
    link = InProcessLink(TwoMessages(), ME)
    assert link.poll() == []
    link.send(seen())
    assert [type(received.message) for received in link.poll()] == [RequestControl, ReleaseControl]
    assert link.poll() == []
    link.send(seen())
    link.close()
    assert link.poll() == []


def test_a_nan_command_is_reported_and_never_sent() -> None:
    link = InProcessLink(NotANumber(), ME)
    link.send(seen())
    assert link.poll() == []
    (fault,) = link.take_faults()
    assert "MotionProfile.speed_mps: got nan" in fault
    assert link.take_faults() == []
