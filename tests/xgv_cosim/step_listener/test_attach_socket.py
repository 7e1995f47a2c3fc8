"""What only a socket has: messages to count, connections to choose from, subscriptions of the script."""

from __future__ import annotations

import socket
import statistics
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import traci

import xgv_cosim
from tests.xgv_cosim.step_listener.conftest import BINARY, Script
from tests.xgv_cosim.step_listener.scripts import Trace, command, config_of
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.reader import REPORTED_TOLERANCE_MPS
from xgv_cosim.worlds.sumo.socket_engine import SocketEngine
from xgv_cosim.worlds.sumo.socket_messages import Question

HELLO = config_of("hello")
BOUND = car("xgv", 20, 8.0, lane=1, kind="xgv")
SPEED = traci.constants.VAR_SPEED


class CountingSocket:
    """A socket that counts what is sent; all else is the socket's."""

    def __init__(self, real: socket.socket) -> None:
        self._real = real
        self.num_messages = 0

    def send(self, data: bytes) -> int:
        self.num_messages += 1
        return self._real.send(data)

    def sendall(self, data: bytes) -> None:
        self.num_messages += 1
        self._real.sendall(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)


def _messages(label: str, *, num_steps: int) -> list[int]:
    """Return how many messages each of the next steps takes."""
    connection = traci.getConnection(label)
    connection._socket = counting = CountingSocket(connection._socket)
    counts = []
    for _ in range(num_steps):
        before = counting.num_messages
        traci.simulationStep()
        counts.append(counting.num_messages - before)
    return counts


@pytest.fixture
def many(over_socket: Script) -> Script:
    """SUMO with 245 vehicles on a freeway, one step old."""
    over_socket.start(command(config_of("freeway_estop")))
    traci.simulationStep()
    return over_socket


def test_messages_of_a_step_do_not_grow_with_the_vehicles(over_socket: Script) -> None:
    """Five: commands, SUMO's step, who is there, all questions about them, true speeds. Else two."""
    usual, most = [], []
    for number in (0, 1, 10, 50):
        over_socket.start(command(config_of("freeway_estop")), label=f"{number} bound")
        traci.simulationStep()
        with xgv_cosim.attach(traci) as plugin:
            if number:
                plugin.bind(traci.vehicle.getIDList()[:number])
            for _ in range(5):
                traci.simulationStep()
            counts = _messages(f"{number} bound", num_steps=15)
            assert len(plugin.vehicle_ids) == number
        usual.append(statistics.median(counts))
        most.append(max(counts))
    assert usual == [2, 5, 5, 5]
    assert max(most) <= 10  # somebody departs, changes edges, comes near a junction


def test_messages_of_a_step_do_not_grow_with_the_parked(over_socket: Script, tmp_path: Path) -> None:
    """Issue 3.5: somebody on no lane is one more question about each, in the message with the others."""
    usual, most = [], []
    for number in (0, 1, 20):
        config = write_config(tmp_path, "".join(map(_parked, range(number))) + BOUND, network("hello"))
        over_socket.start(command(config), label=f"{number} parked")
        with xgv_cosim.attach(traci) as plugin:
            plugin.bind("xgv")
            for _ in range(25):
                traci.simulationStep()
            assert sum(map(traci.vehicle.isStoppedParking, traci.vehicle.getIDList())) == number
            assert plugin.vehicle_ids == ("xgv",)
            counts = _messages(f"{number} parked", num_steps=15)
        usual.append(statistics.median(counts))
        most.append(max(counts))
    assert usual == [5, 5, 5]
    assert max(most) <= 10


def _parked(number: int) -> str:
    at_m = 60 + 8 * number
    stop = f'<stop lane="road_0" startPos="{at_m - 6}" endPos="{at_m}" duration="900" parking="true"/>'
    return car(f"parked_{number}", at_m, 0.0, extra=stop)


def test_answers_are_traci_s_own(many: Script) -> None:
    """Pins traci's names with an underscore: the getters that worlds use, one by one and all at once."""
    engine = SocketEngine(traci.getConnection())
    vehicles, lanes = traci.vehicle.getIDList()[:20], traci.lane.getIDList()
    of_a_vehicle = [
        ("getPosition",),
        ("getLaneID",),
        ("getLanePosition",),
        ("getAngle",),
        ("getSpeed",),
        ("getAcceleration",),
        ("getTypeID",),
        ("getLength",),
        ("getLeader", 250.0),
        ("getFollower", 250.0),
        ("getRoute",),
        ("getRouteIndex",),
        ("getNextTLS",),
        ("getBestLanes",),
        ("getColor",),
        ("getSpeedMode",),
        ("getJunctionFoes", 120.0),
        ("isStopped",),
        ("isStoppedParking",),
        ("isRouteValid",),
    ]
    of_a_lane = [("getShape",), ("getLinks",), ("getAllowed",), ("getLength",), ("getEdgeID",)]
    of_all = [
        "getTime",
        "getArrivedIDList",
        "getDepartedIDList",
        "getCollisions",
        "getStartingTeleportIDList",
    ]

    def ask(source: Any) -> list[Any]:
        return [
            source.vehicle.getIDList(),
            source.lane.getIDList(),
            *(getattr(source.vehicle, name)(one, *rest) for name, *rest in of_a_vehicle for one in vehicles),
            *(getattr(source.lane, name)(one, *rest) for name, *rest in of_a_lane for one in lanes),
            *(getattr(source.simulation, name)() for name in of_all),
        ]

    engine.remember()
    for _ in range(3):
        assert repr(ask(engine)) == repr(ask(traci))
        traci.simulationStep()
        engine.look_ahead()


def test_a_question_that_sumo_refuses_leaves_the_others_alone(
    capfd: pytest.CaptureFixture[str], many: Script
) -> None:
    engine = SocketEngine(traci.getConnection())
    gone, left, right = traci.vehicle.getIDList()[:3]
    engine.remember()
    engine.vehicle.getIDList()
    for name in (left, gone, right):
        engine.vehicle.getRoute(name)
        engine.vehicle.getSpeed(name)
    traci.vehicle.remove(gone)
    traci.simulationStep()
    engine.look_ahead()
    assert capfd.readouterr() == ("", "")  # SUMO writes a line for each question about one who has gone
    for name in (left, right):
        assert engine.vehicle.getRoute(name) == traci.vehicle.getRoute(name)
        assert engine.vehicle.getSpeed(name) == traci.vehicle.getSpeed(name)
    with pytest.raises(traci.TraCIException, match="is not known"):
        engine.vehicle.getSpeed(gone)
    assert engine.vehicle.getSpeed(left) == traci.vehicle.getSpeed(left)


def test_nothing_is_asked_about_who_is_removed(many: Script, monkeypatch: pytest.MonkeyPatch) -> None:
    """SUMO writes a line on the user's terminal for each question that it refuses."""
    with xgv_cosim.attach(traci) as plugin:
        plugin.bind("nobody", stack="none")
        traci.simulationStep()
        engine = plugin._hold.engine
        assert isinstance(engine, SocketEngine)
        asked: set[str] = set()
        answers_to = engine._connection.answers_to

        def watched(questions: Sequence[Question]) -> Iterator[tuple[Question, Any]]:
            asked.update(question.subject for question in questions)
            return answers_to(questions)

        monkeypatch.setattr(engine._connection, "answers_to", watched)
        gone, *others = traci.vehicle.getIDList()[:4]
        engine.remember()
        for name in (gone, *others):  # who is commanded is asked about together, from the second on
            engine.vehicle.setSpeedMode(name, 31)
        engine.send()
        traci.vehicle.remove(gone)
        assert all(engine.vehicle.getSpeedFactor(name) > 0.0 for name in others)
        assert asked == set(others[1:])
        engine.forget()
        with pytest.warns(UserWarning, match="nobody"):
            plugin.detach()


def test_what_is_asked_together_now_and_then_goes_into_one_message(many: Script) -> None:
    connection = traci.getConnection()
    engine = SocketEngine(connection)
    connection._socket = counting = CountingSocket(connection._socket)
    engine.remember()
    names = engine.vehicle.getIDList()[:3]
    for name in names:
        engine.vehicle.getRoute(name)
        engine.vehicle.getVehicleClass(name)
    for _ in range(3):
        traci.simulationStep()
        engine.look_ahead()
        engine.vehicle.getIDList()
    before = counting.num_messages
    for name in names:
        assert engine.vehicle.getRoute(name)
        assert engine.vehicle.getVehicleClass(name) == "passenger"
    assert counting.num_messages == before + 1


def test_commands_wait_for_the_next_question_and_keep_their_order(many: Script) -> None:
    connection = traci.getConnection()
    engine = SocketEngine(connection)
    connection._socket = counting = CountingSocket(connection._socket)
    one, other = traci.vehicle.getIDList()[:2]
    engine.remember()
    before = engine.vehicle.getSpeedMode(one), counting.num_messages
    for mode in (3, 7, 0):
        engine.vehicle.setSpeedMode(one, mode)
        engine.vehicle.setSpeedMode(other, mode + 1)
    assert counting.num_messages == before[1]
    assert engine.vehicle.getSpeedMode(one) == 0  # no answer from before the commands
    assert counting.num_messages == before[1] + 1
    assert traci.vehicle.getSpeedMode(other) == 1


def test_a_command_that_sumo_refuses_is_an_error_when_it_is_sent(many: Script) -> None:
    engine = SocketEngine(traci.getConnection())
    one = traci.vehicle.getIDList()[0]
    engine.vehicle.setSpeedMode(one, 5)
    engine.vehicle.setSpeed("nobody", 3.0)
    engine.vehicle.setSpeedMode(one, 7)
    with pytest.raises(traci.TraCIException, match="nobody"):
        engine.send()
    assert traci.vehicle.getSpeedMode(one) == 7
    engine.send()  # nothing is left


def test_the_scripts_subscriptions_and_their_results_stay_its_own(over_socket: Script) -> None:
    results = []
    for attached in (False, True):
        over_socket.start(command(HELLO), label=f"attached {attached}")
        plugin = xgv_cosim.attach(traci) if attached else None
        if plugin is not None:
            plugin.bind("nobody_*")
        traci.simulationStep()
        traci.vehicle.subscribe("xgv_0", [SPEED])
        connection = traci.getConnection(f"attached {attached}")
        returned = [connection.simulationStep() for _ in range(3)] + [traci.simulationStepLegacy(0.9)]
        results.append((returned, traci.vehicle.getAllSubscriptionResults(), traci.simulationStep()))
        if plugin is not None:
            with pytest.warns(UserWarning, match="nobody"):
                plugin.detach()
        traci.close()
    assert results[0] == results[1]
    assert list(results[0][1]) == ["xgv_0"]


def test_a_bound_vehicles_true_speed_is_there_when_the_call_returns(over_socket: Script) -> None:
    with xgv_cosim.attach(traci) as plugin:
        plugin.bind("xgv_*")
        plugin.inject("xgv_0", kind="estop_disable", at_s=3.0)
        over_socket.start(command(HELLO))
        for _ in range(50):
            traci.simulationStep()
            for name in plugin.vehicle_ids:
                wrong_mps = traci.vehicle.getSpeed(name) - plugin.vehicle(name).speed_mps
                assert abs(wrong_mps) <= REPORTED_TOLERANCE_MPS
        traci.close()


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_step_function_imported_by_name_is_caught(over_socket: Script, when: str) -> None:
    from traci import simulationStep  # as a script does at its top

    if when == "after":
        over_socket.start(command(HELLO))
    with xgv_cosim.attach(traci) as plugin:
        if when == "before":
            over_socket.start(command(HELLO))
        simulationStep()
        traci.simulation.step()
        traci.getConnection().simulationStep()
        assert plugin.now_s == pytest.approx(0.3)
        traci.close()


def test_a_method_kept_from_before_is_no_way_around(over_socket: Script) -> None:
    over_socket.start(command(HELLO))
    kept = traci.getConnection().simulationStep
    with xgv_cosim.attach(traci) as plugin:
        traci.simulationStep()
        with pytest.raises(WorldError, match="kept from before attach"):
            kept()
        for _ in range(2):  # as often as the script goes on
            with pytest.raises(WorldError, match="stepped or loaded past it"):
                traci.simulationStep()
        plugin.detach()
    kept()
    traci.simulationStep()


def test_two_connections_with_a_plugin_each_and_one_without(over_socket: Script) -> None:
    traces = {name: Trace() for name in ("one", "two")}
    for label in ("one", "two", "three"):
        over_socket.start(command(HELLO), label=label)
    connections = {label: traci.getConnection(label) for label in ("one", "two", "three")}
    plugins = {label: xgv_cosim.attach(connections[label], observers=[traces[label]]) for label in traces}
    with pytest.raises(WorldError, match="attached already"):
        xgv_cosim.attach(connections["two"])
    plugins["one"].bind("xgv_0")
    plugins["two"].bind("xgv_1")
    for _ in range(20):
        for connection in connections.values():
            connection.simulationStep()
    assert plugins["one"].vehicle_ids == ("xgv_0",)
    assert plugins["two"].vehicle_ids == ("xgv_1",)
    plugins["one"].detach()
    for connection in connections.values():
        connection.simulationStep()
    assert plugins["two"].now_s == pytest.approx(2.1)
    assert connections["one"].simulation.getTime() == pytest.approx(2.1)
    assert connections["three"].simulation.getTime() == pytest.approx(2.1)
    # the module is a way to the current connection, which has its plugin
    traci.switch("two")
    traci.simulationStep()
    assert plugins["two"].now_s == pytest.approx(2.2)
    # closed and opened again under its label, it is the same plugin's
    traci.close()
    over_socket.start(command(HELLO), label="two")
    traci.simulationStep()
    assert (plugins["two"].now_s, plugins["two"].vehicle_ids) == (0.1, ("xgv_1",))
    plugins["two"].detach()


def test_one_scenario_over_a_socket_and_in_the_process_gives_one_trajectory(
    over_socket: Script, libsumo: Any
) -> None:
    """Departures, edges, junctions and arrivals: every vehicle's exact pose in each step."""
    config = config_of("freeway_estop")
    traces = {}
    for script in (over_socket, Script(libsumo)):
        trace = traces[script.is_over_socket] = Trace()
        with xgv_cosim.attach(script.module, observers=[trace]) as plugin:
            plugin.bind(share=0.1)
            plugin.inject(share=0.05, kind="estop_pause", at_s=4.0, duration_s=3.0)
            script.start(command(config, seed=11))
            for _ in range(90):
                script.module.simulationStep()
            assert len(plugin.vehicle_ids) > 15
            script.module.close()
    assert traces[True].rows == traces[False].rows
    assert traces[True].hash.hexdigest == traces[False].hash.hexdigest


def test_started_by_traci_itself(capsys: pytest.CaptureFixture[str]) -> None:
    with xgv_cosim.attach(traci) as plugin:
        plugin.bind("xgv_*")
        traci.start([BINARY, *command(HELLO)[1:]])
        try:
            traci.simulationStep(0.5)
        finally:
            traci.close()
    assert [event.vehicle for event in plugin.events if event.kind == "bound"] == ["xgv_0", "xgv_1"]


def test_what_is_no_sumo_is_refused() -> None:
    for given in (None, "traci", socket, object()):
        with pytest.raises(WorldError, match="expected the module traci or libsumo, or a connection"):
            xgv_cosim.attach(given)


def test_stacks_at_crossings_have_sumo_refuse_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    """A question about two lanes is asked of these two; SUMO writes a line for each that it cannot answer."""
    with xgv_cosim.attach(traci) as plugin:
        plugin.bind(share=0.5)
        traci.start([BINARY, *command(config_of("urban_grid"))[1:]])
        try:
            for _ in range(150):
                traci.simulationStep()
            assert len(plugin.vehicle_ids) > 3
        finally:
            traci.close()
    assert "Error" not in capfd.readouterr().err
