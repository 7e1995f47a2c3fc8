"""Messages as text and as JSON, and ``python -m jaus decode``."""

from __future__ import annotations

import io
import json
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaus.__main__ import main
from jaus.address import JausAddress
from jaus.codec import encode, encode_parts
from jaus.header import Acknowledgement, Header
from jaus.messages import MESSAGES, Ack, Message, UnknownMessage
from jaus.messages.core import CreateServiceConnection, ReportTime, Resume
from jaus.messages.discovery import ComponentEntry, NodeEntry, ReportConfiguration, ReportIdentification
from jaus.messages.events import CreateEvent
from jaus.messages.torc import Horn, ReportErrorCount, SetSignals
from jaus.packet import Framing, pack_datagrams
from jaus.stamps import DateStamp, TimeStamp
from jaus.text import lines, plain
from tests.jaus.golden import GOLDEN
from tests.jaus.test_codec_properties import messages

OWN = JausAddress(1, 1, 33, 1)
CLIENT = JausAddress(1, 2, 4, 1)


def test_words_stand_beside_numbers() -> None:
    time = ReportTime(TimeStamp(8, 7, 6, 45, 123).packed, DateStamp(2026, 12, 8).packed).to(
        CLIENT, source=OWN
    )
    assert lines(time) == [
        "ReportTime 0x4011  1.1.33.1 -> 1.2.4.1  sequence 0, priority 6",
        "  time_stamp: 1103541371 (day 8, 07:06:45.123)",
        "  date_stamp: 13704 (2026-12-08)",
    ]
    errors = ReportErrorCount(errors=(9157, 1)).to(CLIENT, source=OWN)
    assert lines(errors)[3:] == ["  errors[0]: 9157 (motion_profiles_timeout)", "  errors[1]: 1"]


def test_groups_have_paths() -> None:
    nodes = (NodeEntry(1, (ComponentEntry(1, 1), ComponentEntry(33, 1))),)
    message = ReportConfiguration(nodes).to(CLIENT, source=OWN)
    assert lines(message)[1:] == [
        "  nodes[0].node: 1",
        "  nodes[0].components[0].component: 1",
        "  nodes[0].components[0].instance: 1",
        "  nodes[0].components[1].component: 33",
        "  nodes[0].components[1].instance: 1",
    ]
    assert plain(message)["fields"] == {
        "nodes": [
            {"node": 1, "components": [{"component": 1, "instance": 1}, {"component": 33, "instance": 1}]}
        ]
    }


def test_what_is_absent_is_not_shown() -> None:
    message = SetSignals(horn=Horn(1)).to(OWN, source=CLIENT)
    assert lines(message)[1:] == [
        "  version: 0",
        "  horn.on: 1",
        "  horn.on_period: 0",
        "  horn.off_period: 0",
    ]
    shown = plain(message)
    assert shown["presence_vector"] == 2
    assert shown["fields"] == {"version": 0, "horn": {"on": 1, "on_period": 0, "off_period": 0}}


def test_the_header_is_told_where_it_is_not_the_usual_one() -> None:
    message = CreateServiceConnection(0x4404, 50.0, 1).to(
        OWN, source=CLIENT, sequence=3, acknowledgement=Acknowledgement.REQUESTED
    )
    assert lines(message)[0] == (
        "CreateServiceConnection 0x0008  1.2.4.1 -> 1.1.33.1  "
        "sequence 3, priority 6, acknowledgement requested, service connection"
    )
    assert repr(message.header) == (
        "<Header 1.2.4.1 -> 1.1.33.1, sequence 3, acknowledgement requested, service connection>"
    )


def test_what_is_no_declared_message_is_shown_too() -> None:
    header = Header(OWN, CLIENT, 4)
    assert lines(UnknownMessage(0x2801, b"\1\2", header=header)) == [
        "UnknownMessage 0x2801  1.2.4.1 -> 1.1.33.1  sequence 4, priority 6",
        "  body: 01 02",
    ]
    assert plain(Ack(4, 7, positive=False, header=header))["positive"] is False
    part = encode_parts(UnknownMessage(0x2801, b"\1\2", header=header), 1)[0]
    assert main(["decode", part.hex()]) == 0


@pytest.mark.parametrize("kind", MESSAGES.values(), ids=lambda kind: kind.__name__)
@settings(max_examples=5)
@given(data=st.data())
def test_every_message_has_text_and_json(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(kind)).to(OWN, source=CLIENT)
    assert json.loads(json.dumps(plain(message)))["message"] == kind.__name__
    assert len(lines(message)) >= 1


def test_json_has_no_word_for_infinity() -> None:
    message = CreateEvent(1, 0x4404, 1, upper_limit=(7, float("inf"))).to(OWN, source=CLIENT)
    assert "Infinity" not in json.dumps(plain(message))


def test_foreign_text_does_not_reach_the_terminal_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """A name may hold an escape sequence, or a line that looks like one of ours."""
    name = "a\x1b[2J\nb\x9b1m\x7f\xad\xe9"
    message = ReportIdentification(2, 0, 10001, name).to(CLIENT, source=OWN)
    assert lines(message)[-1] == "  identification: a\\x1b[2J\\nb\\x9b1m\\x7f\\xad\xe9"
    assert main(["decode", "--json", encode(message).hex()]) == 0
    shown = capsys.readouterr().out
    assert json.loads(shown)["messages"][0]["fields"]["identification"] == name
    assert shown.replace("\n", "").isascii()
    assert shown.replace("\n", "").isprintable()


def test_a_datagram_with_several_messages_is_decoded(capsys: pytest.CaptureFixture[str]) -> None:
    packets = [golden.data for golden in GOLDEN[:3]]
    (datagram,) = pack_datagrams(Framing.OPC, packets, max_messages=3)
    assert main(["decode", "--json", datagram.hex(":")]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["framing"] == "OPC"
    assert [message["code"] for message in shown["messages"]] == ["0x0001", "0x0002", "0x0003"]


def test_what_is_understood_is_shown_beside_what_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    good = encode(Resume().to(OWN, source=CLIENT))
    bad = bytes.fromhex("06020d00012101020104020202000701 0600")
    (datagram,) = pack_datagrams(Framing.JUDP1, [bad, good], max_messages=2)
    assert main(["decode", datagram.hex()]) == 1
    shown = capsys.readouterr()
    assert shown.out.startswith("Resume 0x0004")
    assert "RequestComponentControl (0x000d) with a body of 2 bytes: 1 bytes more" in shown.err
    assert main(["decode", "--json", datagram.hex()]) == 1
    assert "error" in json.loads(capsys.readouterr().out)["messages"][0]


def test_what_is_neither_datagram_nor_message_says_both(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["decode", "06 02"]) == 1
    told = capsys.readouterr().err
    assert "begins with 06 02, expected 01, 02 or JAUS01.0" in told
    assert "got 2 bytes, expected 16 or more" in told


def test_text_that_is_no_hex_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["decode", "xyz"])
    assert left.value.code == 2
    assert "expected pairs of the digits" in capsys.readouterr().err


def test_standard_input_is_read(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(GOLDEN[3].data.hex() + "\n"))
    assert main(["decode", "-"]) == 0
    assert capsys.readouterr().out.startswith("Resume 0x0004")


def test_it_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "jaus", "decode", GOLDEN[3].data.hex()],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Resume 0x0004  2.2.4.1 -> 2.1.33.1  sequence 263")
