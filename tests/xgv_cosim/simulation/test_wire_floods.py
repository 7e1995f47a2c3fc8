"""Floods of messages at a car whose commands have latency: what they cost, and who is heard."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING

from jaus.address import JausAddress
from jaus.messages.core import (
    ConfirmComponentControl,
    ConfirmServiceConnection,
    CreateServiceConnection,
    RejectComponentControl,
    RequestComponentControl,
)
from jaus.messages.platform import ReportVelocityState
from tests.xgv_cosim.simulation.bare_world import Car
from tests.xgv_cosim.simulation.wire_client import MPD, OTHER, OWN, VSS, WireClient, motion, reachable
from xgv_cosim.simulation.under_way import MOST_UNDER_WAY, MOST_UNDER_WAY_OF_ONE, MOST_UNDER_WAY_OF_OTHERS

if TYPE_CHECKING:
    from xgv_cosim.simulation import Simulation

ONE = {"car": Car(speed_mps=0.0)}
LATENCY_S = 0.25
VELOCITY = CreateServiceConnection(ReportVelocityState.code, 10.0, 0xFFFF)


class Walked(deque[object]):
    """Counts how often somebody walks along what is under way."""

    walks = 0

    def __iter__(self) -> Iterator[object]:
        self.walks += 1
        return super().__iter__()


def refused(run: Simulation) -> set[str]:
    return {event.reasons[0] for event in run.state.journal.events if event.kind == "command_refused"}


def strangers(number: int) -> list[JausAddress]:
    return [JausAddress(110 + each // 200, 1, 1 + each % 200, 1) for each in range(number)]


def test_a_strangers_flood_keeps_the_controller_out_for_no_moment_xgv_10() -> None:
    """XGV-10: one sender, and many invented ones; it is told of, and what is under way is bounded."""
    run, loopback = reachable(ONE, command_latency_s=LATENCY_S)
    client = WireClient(loopback)
    client.take_control()
    run.run_until(0.5)
    vehicle = run.state.vehicles["car"]
    assert vehicle.endpoint.component_controller[MPD] == OWN
    stranger = WireClient(loopback, "stranger", OTHER)
    for _ in range(300):
        stranger.say(RequestComponentControl(1), MPD)
    run.communicate()
    senders = [sender for _, sender, _ in vehicle.on_the_way]
    assert senders.count(OTHER) == MOST_UNDER_WAY_OF_ONE
    assert len(stranger.listen(RejectComponentControl)) == 300 - MOST_UNDER_WAY_OF_ONE
    for address in strangers(1200):
        stranger.address = address
        stranger.say(RequestComponentControl(1), MPD)
    client.say(motion(), MPD)
    run.communicate()
    assert len(vehicle.on_the_way) == MOST_UNDER_WAY_OF_OTHERS + 1
    assert f"too many messages of {OTHER} are under way" in refused(run)
    run.run_until(1.0)
    assert run.vehicle("car").speed_mps > 0.1
    assert not vehicle.on_the_way


def test_what_a_controller_has_under_way_is_bounded_too() -> None:
    run, loopback = reachable(ONE, command_latency_s=LATENCY_S)
    client = WireClient(loopback)
    client.take_control()
    run.run_until(0.5)
    for _ in range(MOST_UNDER_WAY + 200):
        client.say(motion(), MPD)
    run.communicate()
    assert len(run.state.vehicles["car"].on_the_way) == MOST_UNDER_WAY
    run.run_until(1.0)  # there is room again
    client.say(RequestComponentControl(6), MPD)
    client.listen(ConfirmComponentControl)
    run.run_until(1.5)
    assert len(client.listen(ConfirmComponentControl)) == 1


def test_what_is_under_way_is_looked_through_once_an_exchange_not_once_a_message() -> None:
    run, loopback = reachable(ONE, command_latency_s=LATENCY_S)
    client, vehicle = WireClient(loopback), run.state.vehicles["car"]
    walks = []
    for messages in (1, 60):
        vehicle.on_the_way = walked = Walked()  # type: ignore[assignment]
        for _ in range(messages):
            client.say(RequestComponentControl(1), MPD)
        run.communicate()
        assert len(vehicle.on_the_way) == messages
        walks.append(walked.walks)
    assert walks[0] == walks[1]


def test_strangers_with_all_the_connections_there_are_keep_no_controller_from_his_reports() -> None:
    """Wherever he speaks from; who has his JAUS id from elsewhere is a stranger (XGV-65)."""
    run, loopback = reachable(ONE)
    client, forger = WireClient(loopback), WireClient(loopback, "forger")
    crowd = [WireClient(loopback, f"crowd{number}") for number in range(16)]
    for number, address in enumerate(strangers(64)):
        crowd[number % 16].address = address
        crowd[number % 16].say(VELOCITY, VSS)
    run.step()
    confirmed = [answer.response for each in crowd for answer in each.listen(ConfirmServiceConnection)]
    assert confirmed == [0] * 64
    client.say(VELOCITY, VSS)
    client.take_control()
    run.step()
    client.say(VELOCITY, VSS)
    forger.say(VELOCITY, VSS)
    run.run_until(1.0)
    assert [answer.response for answer in client.listen(ConfirmServiceConnection)] == [4, 0]
    assert len(client.listen(ReportVelocityState)) >= 5
    assert [answer.response for answer in forger.listen(ConfirmServiceConnection)] == [4]
