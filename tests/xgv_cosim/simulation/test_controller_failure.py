"""A controller without a usable reference pauses its own car, on the tick that shows it (XGV-21, XGV-71).

The command of a stack cannot hold a NaN, so it is put into the reference, in the middle of a world step.
"""

from __future__ import annotations

import math

import pytest

from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from xgv_cosim.injection import InjectionKind
from xgv_cosim.simulation import Simulation, safety
from xgv_cosim.simulation.state import RunState

FAILS_TICK = 203
"""Inside the world step from 2.0 s to 2.1 s."""


def drive(monkeypatch: pytest.MonkeyPatch, poisoned: str = "", column: str = "speed_mps") -> Simulation:
    """Drive three cars for 4 s; one of them loses its reference, another only cuts the step on that tick."""
    cars = {"failing": Car(12.0), "other": Car(15.0, y_m=5.0), "door": Car(10.0, y_m=10.0)}
    run = simulation(cars, [injection(FAILS_TICK, InjectionKind.DOOR, "door")])
    meet_deadlines = safety.meet_deadlines

    def poison(state: RunState) -> None:
        if state.clock.tick == FAILS_TICK and poisoned:
            getattr(state.fleet.reference, column)[state.fleet.slot_of(poisoned)] = math.nan
        meet_deadlines(state)

    monkeypatch.setattr(safety, "meet_deadlines", poison)
    run.run_until(4.0)
    return run


def told(run: Simulation, name: str) -> list[tuple[float, str, str]]:
    return [
        (event.t_s, event.kind, event.after)
        for event in run.state.journal.events
        if event.vehicle == name and event.t_s > 1.0
    ]


@pytest.mark.parametrize("column", ["speed_mps", "accel_mps2", "curvature_per_m", "curvature_rate_per_m_s"])
def test_a_failed_reference_pauses_on_its_own_tick_xgv_21_xgv_38_xgv_71(
    column: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Error 9156, the status of the driver and both modes, all on tick 203; and it is said once."""
    run = drive(monkeypatch, "failing", column)
    rows = told(run, "failing")
    assert {t_s for t_s, _, _ in rows} == {FAILS_TICK / 100}
    happened = [(kind, after) for _, kind, after in rows]
    assert happened.count(("controller_failed", "")) == 1
    assert ("error", "9156") in happened
    assert ("component_status", "Motion Profile Driver: failure") in happened
    assert ("ready_mode", "software_pause") in happened
    assert ("safety_mode", "software_pause") in happened


def test_a_failed_reference_brakes_from_its_tick_as_set_xgv_36_xgv_71(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As long a way as the car behind the door that is opened on the same tick, each from its own speed."""
    run = drive(monkeypatch, "failing")
    speeds = {name: run.vehicle(name).speed_mps for name in run.vehicle_ids}
    assert 12.0 - speeds["failing"] == pytest.approx(10.0 - speeds["door"], abs=0.02)
    assert 12.0 - speeds["failing"] == pytest.approx(2.5 * (4.0 - FAILS_TICK / 100), abs=0.6)


def test_a_failed_reference_touches_no_other_car_xgv_38(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as one:
        alone = drive(one)
    run = drive(monkeypatch, "failing")
    for name in ("other", "door"):
        assert told(run, name) == told(alone, name)
        assert run.vehicle(name).pose == alone.vehicle(name).pose
        assert run.vehicle(name).speed_mps == alone.vehicle(name).speed_mps
    assert told(run, "other") == []
