"""A gear is engaged, logged and in effect on its own tick, whatever the world step (XGV-70, XGV-71)."""

from __future__ import annotations

import pytest

from jaus.address import ComponentId
from jaus.component import StatusCommand
from tests.xgv_cosim.simulation.bare_world import Car, simulation
from xgv_cosim.actuation import Gear
from xgv_cosim.commands import DiscreteDevices, WrenchEffort
from xgv_cosim.endpoint import CommandStatus, RequestControl, StackMessage
from xgv_cosim.simulation import Simulation

PD = ComponentId.PRIMITIVE_DRIVER
BRAKED = WrenchEffort(throttle=0.0, brake=0.5, steering=0.0)
ASKED_S = 0.5


def engaged(run: Simulation) -> list[tuple[float, str, str, tuple[str, ...]]]:
    events = run.state.journal.events
    return [(e.t_s, e.before, e.after, e.reasons) for e in events if e.kind == "gear_engaged"]


def stand_and_shift(step_s: float, speed_mps: float = 0.0, **parameters: float) -> Simulation:
    """Brake in wrench efforts until the car stands, and command reverse at 0.5 s."""
    run = simulation({"car": Car(speed_mps)}, [], step_s=step_s, **parameters)
    run.state.vehicles.connect("car", None)
    car = run.vehicle("car")

    def say(*messages: StackMessage) -> None:
        for message in messages:
            car.send(message)
        run.step()

    say(RequestControl(PD, 6), CommandStatus(PD, StatusCommand.RESUME), BRAKED)
    while run.now_s < ASKED_S - 1e-9:
        say(BRAKED)
    say(DiscreteDevices(gear=Gear.REVERSE), BRAKED)
    while run.now_s < 3.0 - 1e-9:
        say(BRAKED)
    return run


@pytest.mark.parametrize("step_s", [0.01, 0.1, 0.5])
@pytest.mark.parametrize(
    ("standstill_s", "delay_s"), [(0.5, 1.0), (0.43, 1.0), (0.5, 0.97), (0.03, 0.04), (0.0, 0.02)]
)
def test_a_shift_is_logged_when_it_is_done_xgv_70_xgv_71(
    step_s: float, standstill_s: float, delay_s: float
) -> None:
    """Standstill and delay after the command, to the tick, in steps of 10 ms, 0.1 s and 0.5 s alike."""
    run = stand_and_shift(step_s, shift_standstill_s=standstill_s, shift_delay_s=delay_s)
    done_s = pytest.approx(ASKED_S + standstill_s + delay_s, abs=1e-6)
    assert [row[:3] for row in engaged(run)] == [(done_s, "drive", "reverse")]
    assert run.fleet.motion.gear[run.fleet.slot_of("car")] == Gear.REVERSE


def test_a_shift_that_waited_for_standstill_tells_its_time_to_the_tick_xgv_70_xgv_71() -> None:
    """Asked for while the car still rolls, it begins inside a world step; the stamp does not see the step."""
    rows = {step_s: engaged(stand_and_shift(step_s, speed_mps=3.0)) for step_s in (0.01, 0.1)}
    assert rows[0.01] == rows[0.1]
    ((engaged_s, _, _, reasons),) = rows[0.1]
    assert reasons == (f"waited {engaged_s - ASKED_S:.2f} s",)
    assert engaged_s > ASKED_S + 1.5
