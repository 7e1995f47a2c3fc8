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
