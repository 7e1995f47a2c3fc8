"""Slots, sources and the journal, without any traffic."""

from __future__ import annotations

import numpy as np
import pytest

from jaus.address import ComponentId
from tests.xgv_cosim.simulation.bare_world import Car, simulation
from xgv_cosim.clock import Clock
from xgv_cosim.endpoint import ReleaseControl
from xgv_cosim.errors import ScenarioError, UnknownVehicleError
from xgv_cosim.fleet import Fleet
from xgv_cosim.injection import Injection, InjectionKind
from xgv_cosim.simulation import Journal
from xgv_cosim.simulation.devices import OPERATOR, Devices, Edge
from xgv_cosim.simulation.exchange import heading_ease
from xgv_cosim.simulation.reporting import note_world
from xgv_cosim.simulation.state import RunState
from xgv_cosim.snapshot import Collision, Snapshot
from xgv_cosim.traveller import Traveller


def test_a_vacated_slot_is_as_new_and_is_used_again() -> None:
    fleet, fresh = Fleet(), Fleet()
    slot = fleet.occupy("a")
    columns = {name: getattr(fleet, name) for name in fleet.__slots__ if name != "ids" and name[0] != "_"}
    for value in columns.values():
        for column in value if isinstance(value, tuple) else (value,):
            column[slot] = 1 if column[slot] == 0 else 0
    assert fleet.vacate("a") == slot
    for name, value in columns.items():
        kept, new = getattr(fleet, name), getattr(fresh, name)
        for column, other in zip(
            kept if isinstance(value, tuple) else (kept,),
            new if isinstance(value, tuple) else (new,),
            strict=True,
        ):
            np.testing.assert_array_equal(column, other, err_msg=name)
    assert fleet.occupy("b") == slot


def test_a_slot_is_idle_when_it_is_occupied_however_long_it_was_free() -> None:
    """A free slot is driven along and holds its brake; nobody begins with that."""
    fleet = Fleet()
    fleet.motion.brake[0], fleet.motion.grip_free_s[0], fleet.reference.accel_mps2[0] = 0.5, 9.0, 1.0
    assert fleet.occupy("a") == 0
    assert (fleet.motion.brake[0], fleet.motion.grip_free_s[0], fleet.reference.accel_mps2[0]) == (0, 0, 0)


def test_a_full_fleet_doubles_and_keeps_its_rows() -> None:
    fleet = Fleet()
    first = fleet.num_slots
    for number in range(first + 1):
        slot = fleet.occupy(f"car_{number}")
        fleet.motion.speed_mps[slot] = number
    assert fleet.num_slots == 2 * first
    assert fleet.motion.speed_mps[: first + 1].tolist() == list(range(first + 1))
    with pytest.raises(ScenarioError, match="bound already"):
        fleet.occupy("car_3")
    with pytest.raises(UnknownVehicleError, match="car_99"):
        fleet.vacate("car_99")


def test_sources_hold_together_and_patterns_choose_when_the_injection_begins() -> None:
    door = InjectionKind.DOOR
    devices = Devices(
        [
            Injection(5, door, ("a",), end_tick=9),
            Injection(6, door, matches=lambda who: who.type_id == "xgv", end_tick=8),
        ]
    )
    bound = [Traveller("a", "xgv"), Traveller("b", "xgv"), Traveller("c", "car")]
    assert devices.ticks_between(0, 100) == [5, 6, 8, 9]
    assert devices.due(5, bound) == [Edge("a", door, None, begins=True)]
    assert devices.due(6, bound) == [Edge("b", door, None, begins=True)]
    assert devices.acting_on("b") == ((door, None),)
    assert devices.change(OPERATOR, "b", door, begins=True) == []
    assert devices.due(8, [*bound, Traveller("d", "xgv")]) == []  # b is still held, d came too late
    assert devices.change(OPERATOR, "b", door, begins=False) == [Edge("b", door, None, begins=False)]
    assert devices.due(9, bound) == [Edge("a", door, None, begins=False)]
    assert devices.acting_on("a") == ()


def snapshot_with(*collisions: Collision) -> Snapshot:
    none, ints, bits = np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.bool_)
    columns = [*[none] * 7, ints, none, ints, ints, none, ints, *[none] * 3, bits]
    return Snapshot(0.0, (), (), *columns, collisions=collisions)


def test_a_collision_is_one_event_however_long_it_lasts() -> None:
    state = RunState(Clock(), Journal(), Devices())
    contact = Collision("a", "b", "collision", "lane_0", 12.0)
    for collisions in ([contact], [contact], [], [contact]):
        note_world(state, snapshot_with(*collisions))
    assert [(event.vehicle, event.after) for event in state.journal.events] == [("a", "b"), ("a", "b")]


def test_the_heading_step_at_a_hand_over_fades_instead_of_showing() -> None:
    """Point 1.10: what the world's driver takes over turns to his lane over time, not at once."""
    fleet = Fleet()
    slot = fleet.occupy("a")
    slots, rows = np.array([slot]), np.array([0])
    one, ints = np.zeros(1), np.zeros(1, np.int64)
    lane_heading = np.array([3.1])
    after_heading = [*[one] * 4, ints, one, ints, ints, one, ints, *[one] * 3, one > 0.0]
    snapshot = Snapshot(0.0, ("a",), ("t",), one, one, lane_heading, *after_heading)
    fleet.motion.heading_rad[slot] = -3.1  # across the seam of the angle
    steered = np.zeros(fleet.num_slots, np.bool_)
    steered[slot] = True
    offset = 2.0 * np.pi - 6.2
    first = heading_ease(fleet, snapshot, slots, rows, steered, 0.1)
    assert first[slot] == pytest.approx(offset)
    assert np.cos(lane_heading[0] + first[slot]) == pytest.approx(np.cos(-3.1))
    fleet.heading_ease_rad, fleet.driver_steered = first, steered
    for _ in range(10):
        fleet.heading_ease_rad = heading_ease(fleet, snapshot, slots, rows, steered, 0.1)
    assert fleet.heading_ease_rad[slot] == pytest.approx(offset * np.exp(-2.0))
    released = heading_ease(fleet, snapshot, slots, rows, ~steered, 0.1)
    assert released[slot] == 0.0


def test_what_was_asked_of_a_vehicle_that_has_gone_since_is_let_be() -> None:
    """Verbs act at the start of the next step; in between the vehicle may be released."""
    run = simulation({"car": Car(0.0), "other": Car(0.0)}, [])
    run.step()
    car = run.vehicle("car")
    car.set_coupling("auto")
    car.set_partial_mode("manual_speed")
    car.clear_errors()
    car.rearm()
    car.estop("pause")
    car.send(ReleaseControl(ComponentId.PRIMITIVE_DRIVER))
    run.release("car")
    run.step()
    assert run.vehicle_ids == ("other",)
