"""Three lines in a script that runs libsumo itself (issue point 3.5), the loop unchanged."""

from __future__ import annotations

from types import ModuleType

import xgv_cosim
from tests.xgv_cosim.step_listener.scripts import Trace, command, config_of, headless_trace
from xgv_cosim.scenario.loading import load_scenario


def test_the_same_trace_as_a_headless_run(libsumo: ModuleType) -> None:
    """Point 3.12: same configuration, seed and options, so the same trace to the last bit."""
    headless = headless_trace("freeway_estop", 300, seed=3)
    scenario, trace = load_scenario("freeway_estop"), Trace()
    with xgv_cosim.attach(libsumo, observers=[trace], xgv=scenario.to_mapping()["xgv"]) as plugin:
        for row in scenario.bind:
            data = row.model_dump(mode="json")
            vehicles = data.pop("vehicles")
            plugin.bind(**vehicles, **data) if isinstance(vehicles, dict) else plugin.bind(vehicles, **data)
        for row in scenario.injections:
            plugin.inject(**row.model_dump(mode="json"))
        libsumo.start(command(config_of("freeway_estop"), seed=3))
        while libsumo.simulation.getTime() < 30.0:
            libsumo.simulationStep()
        libsumo.close()
    assert trace.rows == headless.rows
    assert trace.hash.hexdigest == headless.hash.hexdigest
    assert any(event.kind == "safety_mode" for event in plugin.events)
