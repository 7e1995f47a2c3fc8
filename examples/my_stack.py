"""A stack of one's own: keeps its lane at a constant speed. In a scenario: ``stack: "my_stack:MyStack"``."""

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import CommandStatus, RequestControl, StackMessage
from xgv_cosim.observation import Observation

DRIVERS = (ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER)


class MyStack:
    def __init__(self, address: JausAddress, speed_mps: float = 10.0) -> None:
        self.address, self.speed_mps = address, speed_mps

    def act(self, seen: Observation) -> list[StackMessage]:
        messages: list[StackMessage] = []
        if seen.component_controller[ComponentId.MOTION_PROFILE_DRIVER] != self.address:
            messages.append(RequestControl(ComponentId.MOTION_PROFILE_DRIVER))
        waiting = [part for part in DRIVERS if seen.component_status[part] == ComponentStatus.STANDBY]
        messages.extend(CommandStatus(part, StatusCommand.RESUME) for part in waiting)
        ahead = [(x, y) for x, y in seen.lane_ahead_m if x > 10.0] or [(10.0, 0.0)]
        x, y = ahead[0]  # the arc to that point has the curvature 2 y / d^2
        speed = 0.0 if seen.leader_gap_m < 2.0 * self.speed_mps else self.speed_mps
        messages.append(MotionProfile(speed, 2.0, 2.0 * y / (x * x + y * y), 0.1, duration_s=0.4))
        return messages
