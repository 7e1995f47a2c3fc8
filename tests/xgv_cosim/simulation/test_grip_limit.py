"""The friction circle's cap on curvature: who drives wider than steered is told, from when to when."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from jaus.address import JausAddress
from tests.xgv_cosim.kernel.fleets import Drive
from tests.xgv_cosim.simulation.bare_world import BareWorld, Car, HoldsSpeed
from xgv_cosim.actuation import CouplingKind, Lateral, Longitudinal
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.events import Event
from xgv_cosim.fleet_columns import is_limited_by_grip
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.observation import Observation
from xgv_cosim.parameters import VehicleParameters
from xgv_cosim.simulation import Binding, Simulation
from xgv_cosim.vehicles.xgv.profile import XgvProfile

KIND = "curvature_limited_by_grip"
BEND = (2.03, 4.0)


class Swerves(HoldsSpeed):
    """Asks for a bend between two times, then for straight on."""

    def act(self, seen: Observation) -> list[StackMessage]:
        bend = 0.05 if BEND[0] <= seen.time_s + 0.05 < BEND[1] else 0.0
        rest: Sequence[StackMessage] = super().act(seen)[:-1]
        return [*rest, MotionProfile(self._speed_mps, 2.0, bend, 0.1, 0.4)]


def run(friction: float, step_s: float = 0.1, until_s: float = 8.0) -> Simulation:
    profile, cars = XgvProfile(), {"a": Car(12.0), "b": Car(12.0, y_m=50.0)}

    def binding(name: str) -> Binding:
        def link(_: str, address: JausAddress) -> InProcessLink:
            return InProcessLink((Swerves if name == "a" else HoldsSpeed)(address, 12.0), address)

        return Binding(
            profile, VehicleParameters(friction=friction), coupling=CouplingKind.FREE, new_link=link
        )

    bindings = {name: binding(name) for name in cars}
    simulation = Simulation(BareWorld(cars, step_s), lambda who: bindings[who.vehicle_id], step_s=step_s)
    limited = []
    while simulation.now_s < until_s - 1e-9:
        simulation.step()
        limited.append(bool(is_limited_by_grip(simulation.fleet.motion)[simulation.fleet.slot_of("a")]))
    rows = told(simulation)
    at_end = [sum(e.t_s < (k + 1) * step_s - 1e-9 for e in rows) % 2 == 1 for k in range(len(limited))]
    assert limited == at_end
    return simulation


def told(simulation: Simulation) -> list[Event]:
    return [event for event in simulation.state.journal.events if event.kind == KIND]


def test_a_bend_on_snow_is_an_event_that_begins_and_ends_xgv_71() -> None:
    begin, end = told(run(0.2))
    assert (begin.vehicle, begin.before, begin.after) == ("a", "", "wider than steered")
    assert (end.vehicle, end.before, end.after) == ("a", "wider than steered", "")
    assert "the tyres give 2.0 m/s² sideways" in begin.reasons[0]
    assert end.reasons == (f"lasted {end.t_s - begin.t_s:.2f} s",)
    assert 2.0 < begin.t_s < end.t_s < 6.0


def test_on_a_dry_road_the_same_bend_is_none() -> None:
    assert told(run(0.85)) == []


def test_its_ticks_do_not_depend_on_the_world_step_xgv_71() -> None:
    """The begin lies between two world steps; the commands of this stack come with the step."""
    coarse, fine = run(0.2, 0.1), run(0.2, 0.05)
    begins = [told(simulation)[0].t_s for simulation in (coarse, fine)]
    assert any(abs(t_s / 0.1 - round(t_s / 0.1)) > 0.05 for t_s in begins)
    for simulation in (coarse, fine):
        times = [event.t_s for event in simulation.state.journal.events]
        assert times == sorted(times)


def test_whoever_is_released_meanwhile_has_its_end_told() -> None:
    simulation = run(0.2, until_s=3.0)
    assert len(told(simulation)) == 1
    simulation.release("a")
    assert told(simulation)[-1].before == "wider than steered"
    assert told(simulation)[-1].t_s == pytest.approx(3.0)


def test_the_columns_say_for_how_long_and_since_when() -> None:
    """On its own ticks inside a call of the kernel; braking and turning share one circle."""
    drive = Drive.at(20.0, friction=0.3)
    drive.motion.steer_rad[:] = 0.1
    drive.for_s(1.0, ticks=1, longitudinal=Longitudinal.HOLD, brake=0.0, lateral=Lateral.LATCH_LAST)
    limited, free = drive.column("grip_limited_s"), drive.column("grip_free_s")
    first = int(np.flatnonzero(limited > 0.0)[0])
    assert 0 < first < 50
    np.testing.assert_allclose(limited[first:], 0.01 * np.arange(1, len(limited) - first + 1))
    np.testing.assert_allclose(free[:first], 0.01 * np.arange(first))
    assert (free[first:] == 0.0).all()
    lateral = np.abs(drive.column("curvature_per_m")) * drive.column("speed_mps") ** 2
    assert lateral[-1] == pytest.approx(0.3 * 9.81, rel=0.02)
    lasted = limited[-1]
    drive.for_s(1.0, ticks=100, lateral=Lateral.OPEN_LOOP, steer_rad=0.0, longitudinal=Longitudinal.HOLD)
    assert 0.0 < drive.motion.grip_free_s[0] < 1.0
    assert drive.motion.grip_limited_s[0] + drive.motion.grip_free_s[0] == pytest.approx(lasted + 1.0)
