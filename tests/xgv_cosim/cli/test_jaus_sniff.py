"""``xgv-cosim jaus sniff`` and ``--jaus-record``: live, filtered, and as files that others read."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from jaus.address import JausAddress
from jaus.capture import Captured, Recorder, read_pcap
from jaus.codec import encode
from jaus.errors import TransportError
from jaus.messages.core import RequestComponentControl, Resume
from jaus.packet import Framing, decode_packet, pack_datagrams, unpack_datagram
from jaus.transports import Sniffer
from xgv_cosim.cli.jaus import sniff
from xgv_cosim.errors import LinkError
from xgv_cosim.links.jaus_network import JausOptions
from xgv_cosim.runs import run_scenario
from xgv_cosim.scenario.loading import load_scenario

COMMAND = [sys.executable, "-c", "from xgv_cosim.cli import main; main()", "jaus", "sniff"]
PACKETS = (
    RequestComponentControl(6).to(JausAddress(1, 1, 10, 1), source=JausAddress(100, 1, 40, 1)),
    Resume().to(JausAddress(2, 1, 33, 1), source=JausAddress(100, 1, 40, 1)),
)


def may_sniff() -> bool:
    try:
        Sniffer().close()
    except TransportError:
        return False
    return True


@contextmanager
def traffic() -> Iterator[int]:
    """Send both messages and a piece of junk to a port again and again, and yield it."""
    ends = threading.Event()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as to,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out,
    ):
        to.bind(("127.0.0.1", 0))
        datagrams = [*pack_datagrams(Framing.JUDP1, [encode(packet) for packet in PACKETS]), b"\x01junk"]

        def send() -> None:
            while not ends.wait(0.05):
                for datagram in datagrams:
                    out.sendto(datagram, to.getsockname())

        thread = threading.Thread(target=send)
        thread.start()
        try:
            yield to.getsockname()[1]
        finally:
            ends.set()
            thread.join()


def sniffed(*arguments: str) -> subprocess.CompletedProcess[str]:
    with traffic() as port:
        command = [*COMMAND, "--port", str(port), "--seconds", "20", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.skipif(not may_sniff(), reason="needs the right to see raw packets (root)")
def test_messages_are_shown_as_they_pass(tmp_path: Path) -> None:
    capture = tmp_path / "seen.pcap"
    done = sniffed("--count", "6", "--pcap", str(capture))
    assert (done.returncode, done.stderr) == (0, "")
    rows = done.stdout.splitlines()
    assert any(
        re.fullmatch(
            r"\d\d:\d\d:\d\d\.\d{3}  127\.0\.0\.1:\d+ -> 127\.0\.0\.1:\d+  RequestComponentControl 0x000d  "
            r"100\.1\.40\.1 -> 1\.1\.10\.1  authority: 6",
            row,
        )
        for row in rows
    )
    assert any("no JAUS: JUDP1 datagram" in row for row in rows)
    assert len(rows) == 6
    recorded = list(read_pcap(capture.read_bytes()))
    assert len(recorded) >= 4
    assert abs(recorded[0].time_s - time.time()) < 120.0


@pytest.mark.skipif(not may_sniff(), reason="needs the right to see raw packets (root)")
@pytest.mark.parametrize(
    ("options", "name"),
    [
        (["--message", "Resume"], "Resume"),
        (["--message", "0x000d"], "RequestComponentControl"),
        (["--subsystem", "2"], "Resume"),
        (["--component", "10"], "RequestComponentControl"),
    ],
)
def test_only_what_is_asked_for(options: list[str], name: str) -> None:
    done = sniffed("--count", "3", "--json", *options)
    assert (done.returncode, done.stderr) == (0, "")
    shown = [json.loads(row) for row in done.stdout.splitlines()]
    assert [each["message"] for each in shown] == [name] * 3
    assert all(each["to"].startswith("127.0.0.1:") for each in shown)


@pytest.mark.skipif(not may_sniff(), reason="needs the right to see raw packets (root)")
def test_every_value_one_below_the_other() -> None:
    done = sniffed("--count", "1", "--full", "--message", "RequestComponentControl")
    assert done.stdout.splitlines()[1] == "  authority: 6"


@pytest.mark.skipif(not may_sniff(), reason="needs the right to see raw packets (root)")
@pytest.mark.parametrize("options", [[], ["--pcap", "seen.pcap"]])
def test_who_stops_reading_has_seen_enough(options: list[str], tmp_path: Path) -> None:
    """As ``head -1`` does: no error, whether it is recorded or not."""
    with traffic() as port:
        command = [*COMMAND, "--port", str(port), "--seconds", "20", *options]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, cwd=tmp_path) as sniffing:
            assert sniffing.stdout is not None
            assert sniffing.stderr is not None
            assert "127.0.0.1" in sniffing.stdout.readline()
            sniffing.stdout.close()
            assert sniffing.stderr.read() == ""
            assert sniffing.wait(30) == 0


class Broken:
    """A socket of an interface that goes down."""

    def __init__(self, *_: object) -> None:
        pass

    def bind(self, _: object) -> None:
        pass

    def settimeout(self, _: float) -> None:
        pass

    def recvfrom(self, _: int) -> bytes:
        raise OSError(100, "Network is down")

    def close(self) -> None:
        pass


@pytest.mark.skipif(not hasattr(socket, "AF_PACKET"), reason="raw packets are seen on Linux only")
def test_an_interface_that_fails_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """And not the file of the capture."""
    monkeypatch.setattr("jaus.transports.sniffer.socket.socket", Broken)
    with pytest.raises(LinkError, match=r"^jaus sniff: eth7: Network is down$"):
        sniff("eth7", pcap=tmp_path / "seen.pcap", seconds=1.0)


@pytest.mark.skipif(not hasattr(socket, "AF_PACKET"), reason="raw packets are seen on Linux only")
def test_a_capture_that_cannot_be_written_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Once it is full."""

    def seen(_self: object, _timeout_s: float) -> Captured:
        return Captured(0.0, ("127.0.0.1", 1), ("127.0.0.1", 3794), b"junk")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("jaus.transports.sniffer.socket.socket", Broken)
    monkeypatch.setattr(Sniffer, "receive", seen)
    monkeypatch.setattr(Recorder, "record", full)
    with pytest.raises(LinkError, match=r"^--pcap: .*seen\.pcap: No space left on device$"):
        sniff("eth7", pcap=tmp_path / "seen.pcap", seconds=1.0)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--message", "SetMotionProfil"], "did you mean 'SetMotionProfile'?"),
        (["--interface", "nosuch0", "--seconds", "1"], "nosuch0"),
        (["--pcap", "/nosuch/folder/x.pcap"], "--pcap: /nosuch/folder/x.pcap: No such file or directory"),
    ],
)
def test_what_cannot_be_done_is_told(arguments: list[str], words: str) -> None:
    done = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert words in done.stderr


def test_a_run_records_its_datagrams(tmp_path: Path) -> None:
    """Heartbeats of two cars to a peer that never speaks, with the simulation's time."""
    scenario = load_scenario("hello", ["duration_s=3", "expect=[]", "injections=[]"])
    capture = tmp_path / "run.pcap"
    options = JausOptions(port=0, peers=(("127.0.0.1", 9),), record=capture)
    run_scenario(scenario, tmp_path / "run", jaus=options)
    recorded = list(read_pcap(capture.read_bytes()))
    assert {each.destination for each in recorded} == {("127.0.0.1", 9)}
    names = []
    for each in recorded:
        framing, packets = unpack_datagram(each.datagram)
        names += [type(decode_packet(framing, packet)).__name__ for packet in packets]
    assert set(names) == {"ReportHeartbeatPulse"}
    assert 4 <= len(names) <= 8
    assert 0.0 <= recorded[0].time_s <= recorded[-1].time_s <= 3.0
