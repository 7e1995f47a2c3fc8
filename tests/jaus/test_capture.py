"""Captures: the bytes of the pcap format, there and back, and ``python -m jaus read``."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaus.__main__ import main
from jaus.capture import PCAP_HEADER, Captured, Recorder, pcap_record, read_pcap
from jaus.errors import DecodeError, EncodeError
from jaus.packet import Framing, pack_datagrams
from tests.jaus.golden import GOLDEN

CLIENT, CAR = ("192.168.0.5", 40000), ("192.168.0.100", 3794)
RESUME = pack_datagrams(Framing.JUDP1, [GOLDEN[3].data])[0]

times_s = st.integers(0, 2**32 - 1).map(float)
places = st.tuples(st.ip_addresses(v=4).map(str), st.integers(0, 65535))


def test_a_record_byte_for_byte() -> None:
    """Little-endian times and sizes, then an IPv4 packet whose checksum is right, then UDP."""
    data = PCAP_HEADER + pcap_record(Captured(1.5, CLIENT, CAR, b"\x01\x02\x03"))
    assert data.hex(" ") == (
        "d4 c3 b2 a1 02 00 04 00 00 00 00 00 00 00 00 00 ff ff 00 00 65 00 00 00 "
        "01 00 00 00 20 a1 07 00 1f 00 00 00 1f 00 00 00 "
        "45 00 00 1f 00 00 00 00 40 11 f9 14 c0 a8 00 05 c0 a8 00 64 "
        "9c 40 0e d2 00 0b 00 00 01 02 03"
    )
    words = struct.unpack(">10H", data[40:60])
    total = sum(words)
    assert (total & 0xFFFF) + (total >> 16) == 0xFFFF


@given(
    st.lists(
        st.builds(Captured, st.integers(0, 2**32 - 1).map(float), places, places, st.binary(max_size=99))
    )
)
def test_what_is_written_is_read(captured: list[Captured]) -> None:
    data = PCAP_HEADER + b"".join(map(pcap_record, captured))
    assert list(read_pcap(data)) == captured


@pytest.mark.parametrize(
    "captured",
    [
        Captured(-1.0, CLIENT, CAR, b""),
        Captured(float("nan"), CLIENT, CAR, b""),
        Captured(0.0, ("localhost", 1), CAR, b""),
        Captured(0.0, ("::1", 1), CAR, b""),
        Captured(0.0, ("1.2.3.4", 65536), CAR, b""),
        Captured(0.0, CLIENT, CAR, bytes(65536)),
    ],
)
def test_what_has_no_form_is_told(captured: Captured) -> None:
    with pytest.raises(EncodeError, match="record of a capture"):
        pcap_record(captured)


def ethernet(order: str, magic: int, packets: list[bytes], link: int = 1) -> bytes:
    """Return a capture as tcpdump writes it on an Ethernet."""
    data = struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, 65535, link)
    return data + b"".join(
        struct.pack(f"{order}IIII", 7, 250, len(packet), len(packet)) + packet for packet in packets
    )


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("magic", "time_s"), [(0xA1B2C3D4, 7.00025), (0xA1B23C4D, 7.00000025)])
def test_captures_of_others_are_read(order: str, magic: int, time_s: float) -> None:
    ip = pcap_record(Captured(0.0, CLIENT, CAR, RESUME))[16:]
    frames = [bytes(12) + b"\x08\x06" + bytes(46), bytes(12) + b"\x08\x00" + ip + bytes(6)]
    tcp = ip[:9] + b"\x06" + ip[10:]
    frames += [bytes(12) + b"\x08\x00" + tcp, bytes(12) + b"\x08\x00" + ip[:22], b""]
    (found,) = read_pcap(ethernet(order, magic, frames))
    assert found.time_s == pytest.approx(time_s, abs=1e-12)
    assert found[1:] == (CLIENT, CAR, RESUME)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "does not begin as a pcap file"),
        (b"\x0a\x0d\x0d\x0a" + bytes(40), "pcapng is not read"),
        (ethernet("<", 0xA1B2C3D4, [], link=113), "link type 113"),
        (PCAP_HEADER + bytes(15), "cut short after 39 bytes"),
        ((PCAP_HEADER + pcap_record(Captured(0.0, CLIENT, CAR, RESUME)))[:-1], "cut short"),
    ],
)
def test_what_is_no_capture_is_told(data: bytes, reason: str) -> None:
    with pytest.raises(DecodeError, match=reason):
        list(read_pcap(data))


@given(st.binary(max_size=120))
def test_any_bytes_are_a_capture_or_a_decode_error(data: bytes) -> None:
    try:
        list(read_pcap(PCAP_HEADER + data))
    except DecodeError:
        return


def test_a_recorder_writes_what_is_read(tmp_path: Path) -> None:
    """Each datagram is there as soon as it is recorded; one that has no form leaves the file whole."""
    path = tmp_path / "drive.pcap"
    path.write_bytes(b"from before")
    with Recorder(path) as recorder:
        assert list(read_pcap(path.read_bytes())) == []
        recorder.record(RESUME, CLIENT, CAR, 0.02)
        with pytest.raises(EncodeError, match="record of a capture"):
            recorder.record(RESUME, ("localhost", 1), CAR, 0.03)
        assert list(read_pcap(path.read_bytes())) == [Captured(0.02, CLIENT, CAR, RESUME)]
        recorder.record(b"", CAR, CLIENT, 1.5)
    recorder.close()
    assert list(read_pcap(path.read_bytes()))[1:] == [Captured(1.5, CAR, CLIENT, b"")]
    with pytest.raises(ValueError, match="closed"):
        recorder.record(RESUME, CLIENT, CAR, 2.0)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "drive.pcap"
    records = [
        Captured(0.02, CLIENT, CAR, RESUME),
        Captured(0.03, CLIENT, ("192.168.0.7", 53), b"something else"),
        Captured(0.04, CAR, CLIENT, b"\x01\x00"),
    ]
    path.write_bytes(PCAP_HEADER + b"".join(map(pcap_record, records)))
    return path


def test_a_capture_is_shown_as_text(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["read", str(file)]) == 1
    shown = capsys.readouterr()
    assert shown.out.splitlines() == [
        "0.020000 s  192.168.0.5:40000 -> 192.168.0.100:3794  JUDP1",
        "Resume 0x0004  2.2.4.1 -> 2.1.33.1  sequence 263, priority 6",
        "0.040000 s  192.168.0.100:3794 -> 192.168.0.5:40000  no framing",
    ]
    assert "neither a datagram" in shown.err


def test_a_capture_is_shown_as_json(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["read", "--json", "--port", "0", str(file)]) == 1
    documents = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [document["time_s"] for document in documents] == [0.02, 0.03, 0.04]
    assert documents[0]["messages"][0]["message"] == "Resume"
    assert (documents[0]["from"], documents[0]["to"]) == ("192.168.0.5:40000", "192.168.0.100:3794")


def test_who_reads_only_the_beginning_sees_no_traceback(tmp_path: Path) -> None:
    """As ``python -m jaus read X | head -1``: more than a pipe holds, and a reader that goes away."""
    path = tmp_path / "long.pcap"
    path.write_bytes(PCAP_HEADER + 2000 * pcap_record(Captured(0.0, CLIENT, CAR, RESUME)))
    with subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "jaus", "read", str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline().startswith(b"0.000000 s")
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(timeout=30) == 0


def test_a_file_that_is_not_there_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["read", str(tmp_path / "none.pcap")])
    assert left.value.code == 1
    assert "No such file" in capsys.readouterr().err
