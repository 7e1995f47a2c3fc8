"""Injections that wait for a place, a speed, a gap or another vehicle's mode."""

from __future__ import annotations

from dataclasses import replace

import pytest

import xgv_cosim
from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from xgv_cosim.condition import Condition, Disc
from xgv_cosim.injection import Injection, InjectionKind
from xgv_cosim.simulation import Simulation

DOOR = InjectionKind.DOOR


def door_when(
    condition: Condition, *vehicles: str, from_tick: int = 0, lasts: int | None = None
) -> Injection:
    end_tick = None if lasts is None else from_tick + lasts
    return replace(injection(from_tick, DOOR, *vehicles, end_tick=end_tick), condition=condition)


def doors(run: Simulation, *kinds: str) -> list[tuple[float, str, str]]:
    return [
        (event.t_s, event.vehicle, event.kind)
        for event in run.state.journal.events
        if event.kind in (kinds or ("injection",))
    ]


def test_each_vehicle_meets_a_place_by_itself_and_once() -> None:
    """Front bumpers pass 100 m at different times; both stay beyond it, and nothing acts a second time."""
    run = simulation(
        {"a": Car(20.0), "b": Car(10.0)},
        [door_when(Condition(lanes="lane", position_above_m=100.0), "a", "b", lasts=50)],
    )
    passed: dict[str, float] = {}
    with run:
        while run.now_s < 20.0:
            snapshot = run.step()
            for name, row in snapshot.index_of.items():
                if snapshot.lane_position_m[row] > 100.0:
                    passed.setdefault(name, round(run.now_s, 2))
    begun = {name: t_s for t_s, name, _ in doors(run) if t_s in passed.values()}
    assert begun == passed
    assert passed["a"] < passed["b"]
    assert len(doors(run)) == 4  # each begins once and ends once
    ends = {name: t_s for t_s, name, _ in doors(run)}
    assert ends == {name: pytest.approx(t_s + 0.5) for name, t_s in passed.items()}


def test_what_is_met_at_the_end_of_a_step_acts_on_the_next_tick() -> None:
    run = simulation({"a": Car(20.0)}, [door_when(Condition(speed_above_mps=5.0), "a")])
    with run:
        run.run_until(0.5)
        assert doors(run, "condition_met", "injection") == [
            (0.1, "a", "condition_met"),
            (0.1, "a", "injection"),
        ]
        assert run.vehicle("a").mode == "software_pause"


@pytest.mark.parametrize(
    "condition",
    [
        Condition(speed_above_mps=25.0),
        Condition(speed_below_mps=5.0),
        Condition(gap_below_m=50.0),  # nobody ahead
        Condition(lanes="ramp_*"),
        Condition(lanes="lane", position_above_m=1e5),
        Condition(near=Disc(0.0, 500.0, 100.0)),
        Condition(other=("nobody", "estop_pause")),
        Condition(other=("a", "estop_pause")),
        Condition(speed_above_mps=5.0, lanes="ramp_*"),  # one of the two holds
    ],
)
def test_what_never_holds_never_acts(condition: Condition) -> None:
    run = simulation({"a": Car(20.0)}, [door_when(condition, "a")])
    with run:
        run.run_until(3.0)
    assert doors(run, "condition_met", "injection") == []


@pytest.mark.parametrize(
    "condition",
    [
        Condition(speed_above_mps=15.0),
        Condition(speed_below_mps=25.0),
        Condition(lanes="la*"),
        Condition(lanes="lane", position_above_m=10.0),
        Condition(near=Disc(60.0, 0.0, 20.0)),
        Condition(other=("b", "drive_by_wire")),
        Condition(speed_above_mps=5.0, speed_below_mps=30.0, lanes="lane"),
    ],
)
def test_what_holds_acts(condition: Condition) -> None:
    run = simulation({"a": Car(20.0), "b": Car(10.0)}, [door_when(condition, "a")])
    with run:
        run.run_until(8.0)
    assert [name for _, name, _ in doors(run)] == ["a"]
    (met,) = [event for event in run.state.journal.events if event.kind == "condition_met"]
    assert met.reasons == condition.words()


def test_it_waits_from_its_time_on() -> None:
    run = simulation({"a": Car(20.0)}, [door_when(Condition(speed_above_mps=5.0), "a", from_tick=250)])
    with run:
        run.run_until(4.0)
    assert [t_s for t_s, _, _ in doors(run)] == [2.5]


def test_another_vehicles_mode_carries_from_car_to_car() -> None:
    """A pause of ``a`` opens the door of ``b``, which opens the door of ``c`` one world step later."""
    run = simulation(
        {"a": Car(10.0), "b": Car(10.0), "c": Car(10.0)},
        [
            injection(203, InjectionKind.ESTOP_PAUSE, "a"),
            door_when(Condition(other=("a", "estop_pause")), "b"),
            door_when(Condition(other=("b", "software_pause")), "c", from_tick=200),
        ],
    )
    with run:
        run.run_until(4.0)
    assert [(t_s, name) for t_s, name, kind in doors(run, "condition_met")] == [(2.1, "b"), (2.2, "c")]


def test_a_gap_in_real_traffic() -> None:
    """Scenario hello: ``xgv_0`` is paused at 5 s, ``car_0`` closes up behind it."""
    with xgv_cosim.simulate("hello", bind=["car_0"], inject=["*@gap_below_m=15 door"]) as run:
        while not doors(run, "condition_met"):
            before = run.snapshot
            run.step()
            assert run.now_s < 20.0
        after = run.snapshot
    assert doors(run, "condition_met") == [(pytest.approx(run.now_s), "car_0", "condition_met")]
    gaps = [snapshot.leader_gap_m[snapshot.index_of["car_0"]] for snapshot in (before, after)]
    assert gaps[0] >= 15.0 > gaps[1]
