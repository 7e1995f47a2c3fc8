"""Clients of the car, the stack over the wire and the example: what they make of any code of a mode."""

from __future__ import annotations

import runpy
import socket
import sys
from collections.abc import Hashable, Iterable
from pathlib import Path
from typing import ClassVar, Self

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.codec import encode
from jaus.messages import Message
from jaus.messages.platform import ReportVelocityState
from jaus.messages.torc import ReportVehicleMode
from jaus.packet import Framing, pack_datagrams
from tests.xgv_cosim.autonomy.test_reference_stack import seen
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.observation import Observation
from xgv_cosim.vehicles.xgv.wire.client import StackOverTheWire

EXAMPLE = Path(__file__).parents[4] / "examples" / "jaus_client.py"
CAR, CLIENT = ("127.0.0.1", 3794), JausAddress(100, 2, 40, 1)
NAMES = [(1, "drive_by_wire"), *((code, "software_pause") for code in range(2, 8)), (8, "estop_pause")]
STRANGE = [(12, "inactive"), (255, "inactive")]


def reports(safety_mode: int, to: JausAddress) -> list[tuple[bytes, Hashable]]:
    """Return the datagrams of a car that reports its mode and its speed."""
    said: tuple[tuple[Message, ComponentId], ...] = (
        (ReportVehicleMode(0, 1, 1, safety_mode, 0, 0x10), ComponentId.NODE_MANAGER),
        (ReportVelocityState(velocity_x_mps=3.0, time_stamp=0), ComponentId.VELOCITY_STATE_SENSOR),
    )
    packets = [encode(each.to(to, source=JausAddress(1, 1, component, 1))) for each, component in said]
    return [(datagram, CAR) for datagram in pack_datagrams(Framing.JUDP1, packets)]


class Line:
    """A line on which a car says the same for ever."""

    safety_mode: ClassVar[int] = 0

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> list[tuple[bytes, Hashable]]:
        return reports(self.safety_mode, CLIENT)

    def send(self, datagrams: Iterable[tuple[bytes, Hashable]]) -> None:
        list(datagrams)

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Watcher:
    """A stack that looks and does nothing."""

    def __init__(self) -> None:
        self.modes: list[str] = []

    def act(self, observation: Observation) -> list[StackMessage]:
        self.modes.append(observation.safety_mode)
        return []


@pytest.mark.parametrize(("code", "name"), [(0, "inactive"), *NAMES, *STRANGE])
def test_a_stack_over_the_wire_lives_on_whatever_the_mode_xgv_50(
    monkeypatch: pytest.MonkeyPatch, code: int, name: str
) -> None:
    """XGV-50: 2 to 7 alike, and what is reserved is no mode to drive in."""
    monkeypatch.setattr(Line, "safety_mode", code)
    watcher = Watcher()
    stack = StackOverTheWire(watcher, CLIENT, 1, Line(), CAR, 0.1)
    stack.send(seen())
    stack.close()
    assert watcher.modes == [name]


@pytest.mark.parametrize(("code", "name"), [(3, "software_pause"), (12, "inactive")])
def test_the_example_lives_on_whatever_the_mode_xgv_50(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], code: int, name: str
) -> None:
    """XGV-50."""
    monkeypatch.setattr(Line, "safety_mode", code)
    monkeypatch.setattr("jaus.transports.UdpTransport", Line)
    monkeypatch.setattr(sys, "argv", [str(EXAMPLE), "--seconds", "0.01"])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    assert capsys.readouterr().out.splitlines()[0].endswith(name)
