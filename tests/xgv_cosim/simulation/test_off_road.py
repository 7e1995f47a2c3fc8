"""A bound car beside the road: it stays in the world, where the plant has it, and the journal tells."""

from __future__ import annotations

import pytest

from tests.xgv_cosim.simulation.conftest import Opener


@pytest.mark.parametrize("coupling", ["free", "lane", "auto"])
def test_leaving_the_road_and_coming_back_is_told_and_loses_nothing(
    open_hello: Opener, coupling: str
) -> None:
    """Issue 3.4: SUMO has it on no lane for 5 s; route and binding last."""
    simulation = open_hello(f"bind.0.coupling={coupling}")
    simulation.run_until(4.0)
    slot, others = simulation.fleet.slot_of("xgv_0"), set(simulation.snapshot.ids)
    simulation.fleet.motion.y_m[slot] -= 12.0
    for _ in range(30):
        snapshot = simulation.step()
        row = snapshot.index_of["xgv_0"]
        assert snapshot.lane[row] == -1
        assert snapshot.placement_error_m[row] < 1e-6
    while snapshot.lane[snapshot.index_of["xgv_0"]] < 0:
        snapshot = simulation.step()
        assert simulation.now_s < 20.0
    assert set(snapshot.ids) == others
    told = [event for event in simulation.state.journal.events if event.kind == "road"]
    assert [(event.vehicle, event.after) for event in told] == [("xgv_0", "off_road"), ("xgv_0", "on_road")]
    assert [event for event in simulation.state.journal.events if event.kind == "teleport"] == []


def test_a_car_released_off_the_road_stays_in_the_world_and_can_be_bound_again(open_hello: Opener) -> None:
    """SUMO would list it as teleporting for good, and the journal would call it back on the road."""
    simulation = open_hello("bind.0.coupling=free")
    simulation.run_until(4.0)
    simulation.fleet.motion.y_m[simulation.fleet.slot_of("xgv_0")] -= 12.0
    snapshot = simulation.step()
    row = snapshot.index_of["xgv_0"]
    at = float(snapshot.front_x_m[row]), float(snapshot.front_y_m[row])
    binding = simulation.state.vehicle("xgv_0").binding
    simulation.release("xgv_0")
    for _ in range(120):  # longer than SUMO lets a vehicle stand that nobody stirs
        snapshot = simulation.step()
        assert "xgv_0" not in snapshot.arrived + snapshot.teleported
        row = snapshot.index_of["xgv_0"]
        assert (snapshot.lane[row], snapshot.speed_mps[row]) == (-1, 0.0)
        assert (snapshot.front_x_m[row], snapshot.front_y_m[row]) == pytest.approx(at, abs=1e-6)
    events = [event for event in simulation.state.journal.events if event.vehicle == "xgv_0"]
    assert [event.after for event in events if event.kind == "road"] == ["off_road"]
    assert any(
        "released off the road" in str(event.reasons) for event in events if event.kind == "world_note"
    )
    simulation.bind_vehicle("xgv_0", binding)
    simulation.fleet.motion.y_m[simulation.fleet.slot_of("xgv_0")] += 12.0
    simulation.step()
    snapshot = simulation.step()
    assert snapshot.lane[snapshot.index_of["xgv_0"]] >= 0


def test_a_car_whose_time_as_a_bound_one_ends_off_the_road_stays_there(open_hello: Opener) -> None:
    simulation = open_hello("bind.0.until_s=4.5")
    simulation.run_until(4.0)
    simulation.fleet.motion.y_m[simulation.fleet.slot_of("xgv_0")] -= 12.0
    simulation.run_until(6.0)
    assert "xgv_0" not in simulation.vehicle_ids
    assert simulation.snapshot.lane[simulation.snapshot.index_of["xgv_0"]] == -1


def test_who_is_held_at_the_end_changes_nothing_in_the_next_run(open_hello: Opener) -> None:
    """libsumo kept the move by which SUMO's driver was to have the car again, and made it with another."""
    simulation = open_hello("bind.0.until_s=4.5")
    simulation.run_until(4.0)
    simulation.fleet.motion.y_m[simulation.fleet.slot_of("xgv_0")] -= 12.0
    simulation.run_until(6.0)
    there = set(simulation.snapshot.ids)
    simulation.close()
    again = open_hello("bind=[]")
    assert set(again.step().ids) == set(again.step().ids) == there
