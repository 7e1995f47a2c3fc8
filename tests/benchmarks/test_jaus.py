"""What jaus costs: one message, one datagram through a port, and vehicles with TORC's full load (issue 5.11).

Without ``--benchmark-enable`` each runs once, as a test.
"""

from __future__ import annotations

from itertools import count
from time import thread_time
from typing import Any

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.codec import decode, encode
from jaus.messages import Message
from jaus.messages.core import CreateServiceConnection
from jaus.messages.platform import ReportVelocityState, SetWrenchEffort
from jaus.messages.torc import Motion, ReportVehicleMode, SetMotionProfile
from jaus.packet import Framing, pack_datagrams
from jaus.port import MessageReceived, Port
from tests.jaus.test_port import CLIENT, MPD, NM, OWN, PD, VSS, at, node
from tests.xgv_cosim.simulation.bare_world import Car
from tests.xgv_cosim.simulation.wire_client import WireClient, reachable

MESSAGES = [
    SetMotionProfile(motions=(Motion(5.0, 2.0, 0.1, 0.06, 400),)),
    ReportVelocityState(velocity_x_mps=3.2, time_stamp=77),
    SetWrenchEffort(25.0, propulsive_rotational_z_percent=-40.0, resistive_linear_x_percent=10.0),
    ReportVehicleMode(0, 3, 2, 1, 0, 0x10),
]
TORC_LOAD = [(0x4404, VSS, 50), (0x4405, PD, 50), (0x4406, PD, 10), (0xE456, NM, 5)] + [
    (code, component, rate) for code, rate in ((0x4002, 5), (0x400D, 1)) for component in (PD, MPD)
]
"""The service connections of TORC's client: report, component, rate in Hz."""
STEP_S = 0.01
VEHICLES = 20


def framed(message: Message) -> bytes:
    return pack_datagrams(Framing.JUDP1, [encode(message)])[0]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_encode(benchmark: Any, message: Message) -> None:
    message.to(at(MPD), source=OWN)
    assert decode(benchmark(encode, message)).code == message.code


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_decode(benchmark: Any, message: Message) -> None:
    data = encode(message.to(at(MPD), source=OWN))
    assert encode(benchmark(decode, data)) == data


def test_a_datagram_through_a_port(benchmark: Any) -> None:
    port = Port([node(1)])
    datagram = framed(MESSAGES[0].to(at(MPD), source=OWN))

    def through() -> object:
        port.receive_datagram(datagram, CLIENT, 0.0)
        return port.next_event()

    assert isinstance(benchmark(through), MessageReceived)


@pytest.mark.benchmark(timer=thread_time)
def test_a_second_of_torcs_full_load(benchmark: Any) -> None:
    """Each vehicle: eight service connections, and a motion profile at 50 Hz to decode; steps of 10 ms.

    ``vehicles_per_core`` is how many of them one core keeps up with in real time, their own work aside.
    """
    port = Port([node(subsystem) for subsystem in range(1, VEHICLES + 1)])
    profiles = []
    for subsystem in range(1, VEHICLES + 1):
        own = JausAddress(subsystem, 2, 4, 1)
        for code, component, rate_hz in TORC_LOAD:
            asked = CreateServiceConnection(code, rate_hz, 0xFF).to(at(component, subsystem), source=own)
            port.receive_datagram(framed(asked), CLIENT, 0.0)
        profiles.append(framed(MESSAGES[0].to(at(MPD, subsystem), source=own)))
    port.datagrams_to_send(0.0)
    steps = count(1)

    def a_second() -> tuple[int, int]:
        sent = events = 0
        for _ in range(round(1.0 / STEP_S)):
            step = next(steps)
            if step % 2:
                for profile in profiles:
                    port.receive_datagram(profile, CLIENT, step * STEP_S)
            while port.next_event() is not None:
                events += 1
            sent += len(port.datagrams_to_send(step * STEP_S))
        return sent, events

    sent, events = benchmark.pedantic(a_second, rounds=1 if benchmark.disabled else 10)
    assert events == 50 * VEHICLES
    wanted = sum(rate_hz for *_, rate_hz in TORC_LOAD) + 1
    assert sent / VEHICLES == pytest.approx(wanted, abs=len(TORC_LOAD))
    if benchmark.stats:
        benchmark.extra_info["vehicles_per_core"] = VEHICLES / benchmark.stats.stats.median


@pytest.mark.benchmark(timer=thread_time)
def test_a_second_of_emulated_cars_under_torcs_full_load(benchmark: Any) -> None:
    """The same with emulated cars behind it: endpoints, modes, controllers, vehicle models, their reports.

    The world is an endless road, so SUMO's part is not in it.
    """
    cars = {f"car{number}": Car(0.0) for number in range(VEHICLES)}
    run, loopback = reachable(cars, lockstep=False)
    clients = []
    for number in range(VEHICLES):
        client = WireClient(loopback, f"client{number}")
        for code, component, rate_hz in TORC_LOAD:
            client.say(CreateServiceConnection(code, rate_hz, 0xFF), ComponentId(component), number + 1)
        client.take_control(number + 1)
        clients.append(client)
    now_s = 0.0

    def a_second() -> int:
        nonlocal now_s
        heard = 0
        for _ in range(10):
            run.step()
            for tick in range(10):
                now_s += STEP_S
                if tick % 2:
                    for number, client in enumerate(clients):
                        client.say(MESSAGES[0], MPD, number + 1)  # type: ignore[arg-type]
                run.communicate(now_s)
                heard += sum(len(client.transport.receive()) for client in clients)
        return heard

    heard = benchmark.pedantic(a_second, rounds=1 if benchmark.disabled else 10)
    wanted = sum(rate_hz for *_, rate_hz in TORC_LOAD) + VEHICLES  # each hears the heartbeat of all
    assert wanted - 2 <= heard / VEHICLES <= wanted + 4 * len(TORC_LOAD)
    assert run.vehicle("car0").mode == "drive_by_wire"
    if benchmark.stats:
        benchmark.extra_info["vehicles_per_core"] = VEHICLES / benchmark.stats.stats.median
