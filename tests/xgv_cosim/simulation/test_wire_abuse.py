"""Fuzzed datagrams at a car that somebody drives: no crash, no growth, and it drives on as it is told.

What a stranger may do is left out: Set Emergency pauses any car (XGV-63), and more authority than the
controller's would take it over, so he has the most there is.
"""

from __future__ import annotations

import tracemalloc

import pytest

from jaus.address import JausAddress
from jaus.component import ComponentStatus
from jaus.messages.core import RequestComponentControl, Resume, SetEmergency
from tests.jaus.golden import GOLDEN
from tests.jaus.test_abuse import Fuzz
from tests.xgv_cosim.simulation.bare_world import Car
from tests.xgv_cosim.simulation.wire_client import CARS, MPD, OWN, PD, WireClient, motion, reachable
from xgv_cosim.simulation.binding import MOST_REFUSALS, REFUSAL_PERIOD_S

AT_ONCE = 250
SPEED_MPS = 6.0
MOST_GROWTH_BYTES = 3_000_000


class Strangers(Fuzz):
    """Fuzz without Set Emergency, and with the controller's own JAUS id now and then, from elsewhere."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._packets = [golden.data for golden in GOLDEN if golden.data[2:4] != b"\x06\x00"]

    def _packet(self) -> bytearray:
        packet = super()._packet()
        packet[7] = 1
        if self._dice.random() < 0.2:
            packet[8:12] = OWN.jaus_id.to_bytes(4, "little")
        return packet

    def datagram(self) -> bytes:
        while (data := super().datagram()) and SetEmergency.code.to_bytes(2, "little") + b"\x01" in data:
            pass
        return data


def abused(datagrams: int) -> None:
    run, loopback = reachable({"car": Car(SPEED_MPS)})
    client, strangers = WireClient(loopback), Strangers(seed=7)
    wire = run._wire
    assert wire is not None

    def drive() -> None:
        client.say(RequestComponentControl(255), MPD)
        client.say(Resume(), PD)
        client.say(Resume(), MPD)
        client.say(motion(SPEED_MPS, duration_ms=600), MPD)
        run.step()
        client.transport.receive()

    for _ in range(20):
        drive()
    tracemalloc.start()
    begun_bytes = 0
    for number in range(datagrams // AT_ONCE):
        for _ in range(AT_ONCE):
            loopback.carry(strangers.datagram(), strangers.source(), CARS)
        drive()
        if number == 100:
            begun_bytes = tracemalloc.get_traced_memory()[0]
    grown_bytes = tracemalloc.get_traced_memory()[0] - begun_bytes
    tracemalloc.stop()

    endpoint = run.state.vehicles["car"].endpoint
    assert endpoint.component_controller == {MPD: OWN, PD: JausAddress(1, 1, MPD, 1)}
    assert endpoint.component_status == {MPD: ComponentStatus.READY, PD: ComponentStatus.READY}
    assert run.vehicle("car").mode == "drive_by_wire"
    assert run.vehicle("car").speed_mps == pytest.approx(SPEED_MPS, abs=0.1)
    slot = run.fleet.slot_of("car")
    assert abs(run.fleet.motion.heading_rad[slot]) < 1e-6
    changed = {event.kind for event in run.state.journal.events if event.t_s > 2.0}
    assert changed <= {"command_refused", "signals"}  # lights are anybody's (XGV-10)
    refused = sum(event.kind == "command_refused" for event in run.state.journal.events)
    assert refused <= MOST_REFUSALS + run.now_s / REFUSAL_PERIOD_S + 1
    assert wire.network.counts.refused > datagrams // 10
    assert grown_bytes < MOST_GROWTH_BYTES


def test_thirty_thousand_fuzzed_datagrams_at_a_car_that_is_driven() -> None:
    """XGV-10, XGV-65: nobody without control moves it, and no forged source commands or releases it."""
    abused(30_000)


@pytest.mark.slow
def test_two_hundred_thousand_fuzzed_datagrams_at_a_car_that_is_driven() -> None:
    """The same for longer; the million is a port's (tests/jaus/test_abuse.py)."""
    abused(200_000)
