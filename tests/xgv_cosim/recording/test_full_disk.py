"""A full disk: one clear message, whole lines, whole files, and the trajectories so far."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from xgv_cosim.errors import RecordingError
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import Recorder, disk, read_trace, read_trajectory
from xgv_cosim.recording.disk import LineLog, Reserve, write_whole_file


class FullDisk:
    """Stands in for ``os.write``: takes so many bytes, then none."""

    def __init__(self, room: int) -> None:
        self.room = room

    def __call__(self, descriptor: int, data: memoryview) -> int:
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        taken = _REAL_WRITE(descriptor, data[: self.room])
        self.room -= taken
        return taken


_REAL_WRITE = os.write


@pytest.fixture
def fill(monkeypatch: pytest.MonkeyPatch):
    def fill_up(room: int) -> FullDisk:
        full = FullDisk(room)
        monkeypatch.setattr(disk.os, "write", full)
        return full

    return fill_up


def test_a_log_never_ends_in_half_a_line(tmp_path: Path, fill) -> None:
    log = LineLog(tmp_path / "log")
    log.append("whole")
    full = fill(3)
    with pytest.raises(OSError, match="No space"):
        log.append("does not fit")
    assert (tmp_path / "log").read_text() == "whole\n"
    full.room = 1000
    log.append("fits again")
    log.close()
    assert (tmp_path / "log").read_text() == "whole\nfits again\n"


def test_no_half_file_shows_and_an_old_one_stays(tmp_path: Path, fill) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    fill(2)
    with pytest.raises(OSError, match="No space"):
        write_whole_file(path, b"new content")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_reserve_really_takes_room_without_a_name(tmp_path: Path) -> None:
    reserve = Reserve(tmp_path / ".reserve")
    reserve.hold(1 << 20)
    assert list(tmp_path.iterdir()) == []
    status = os.fstat(reserve._descriptor)  # type: ignore[arg-type]
    assert status.st_blocks * 512 >= 1 << 20
    assert reserve.give_up()
    assert not reserve.give_up()


def test_when_events_fill_the_disk_the_rest_is_written(
    tmp_path: Path, fleet: Fleet, make_snapshot, fill
) -> None:
    recorder = Recorder(tmp_path / "run", safety_mode_name=str, reserve_bytes=1 << 16)
    recorder.record_event(Event(0.0, "xgv_0", "first"))
    for tick in (10, 20):
        recorder.record_step(tick, fleet, make_snapshot("xgv_0"))
    full = fill(10)
    with pytest.raises(
        RecordingError, match=r"events\.jsonl: No space left on device\. Readable in .*2 steps"
    ):
        recorder.record_event(Event(0.2, "xgv_0", "second"))
    full.room = 1 << 16  # what giving up the reserve frees
    recorder.close()
    lines = (tmp_path / "run/events.jsonl").read_text().splitlines()
    assert [json.loads(line)["kind"] for line in lines] == ["first"]
    assert len(read_trace(tmp_path / "run/trace.csv")) == 2
    assert read_trajectory(tmp_path / "run/trajectory.parquet").num_rows == 2


def test_when_nothing_fits_at_the_end_the_logs_remain_and_no_half_file(
    tmp_path: Path, fleet: Fleet, make_snapshot, fill
) -> None:
    recorder = Recorder(tmp_path / "run", safety_mode_name=str, reserve_bytes=1 << 16)
    recorder.record_step(10, fleet, make_snapshot("xgv_0"))
    fill(600)
    with pytest.raises(RecordingError, match=r"trajectory\.parquet: No space left"):
        recorder.close()
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == [
        "events.jsonl",
        "road.json",
        "trace.csv",
    ]
    assert len(read_trace(tmp_path / "run/trace.csv")) == 1


def test_no_room_at_the_start_is_said_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(descriptor: int, start: int, length: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(disk.os, "posix_fallocate", refuse)
    with pytest.raises(RecordingError, match=r"No space left on device\. A run needs 8 MiB or more"):
        Recorder(tmp_path / "run", safety_mode_name=str)


FILL_A_REAL_DISK = """
import sys
from pathlib import Path
import numpy as np
from xgv_cosim.errors import RecordingError
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import Recorder
from xgv_cosim.snapshot import Snapshot

fleet = Fleet()
fleet.occupy("xgv_0")
one, none = np.ones(1), np.full(1, -1, np.int64)
recorder = Recorder(Path(sys.argv[1]) / "run", safety_mode_name=str, reserve_bytes=1 << 20)
try:
    for step in range(100_000):
        snapshot = Snapshot(0.1 * step, ("xgv_0",), ("car",), one * step, one, one, one, one, one, one,
                            none, one, none, none, one, none, one, one, one, one > 0.0)
        recorder.record_step(10 * step, fleet, snapshot)
        recorder.record_event(Event(0.1 * step, "xgv_0", "note", reasons=("x" * 2000,)))
except RecordingError as error:
    recorder.close()
    print(recorder.num_steps, str(error))
"""


def test_a_real_disk_that_fills_up(tmp_path: Path) -> None:
    """2 MiB of memory as a file system of its own, in a mount namespace of its own."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        pytest.skip("mounting a small file system needs root and unshare")
    shell = (
        'mount -t tmpfs -o size=2m none "$1" || exit 77; "$2" -c "$3" "$1" || exit 1; '
        'df --output=avail "$1" >&2; cp -r "$1/run" "$4"'
    )
    target, mount = tmp_path / "copy", tmp_path / "mount"
    mount.mkdir()
    command = ["unshare", "--mount", "sh", "-c", shell, "sh", mount, sys.executable, FILL_A_REAL_DISK, target]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if done.stderr.startswith("unshare:") or done.returncode == 77:
        pytest.skip(f"this system does not let a test mount: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    steps, message = done.stdout.split(" ", 1)
    assert "No space left on device" in message
    assert [json.loads(line)["kind"] for line in (target / "events.jsonl").read_text().splitlines()]
    assert len(read_trace(target / "trace.csv")) == int(steps)
    assert read_trajectory(target / "trajectory.parquet").num_rows == int(steps)
