"""The library's README: its client talks to a peer, and its command line says what the page shows."""

from __future__ import annotations

import shlex
import socket
import subprocess
import sys
from pathlib import Path

import pytest

import jaus
from jaus.__main__ import main
from jaus.address import JausAddress
from jaus.messages.core import ConfirmComponentControl, RequestComponentControl, Resume
from jaus.messages.torc import SetMotionProfile
from jaus.packet import Framing, decode_packet, pack_datagrams, unpack_datagram
from tests.docs.test_readme_python import python_blocks

PAGE = Path(jaus.__file__).with_name("README.md")


def test_the_client_drives_a_peer() -> None:
    """At most 15 lines, over a real socket on loopback; only the port is another one.

    Both drivers have to be ready, or the car does not move (XGV-23).
    """
    (client,) = python_blocks(PAGE)
    assert len([line for line in client.splitlines() if line.strip()]) <= 15
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as car:
        car.bind(("127.0.0.1", 0))
        car.settimeout(30)
        code = client.replace("3794", str(car.getsockname()[1]))
        with subprocess.Popen(
            [sys.executable, "-W", "error", "-c", code], stdout=subprocess.PIPE, text=True
        ) as process:
            heard = []
            for _ in range(4):
                datagram, peer = car.recvfrom(65535)
                framing, (packet,) = unpack_datagram(datagram)
                heard.append(decode_packet(framing, packet))
            asker, own = heard[0].header.source, heard[0].header.destination
            answer = jaus.encode(ConfirmComponentControl().to(asker, source=own))
            car.sendto(pack_datagrams(Framing.JUDP1, [answer])[0], peer)
            shown, _ = process.communicate(timeout=30)
    profiles, primitive = JausAddress(1, 1, 10, 1), JausAddress(1, 1, 33, 1)
    assert [(type(message), message.header.destination) for message in heard] == [
        (RequestComponentControl, profiles),
        (Resume, primitive),
        (Resume, profiles),
        (SetMotionProfile, profiles),
    ]
    assert process.returncode == 0
    assert shown.startswith("ConfirmComponentControl(")
    assert "response=0" in shown


def test_the_command_line_says_what_the_page_shows(capsys: pytest.CaptureFixture[str]) -> None:
    console = PAGE.read_text().split("```console\n")[1].split("```")[0]
    command, shown = console.split("\n", 1)
    words = shlex.split(command)
    assert words[:4] == ["$", "python", "-m", "jaus"]
    assert main(words[4:]) == 0
    assert capsys.readouterr().out == shown


def test_every_module_it_names_is_there() -> None:
    rows = [line.split("|")[1] for line in PAGE.read_text().splitlines() if line.startswith("| `jaus.")]
    names = {name.strip("` ") for row in rows for name in row.split(",")}
    files = {f"jaus.{path.stem}" for path in PAGE.parent.glob("*.py")} | {"jaus.messages", "jaus.transports"}
    assert names <= files
    inner = {"__init__", "__main__", "as5669a", "errors", "event_queue", "generator", "status"}
    assert files - names == {f"jaus.{name}" for name in inner}
