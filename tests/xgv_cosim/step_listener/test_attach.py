"""Three lines in a script that runs SUMO itself, its loop unchanged: in the process and over a socket."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import Script
from tests.xgv_cosim.step_listener.scripts import Trace, command, config_of, headless_trace
from xgv_cosim.errors import ScenarioError, UnknownVehicleError, WorldConfigurationError, WorldError
from xgv_cosim.scenario.loading import load_scenario

HELLO = config_of("hello")


def bind_as_in(plugin: xgv_cosim.Plugin, scenario: str) -> None:
    """Bind and inject what a packaged scenario does."""
    loaded = load_scenario(scenario)
    for row in loaded.bind:
        keys = row.model_dump(mode="json")
        vehicles = keys.pop("vehicles")
        plugin.bind(**vehicles, **keys) if isinstance(vehicles, dict) else plugin.bind(vehicles, **keys)
    for row in loaded.injections:
        keys = row.model_dump(mode="json")
        plugin.inject(keys.pop("vehicles"), **keys)


@pytest.mark.parametrize(("scenario", "num_steps"), [("hello", 150), ("freeway_estop", 60)])
def test_the_same_trace_as_a_headless_run(script: Script, scenario: str, num_steps: int) -> None:
    """Points 3.5 and 3.12: same configuration, seed and options, so the same to the last bit."""
    headless, trace = headless_trace(scenario, num_steps, seed=3), Trace()
    settings = load_scenario(scenario).to_mapping()
    with xgv_cosim.attach(script.module, observers=[trace], xgv=settings["xgv"]) as plugin:
        bind_as_in(plugin, scenario)
        script.start(command(config_of(scenario), seed=3))
        for _ in range(num_steps):
            script.module.simulationStep()
        assert plugin.warnings == ()
        script.module.close()
    assert trace.rows == headless.rows
    assert trace.hash.hexdigest == headless.hash.hexdigest
    assert len(trace.rows) == num_steps
    assert any(event.kind == "safety_mode" for event in plugin.events)


def test_several_steps_in_one_call_are_as_many_steps_of_ours(script: Script) -> None:
    traces = []
    for one_by_one in (True, False):
        trace = Trace()
        with xgv_cosim.attach(script.module, observers=[trace]) as plugin:
            bind_as_in(plugin, "hello")
            script.start(command(HELLO), label=f"one by one {one_by_one}")
            for number in range(60):
                if one_by_one:
                    script.module.simulationStep()
                elif number % 3 == 2:
                    script.module.simulationStep(0.1 * (number + 1))
            script.module.simulationStep(1.0)  # is past: SUMO does nothing
            assert script.module.simulation.getTime() == pytest.approx(6.0)
            assert plugin.now_s == 6.0
            script.module.close()
        traces.append(trace.rows)
    assert traces[0] == traces[1]


def test_a_multi_step_call_rounds_up_to_whole_steps_as_sumo_does(script: Script) -> None:
    times = []
    for attached in (False, True):
        script.start(command(HELLO), label=f"attached {attached}")
        plugin = xgv_cosim.attach(script.module) if attached else None
        script.module.simulationStep(0.25)
        times.append(script.module.simulation.getTime())
        if plugin is not None:
            plugin.detach()
        script.module.close()
    assert times[0] == times[1] == pytest.approx(0.3)


def test_the_scripts_listeners_are_called_once_for_each_call_in_their_order(script: Script) -> None:
    called: list[tuple[str, float, float]] = []

    class Listener(script.module.StepListener):  # type: ignore[misc, name-defined]
        def __init__(self, name: str) -> None:
            self.name = name

        def step(self, time: float = 0) -> bool:
            called.append((self.name, time, plugin.now_s))
            return True

    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO))
        numbers = [script.module.addStepListener(Listener(name)) for name in ("first", "second")]
        script.module.simulationStep()
        script.module.simulationStep(0.5)
        for number in numbers:
            script.module.removeStepListener(number)
        script.module.simulationStep()
        script.module.close()
    # they see the plugin after the step, and SUMO's own argument
    assert called == [("first", 0.0, 0.1), ("second", 0.0, 0.1), ("first", 0.5, 0.5), ("second", 0.5, 0.5)]


def test_close_and_start_again_is_a_fresh_simulation_under_the_same_rules(script: Script) -> None:
    trace = Trace()
    with xgv_cosim.attach(script.module, observers=[trace]) as plugin:
        bind_as_in(plugin, "hello")
        handles, hashes = [], []
        for episode in range(3):
            script.start(command(HELLO), label=f"episode {episode}")
            first_row = len(trace.rows)
            for _ in range(80):
                script.module.simulationStep()
            handles.append(plugin.vehicle("xgv_0"))
            assert handles[-1].mode == "estop_pause"
            script.module.close()
            hashes.append(trace.rows[first_row:])
            assert plugin.vehicle_ids == ()
            assert plugin.events[-1].kind == "released"
            with pytest.raises(UnknownVehicleError):  # a handle of an episode that is over
                handles[-1].estop("run")
            with pytest.raises(WorldError, match="start SUMO first"):
                plugin.vehicle("xgv_0")
    assert hashes[0] == hashes[1] == hashes[2]


def test_loading_another_simulation_begins_anew(script: Script) -> None:
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO))
        for _ in range(30):
            script.module.simulationStep()
        script.module.load(command(config_of("freeway_estop"))[1:])
        script.module.simulationStep()
        assert plugin.now_s == 0.1
        assert len(plugin.vehicle_ids) > 10
        script.module.close()


def test_loading_a_state_begins_anew_at_its_time(script: Script, tmp_path: Path) -> None:
    state = str(tmp_path / "state.xml")
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO))
        for number in range(60):
            if number == 40:
                script.module.simulation.saveState(state)
            script.module.simulationStep()
        script.module.simulation.loadState(state)
        script.module.simulationStep()
        assert plugin.begin_s == pytest.approx(4.0)
        assert plugin.now_s == 0.1
        assert plugin.vehicle_ids == ("xgv_0", "xgv_1")
        script.module.close()


def test_times_count_from_where_the_plugin_was_attached(script: Script) -> None:
    script.start([*command(HELLO), "--begin=100", "--end=200"])
    for _ in range(5):
        script.module.simulationStep()
    with xgv_cosim.attach(script.module) as plugin:
        script.module.simulationStep()
        assert (plugin.begin_s, plugin.now_s) == (pytest.approx(100.5), 0.1)
        assert plugin.snapshot.time_s == 0.1


def test_bind_and_release_while_vehicles_drive(script: Script) -> None:
    script.start(command(HELLO))
    with xgv_cosim.attach(script.module) as plugin:
        for _ in range(10):
            script.module.simulationStep()
        assert plugin.vehicle_ids == ()
        plugin.bind("xgv_0", driver="none")
        plugin.bind(type="xgv", from_s=2.0)
        script.module.simulationStep()
        assert plugin.vehicle_ids == ("xgv_0",)
        for _ in range(12):
            script.module.simulationStep()
        assert plugin.vehicle_ids == ("xgv_0", "xgv_1")
        car = plugin.vehicle("xgv_0")
        car.estop("pause")
        for _ in range(20):
            script.module.simulationStep()
        assert car.mode == "estop_pause"
        paused_mps = script.module.vehicle.getSpeed("xgv_0")
        assert paused_mps == pytest.approx(car.speed_mps)
        plugin.release("xgv_0")
        assert script.module.vehicle.getSpeedMode("xgv_0") == 31  # at once, over a socket too
        for _ in range(20):
            script.module.simulationStep()
        assert plugin.vehicle_ids == ("xgv_1",)
        assert script.module.vehicle.getSpeed("xgv_0") > paused_mps
        with pytest.raises(UnknownVehicleError):
            plugin.release("xgv_0")
        plugin.bind("xgv_0", stack="none", driver="world")
        script.module.simulationStep()
        assert set(plugin.vehicle_ids) == {"xgv_0", "xgv_1"}
        assert [event.reasons[-1] for event in plugin.events if event.kind == "bound"] == [
            "driver none",
            "driver rider",
            "driver world",
        ]


def test_after_detach_sumo_drives_everybody_and_the_script_goes_on(script: Script) -> None:
    plugin = xgv_cosim.attach(script.module)
    plugin.bind("xgv_*")
    script.start(command(HELLO))
    for _ in range(30):
        script.module.simulationStep()
    plugin.detach()
    assert {script.module.vehicle.getSpeedMode(name) for name in ("xgv_0", "xgv_1")} == {31}
    for _ in range(30):
        script.module.simulationStep()
    assert script.module.simulation.getTime() == pytest.approx(6.0)
    assert script.module.vehicle.getSpeed("xgv_0") > 5.0
    with pytest.raises(WorldError, match="no simulation"):
        plugin.vehicle("xgv_0")
    plugin.detach()  # does nothing more
    again = xgv_cosim.attach(script.module)
    again.detach()


def test_injections_before_and_during_the_run(script: Script) -> None:
    with xgv_cosim.attach(script.module) as plugin:
        plugin.inject("xgv_0", kind="estop_pause", at_s=1.0, duration_s=2.0)
        plugin.bind("xgv_*")
        script.start(command(HELLO))
        for _ in range(15):
            script.module.simulationStep()
        assert plugin.vehicle("xgv_0").reasons
        plugin.inject("xgv_1", kind="override", at_s=2.0)
        with pytest.raises(ScenarioError, match="is past"):
            plugin.inject("xgv_1", kind="override", at_s=0.5)
        for _ in range(10):
            script.module.simulationStep()
        assert [(event.t_s, event.vehicle) for event in plugin.events if event.kind == "injection"] == [
            (1.0, "xgv_0"),
            (2.0, "xgv_1"),
        ]
        script.module.close()


def test_a_stack_of_the_scripts_own(script: Script) -> None:
    seen: list[float] = []

    class Watching:
        def act(self, observation: Any) -> list[Any]:
            seen.append(observation.time_s)
            return []

    made: list[str] = []

    def maker(vehicle_id: str) -> Watching:
        made.append(vehicle_id)
        return Watching()

    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_0", stack=Watching())
        plugin.bind("xgv_*", stack=maker)
        script.start(command(HELLO))
        for _ in range(3):
            script.module.simulationStep()
        script.module.close()
    assert made == ["xgv_1"]
    assert seen == [0.1, 0.1, 0.2, 0.2, 0.3, 0.3]


def test_one_stack_object_drives_one_vehicle_only(script: Script) -> None:
    class Silent:
        def act(self, observation: Any) -> list[Any]:
            return []

    with xgv_cosim.attach(script.module) as plugin:
        with pytest.raises(ScenarioError, match="expected the name of a stack, an object"):
            plugin.bind("xgv_1", stack=3)
        with pytest.raises(ScenarioError, match="cannot be made with nothing"):
            plugin.bind("xgv_1", stack=lambda name: Silent())
        plugin.bind("xgv_*", stack=Silent())
        script.start(command(HELLO))
        with pytest.raises(ScenarioError, match="cannot drive 'xgv_1' too"):
            script.module.simulationStep()
        with pytest.raises(WorldError, match="an earlier step of the plugin failed"):  # never silence
            script.module.simulationStep()


def test_mistakes_are_told_as_in_a_scenario(script: Script) -> None:
    with xgv_cosim.attach(script.module) as plugin:
        with pytest.raises(ScenarioError, match="did you mean 'coupling'"):
            plugin.bind("veh0", couplin="lane")
        with pytest.raises(ScenarioError, match="got 'rideer'"):
            plugin.bind("veh0", driver="rideer")
        with pytest.raises(ScenarioError, match="got neither"):
            plugin.bind()
        with pytest.raises(ScenarioError, match="got both"):
            plugin.bind("veh0", share=0.5)
        with pytest.raises(ScenarioError, match="did you mean"):
            plugin.inject("veh0", kind="estop_pauze", at_s=1.0)
        with pytest.raises(ScenarioError, match="decel"):
            xgv_cosim.attach(script.module, xgv={"pause": {"decel": 3}})
        with pytest.raises(WorldError, match="attached already"):
            xgv_cosim.attach(script.module)


def test_a_row_that_binds_nobody_is_told(script: Script) -> None:
    plugin = xgv_cosim.attach(script.module)
    plugin.bind("xgv_*")
    plugin.bind("veh_17")
    script.start(command(HELLO))
    script.module.simulationStep()
    told = r"bind\.1: no vehicle that has departed matches veh_17, but for those that earlier rows take"
    with pytest.warns(UserWarning, match=told) as caught:
        script.module.close()
    assert [warning.filename for warning in caught] == [__file__]
    plugin.detach()


@pytest.mark.parametrize("step_s", [1.0, 0.4, 0.025])
def test_a_step_that_does_not_fit_is_refused(script: Script, step_s: float) -> None:
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO, step_s=step_s))
        for _ in range(2):
            with pytest.raises(WorldConfigurationError, match=f"is {step_s:g} s.*--step-length 0.1"):
                script.module.simulationStep()
    with pytest.raises(WorldConfigurationError, match="--step-length"):
        xgv_cosim.attach(script.module)
    script.module.simulationStep()  # nothing is left behind


@pytest.mark.parametrize(
    ("option", "model"), [("--mesosim=true", "mesoscopic"), ("--lateral-resolution=0.8", "sublane")]
)
def test_a_model_that_is_not_supported_is_refused(script: Script, option: str, model: str) -> None:
    script.start(command(HELLO, options=[option]))
    with pytest.raises(WorldConfigurationError, match=f"{model} model.*{option.partition('=')[0]}"):
        xgv_cosim.attach(script.module)
    script.module.simulationStep()


def test_options_under_which_things_stay_hidden_are_told_once(script: Script) -> None:
    with xgv_cosim.attach(script.module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO, options=()))
        with pytest.warns(xgv_cosim.SumoOptionsWarning) as caught:
            script.module.simulationStep()
        assert len(caught) == 1
        assert caught[0].filename == __file__
        assert [text.split()[2] for text in plugin.warnings] == [
            "--collision.action",
            "--collision.mingap-factor",
            "--collision.check-junctions",
            "--time-to-teleport",
            "--lanechange.duration",
        ]
        assert all(text in str(caught[0].message) for text in plugin.warnings)
        script.module.simulationStep()  # a second warning would be an error here
        script.module.close()
        script.start(command(HELLO, options=()), label="again")
        script.module.simulationStep()
        script.module.close()


def test_errors_of_sumo_in_the_step_are_the_scripts_own(script: Script) -> None:
    """A script that catches traci's errors around its loop goes on doing so."""
    module = script.module
    errors = (module.TraCIException, module.FatalTraCIError)
    with xgv_cosim.attach(module) as plugin:
        plugin.bind("xgv_*")
        script.start(command(HELLO))
        module.simulationStep()
        if script.is_over_socket:
            script.processes[0].kill()
            with pytest.raises(errors):
                module.simulationStep()
            plugin.detach()
            return
        module.close()
        with pytest.raises(errors):
            module.simulationStep()


def test_recording_an_attached_run(script: Script, tmp_path: Path) -> None:
    trace = Trace()
    with xgv_cosim.attach(script.module, observers=[trace]) as plugin:
        bind_as_in(plugin, "hello")
        plugin.record(tmp_path / "run")
        script.start(command(HELLO))
        for _ in range(20):
            script.module.simulationStep()
        with pytest.raises(ScenarioError, match="before its first step"):
            plugin.record(tmp_path / "other")
        script.module.close()
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"events.jsonl", "trace.csv", "trajectory.parquet", "road.json"}
    last = (tmp_path / "run" / "trace.csv").read_text().splitlines()[-1]
    assert last.startswith("19,200,2.0,")
    assert last.endswith(trace.hash.hexdigest[:16])
