"""What three public clients of the real car do, over real sockets, against a run in a process of its own.

TORC's sends motion profiles at 50 Hz, LCAD's wrench efforts at 50 Hz, Glidepath's acknowledged profiles at
10 Hz. What each asks for, in which order and how often, is read from their published sources.
"""

from __future__ import annotations

import json
import select
import socket
import statistics
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import pytest

from jaus.address import ComponentId, JausAddress
from jaus.codec import Decoded, encode
from jaus.component import ComponentStatus
from jaus.header import Acknowledgement
from jaus.messages import Ack, Message
from jaus.messages.core import (
    ConfirmComponentControl,
    CreateServiceConnection,
    ReleaseComponentControl,
    ReportComponentControl,
    ReportComponentStatus,
    ReportHeartbeatPulse,
    RequestComponentControl,
    Resume,
    Standby,
)
from jaus.messages.platform import (
    ReportDiscreteDevices,
    ReportVelocityState,
    ReportWrenchEffort,
    SetDiscreteDevices,
    SetWrenchEffort,
)
from jaus.messages.torc import (
    Motion,
    ReportCurvature,
    ReportErrorCount,
    ReportSignals,
    ReportVehicleMode,
    ReportWheelsSpeed,
    SetMotionProfile,
)
from jaus.packet import Framing, decode_packet, pack_datagrams, unpack_datagram
from jaus.vehicle_mode import ControlMode, SafetyMode

NM, PD, MPD, VSS, SD, EM = (
    ComponentId.NODE_MANAGER,
    ComponentId.PRIMITIVE_DRIVER,
    ComponentId.MOTION_PROFILE_DRIVER,
    ComponentId.VELOCITY_STATE_SENSOR,
    ComponentId.SIGNALS_DRIVER,
    ComponentId.ERROR_MANAGER,
)
RUN = [sys.executable, "-c", "from xgv_cosim.cli import main; main()", "run", "hello"]
RUN_S = 15
RATES_OVER_S = 6.5
OPTIONS = ["injections=[]", "expect=[]", f"duration_s={RUN_S}", "bind.0.stack=external"]


@dataclass
class Client:
    """One socket of a client, and what came to it."""

    address: JausAddress
    subsystem: int
    car: tuple[str, int] = ("127.0.0.1", 0)
    heard: list[tuple[float, Decoded]] = field(default_factory=list)
    sequence: int = 0

    def __post_init__(self) -> None:
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.bind(("127.0.0.1", 0))
        self.line.setblocking(False)

    @property
    def place(self) -> tuple[str, int]:
        host, port = self.line.getsockname()
        return host, port

    def say(self, message: Message, component: ComponentId, *, wants_ack: bool = False) -> int:
        wanted = Acknowledgement.REQUESTED if wants_ack else Acknowledgement.NONE
        self.sequence += 1
        to = JausAddress(self.subsystem, 1, component, 1)
        message.to(to, source=self.address, sequence=self.sequence, acknowledgement=wanted)
        for datagram in pack_datagrams(Framing.JUDP1, [encode(message)]):
            self.line.sendto(datagram, self.car)
        return self.sequence

    def listen(self, now_s: float) -> list[Decoded]:
        """Take what has come."""
        found: list[Decoded] = []
        while select.select([self.line], [], [], 0.0)[0]:
            framing, packets = unpack_datagram(self.line.recv(65535))
            assert framing is Framing.JUDP1  # answered in kind
            found += [decode_packet(framing, packet) for packet in packets]
        self.heard += [(now_s, message) for message in found]
        return found

    def of(self, kind: type[Message], component: ComponentId | None = None) -> list[tuple[float, Message]]:
        return [
            (at_s, message)
            for at_s, message in self.heard
            if isinstance(message, kind)
            and (component is None or message.header.source.component == component)
        ]

    def rate_hz(self, kind: type[Message], component: ComponentId) -> float:
        """Return how often a report came in the last seconds: at first, kernels may have to be compiled."""
        last_s = self.of(kind, component)[-1][0]
        times = [at_s for at_s, _ in self.of(kind, component) if at_s > last_s - RATES_OVER_S]
        return (len(times) - 1) / (times[-1] - times[0])


class Torc(Client):
    """TORC's own: speed only, so the car's display is set to manual steering; eight service connections."""

    def begin(self) -> None:
        self.say(ReleaseComponentControl(), PD)
        for report, component, rate_hz, fields in (
            (ReportVelocityState, VSS, 50.0, 1),
            (ReportVehicleMode, NM, 5.0, 0xFF),
            (ReportWrenchEffort, PD, 50.0, 0x61),
            (ReportComponentControl, PD, 1.0, 0),
            (ReportComponentControl, MPD, 1.0, 0),
            (ReportDiscreteDevices, PD, 10.0, 0xFF),
            (ReportComponentStatus, PD, 5.0, 0),
            (ReportComponentStatus, MPD, 5.0, 0),
        ):
            self.say(CreateServiceConnection(report.code, rate_hz, fields), component)

    def tick(self) -> None:
        """At 50 Hz: ask again for all that may not be there yet, and repeat the command."""
        self.say(RequestComponentControl(6), MPD)
        self.say(Resume(), PD)
        self.say(Resume(), MPD)
        self.say(SetMotionProfile(motions=(Motion(6.0, 2.0, 0.0, 0.1, 400),)), MPD)


class Lcad(Client):
    """LCAD's: throttle, brake and steering through the Primitive Driver."""

    def begin(self) -> None:
        self.say(ReleaseComponentControl(), MPD)
        self.say(RequestComponentControl(6), PD)
        self.say(Resume(), PD)
        for report, component, rate_hz in (
            (ReportVelocityState, VSS, 2.0),
            (ReportCurvature, MPD, 40.0),
            (ReportWheelsSpeed, PD, 40.0),
            (ReportWrenchEffort, PD, 20.0),
            (ReportDiscreteDevices, PD, 2.0),
            (ReportSignals, SD, 2.0),
            (ReportComponentStatus, PD, 5.0),
            (ReportErrorCount, EM, 2.0),
        ):
            self.say(CreateServiceConnection(report.code, rate_hz, 0xFFFF), component)

    def tick(self) -> None:
        """At 50 Hz."""
        self.say(SetDiscreteDevices(gear=2), PD)
        self.say(
            SetWrenchEffort(
                propulsive_linear_x_percent=25.0,
                propulsive_rotational_z_percent=0.0,
                resistive_linear_x_percent=0.0,
            ),
            PD,
        )


@dataclass
class Glidepath(Client):
    """Glidepath's: waits for a heartbeat, then profiles of 200 ms at 10 Hz, each acknowledged in 20 ms."""

    sent_s: dict[int, float] = field(default_factory=dict)
    acknowledged_ms: list[float] = field(default_factory=list)
    has_begun: bool = False

    def on(self, message: Decoded, now_s: float) -> None:
        if isinstance(message, ReportHeartbeatPulse) and not self.has_begun:
            self.has_begun = True
            self.say(RequestComponentControl(255), MPD)
            self.say(Resume(), PD)
            self.say(Resume(), MPD)
            self.say(CreateServiceConnection(ReportVehicleMode.code, 5.0, 0xFF), NM)
            self.say(CreateServiceConnection(ReportVelocityState.code, 10.0, 0xFFFF), VSS)
        if isinstance(message, Ack) and message.positive and message.sequence in self.sent_s:
            self.acknowledged_ms.append(1000.0 * (now_s - self.sent_s.pop(message.sequence)))

    def tick(self, now_s: float) -> None:
        """At 10 Hz."""
        if self.has_begun:
            motions = (Motion(8.0, 1.5, 0.0, 0.1, 200),)
            self.sent_s[self.say(SetMotionProfile(motions=motions), MPD, wants_ack=True)] = now_s


@dataclass
class Run:
    """A run that clients can reach, and what it left behind."""

    process: subprocess.Popen[str]
    folder: Path

    def places(self, count: int) -> dict[str, tuple[int, tuple[str, int]]]:
        """Return subsystem and place of the vehicles, from the lines that the run prints."""
        found: dict[str, tuple[int, tuple[str, int]]] = {}
        out: IO[str] = self.process.stdout  # type: ignore[assignment]
        while len(found) < count:
            line = out.readline()
            assert line, self.process.communicate()
            if line.startswith("JAUS subsystem"):
                _, _, number, _, place, vehicle = line.split()
                host, _, port = place.rstrip(":").rpartition(":")
                found[vehicle] = int(number), (host, int(port))
        return found

    def end(self) -> tuple[dict[str, object], list[dict[str, object]]]:
        """Return result and events."""
        output, errors = self.process.communicate(timeout=120)
        assert self.process.returncode == 0, output + errors
        events = [json.loads(line) for line in (self.folder / "events.jsonl").read_text().splitlines()]
        return json.loads((self.folder / "result.json").read_text()), events


def start(folder: Path, *more: str, peer: tuple[str, int] | None = None) -> Run:
    sets = [part for option in (*OPTIONS, *more) for part in ("--set", option)]
    peers = [] if peer is None else ["--jaus-peer", f"{peer[0]}:{peer[1]}"]
    arguments = [*RUN, "--jaus", "127.0.0.1:0", *peers, *sets, "--out", str(folder)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return Run(subprocess.Popen(arguments, **pipes), folder)  # type: ignore[call-overload]


def in_time(client: Client, run: Run, tick: object, period_s: float, seconds: float) -> None:
    """Let a client listen all the time, and act with its period."""
    began_s = time.monotonic()
    next_s = now_s = 0.0
    while now_s < seconds and run.process.poll() is None:
        if now_s >= next_s:
            next_s += period_s
            tick(now_s)  # type: ignore[operator]
        select.select([client.line], [], [], max(0.0, min(next_s - now_s, 0.02)))
        now_s = time.monotonic() - began_s
        for message in client.listen(now_s):
            if isinstance(client, Glidepath):
                client.on(message, now_s)


def changes(events: list[dict[str, object]], vehicle: str, kind: str) -> list[object]:
    return [event["to"] for event in events if event["vehicle"] == vehicle and event["kind"] == kind]


@pytest.mark.slow
def test_torcs_client(tmp_path: Path) -> None:
    """Speed by motion profiles, steering by the driver (partial mode), eight service connections (XGV-61)."""
    run = start(tmp_path / "run", "bind.0.partial=manual_steering")
    client = Torc(JausAddress(1, 2, 4, 1), 1)
    try:
        _, client.car = run.places(1)["xgv_0"]
        client.begin()
        in_time(client, run, lambda _: client.tick(), 0.02, RUN_S - 3.0)
        result, events = run.end()
    finally:
        run.process.kill()
        client.line.close()
    granted = Counter(type(message).__name__ for _, message in client.heard)
    assert granted["ConfirmServiceConnection"] == 8
    assert changes(events, "xgv_0", "control_mode")[-1] != "wrench_efforts"
    assert "drive_by_wire" in changes(events, "xgv_0", "safety_mode")
    assert changes(events, "xgv_0", "speed_control")[0] == "computer"
    _, mode = client.of(ReportVehicleMode)[-1]
    assert isinstance(mode, ReportVehicleMode)
    assert (mode.control_mode, mode.safety_mode) == (ControlMode.MOTION_PROFILES, SafetyMode.DRIVE_BY_WIRE)
    assert mode.partial_override_bits == 0b01
    velocities = [message.velocity_x_mps for _, message in client.of(ReportVelocityState)]  # type: ignore[attr-defined]
    assert velocities[-1] == pytest.approx(6.0, abs=0.3)
    assert all(message.presence_vector == 1 for _, message in client.of(ReportVelocityState))
    statuses = {
        message.header.source.component: message.primary_status  # type: ignore[attr-defined]
        for _, message in client.of(ReportComponentStatus)
    }
    assert statuses == {PD: ComponentStatus.READY, MPD: ComponentStatus.READY}
    for report, component, rate_hz in (
        (ReportVelocityState, VSS, 50.0),
        (ReportWrenchEffort, PD, 50.0),
        (ReportDiscreteDevices, PD, 10.0),
        (ReportVehicleMode, NM, 5.0),
        (ReportComponentStatus, MPD, 5.0),
        (ReportComponentControl, PD, 1.0),
    ):
        assert client.rate_hz(report, component) == pytest.approx(rate_hz, rel=0.02), report
    assert result["real_time_factor"] == pytest.approx(1.0, abs=0.1)
    assert result["jaus"]["refused"] == 0  # type: ignore[index]


@pytest.mark.slow
def test_lcads_client(tmp_path: Path) -> None:
    """Throttle, brake and steering at 50 Hz; signals, errors, wheels and curvature are reported."""
    run = start(tmp_path / "run")
    client = Lcad(JausAddress(1, 2, 4, 1), 1)
    try:
        _, client.car = run.places(1)["xgv_0"]
        client.begin()
        in_time(client, run, lambda _: client.tick(), 0.02, 8.0)
        _, events = run.end()
    finally:
        run.process.kill()
        client.line.close()
    assert changes(events, "xgv_0", "control_mode")[0] == "wrench_efforts"
    assert "drive_by_wire" in changes(events, "xgv_0", "safety_mode")
    assert "9158" in [str(code) for code in changes(events, "xgv_0", "error")]  # he fell silent (XGV-43)
    reported = Counter(type(message).__name__ for _, message in client.heard)
    for name in (
        "ReportCurvature",
        "ReportWheelsSpeed",
        "ReportWrenchEffort",
        "ReportSignals",
        "ReportErrorCount",
    ):
        assert reported[name] > 5, name
    assert client.rate_hz(ReportWheelsSpeed, PD) == pytest.approx(40.0, rel=0.02)
    _, efforts = client.of(ReportWrenchEffort)[-1]
    assert isinstance(efforts, ReportWrenchEffort)
    assert efforts.propulsive_linear_x_percent == pytest.approx(25.0, abs=1.0)
    assert efforts.presence_vector == 0x61


@pytest.mark.slow
def test_glidepaths_client(tmp_path: Path) -> None:
    """Nothing before a heartbeat; each profile acknowledged; it leaves by Standby and Release."""
    client = Glidepath(JausAddress(7, 129, 183, 15), 1)
    run = start(tmp_path / "run", peer=client.place)
    try:
        _, client.car = run.places(1)["xgv_0"]
        in_time(client, run, client.tick, 0.1, 9.0)
        client.say(Standby(), MPD)
        client.say(ReleaseComponentControl(), MPD)
        in_time(client, run, lambda _: None, 0.1, 1.0)
        _, events = run.end()
    finally:
        run.process.kill()
        client.line.close()
    assert client.has_begun
    assert [m.response for _, m in client.of(ConfirmComponentControl)] == [0]  # type: ignore[attr-defined]
    assert len(client.acknowledged_ms) >= 75
    assert len(client.sent_s) <= 1  # the last one may be under way
    assert statistics.median(client.acknowledged_ms) < 20.0
    velocities = [m.velocity_x_mps for _, m in client.of(ReportVelocityState)]  # type: ignore[attr-defined]
    assert velocities[-10] == pytest.approx(8.0, abs=0.4)
    assert all(m.presence_vector == 0x0101 for _, m in client.of(ReportVelocityState))
    assert changes(events, "xgv_0", "ready_mode")[-1] == "software_pause"
    assert changes(events, "xgv_0", "safety_mode")[-1] == "software_pause"


def test_the_example_drives_a_car_from_a_process_of_its_own(tmp_path: Path) -> None:
    run = start(tmp_path / "run", "duration_s=8")
    try:
        subsystem, (_, port) = run.places(2)["xgv_1"]
        example = Path(__file__).parents[2] / "examples" / "jaus_client.py"
        options = ["--port", str(port), "--subsystem", str(subsystem), "--speed", "7", "--seconds", "30"]
        driven = subprocess.run(
            [sys.executable, example, *options], capture_output=True, text=True, timeout=60, check=False
        )
        result, events = run.end()
    finally:
        run.process.kill()
    assert (driven.returncode, driven.stderr) == (0, "")
    assert "drive_by_wire" in driven.stdout
    assert "drive_by_wire" in changes(events, "xgv_1", "safety_mode")
    assert "drive_by_wire" not in changes(events, "xgv_0", "safety_mode")
    assert result["status"] == "ok"
