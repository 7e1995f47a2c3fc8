"""What happens inside a world step of 0.1 s happens on its own tick of 10 ms, wherever it lies (XGV-71)."""

from __future__ import annotations

from itertools import pairwise

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from tests.xgv_cosim.simulation.bare_world import Car, HoldsSpeed, injection, simulation
from xgv_cosim.commands import MotionProfile, WrenchEffort
from xgv_cosim.endpoint import CommandStatus, RequestControl, StackMessage
from xgv_cosim.injection import InjectionKind
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Observation
from xgv_cosim.simulation import Simulation
from xgv_cosim.vehicles.xgv.settings import XgvSettings

PD = ComponentId.PRIMITIVE_DRIVER
EDGES = [
    (InjectionKind.ESTOP_PAUSE, "estop_pause"),
    (InjectionKind.ESTOP_DISABLE, "estop_disable"),
    (InjectionKind.ESTOP_BUTTON, "estop_disable"),
    (InjectionKind.DOOR, "software_pause"),
    (InjectionKind.OVERRIDE, "manual_override"),
    (InjectionKind.EMO, "emergency_manual_override"),
    (InjectionKind.STEERING_UNINITIALISED, "software_pause"),
    (InjectionKind.INACTIVE, "inactive"),
]


class PressesPedals:
    """A stack in wrench efforts: a little throttle at every step."""

    def __init__(self, address: JausAddress) -> None:
        self._address = address

    def act(self, seen: Observation) -> list[StackMessage]:
        messages: list[StackMessage] = []
        if seen.component_controller[PD] != self._address:
            messages.append(RequestControl(PD, 6))
        if seen.component_status[PD] is ComponentStatus.STANDBY:
            messages.append(CommandStatus(PD, StatusCommand.RESUME))
        return [*messages, WrenchEffort(0.1, 0.0, 0.0)]


class Motions(HoldsSpeed):
    """Motions of 0.43 s, so that they end inside a world step."""

    def act(self, seen: Observation) -> list[StackMessage]:
        messages = super().act(seen)
        return [*messages[:-1], MotionProfile(12.0, 2.0, 0.0, 0.1, 0.43)]


def rows(run: Simulation, kind: str) -> list[tuple[float, str]]:
    events = run.state.journal.events
    return [(event.t_s, event.after) for event in events if event.kind == kind and event.t_s > 1.0]


@pytest.mark.parametrize(("kind", "mode"), EDGES)
def test_device_edges_change_the_mode_on_each_tick_of_a_step(kind: InjectionKind, mode: str) -> None:
    """Ten cars in one run, each 10 ms later than the one before; each in its own segment of the step."""
    cars = {f"car_{late}": Car(12.0, x_m=50.0 * late) for late in range(10)}
    run = simulation(cars, [injection(200 + late, kind, f"car_{late}") for late in range(10)])
    run.run_until(2.3)
    seen = {
        event.vehicle: (event.t_s, event.after)
        for event in run.state.journal.events
        if event.kind == "safety_mode" and event.t_s > 1.0
    }
    assert seen == {f"car_{late}": (pytest.approx(2.0 + late / 100), mode) for late in range(10)}
    if mode == "estop_disable":  # and so do the brakes: 10 ms more of way at speed, each
        ways = [run.vehicle(name).pose.x_m - 50.0 * late for late, name in enumerate(cars)]
        gains = [after - before for before, after in pairwise(ways)]
        assert gains == sorted(gains, reverse=True)
        assert all(0.0 < gain < 0.03 for gain in gains)


@pytest.mark.parametrize(
    ("stack", "code", "gone_s"), [(PressesPedals, "9158", 3.0 + 0.37), (Motions, "9157", 3.0 + 0.43)]
)
def test_command_time_outs_act_on_their_tick_xgv_43(stack: type, code: str, gone_s: float) -> None:
    """The last command is that of 3.00 s; error and pause come in the middle of a step, together."""
    lost = injection(304, InjectionKind.CMD_LOSS, "car", end_tick=407)
    run = simulation({"car": Car(12.0)}, [lost], XgvSettings(wrench_timeout_s=0.37))
    address = JausAddress(1, 2, 2, 1)
    arguments = (address,) if stack is PressesPedals else (address, 12.0)
    run.state.vehicles.connect("car", InProcessLink(stack(*arguments), address))
    run.run_until(5.0)
    assert rows(run, "error") == [(pytest.approx(gone_s), code), (4.1, "")]
    assert rows(run, "safety_mode") == [(pytest.approx(gone_s), "software_pause"), (4.1, "drive_by_wire")]
