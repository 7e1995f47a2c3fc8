"""The recorder of a run: events and trace line by line, trajectories and road at the end."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording.buffer import TrajectoryBuffer
from xgv_cosim.recording.disk import MIB, LineLog, Reserve, fail, write_whole_file
from xgv_cosim.recording.folder import EVENTS, RESERVE, ROAD, TRACE, TRAJECTORY, prepare_run_folder
from xgv_cosim.recording.quantities import BOUND_VEHICLES
from xgv_cosim.recording.trace import TRACE_HEADER, TraceHash, trace_line
from xgv_cosim.recording.trajectory import trajectory_file
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Snapshot

ROAD_SCHEMA = "xgv-cosim/road/1"
RESERVE_BYTES = 8 * MIB
"""Room set aside on the disk for what is written at the end."""
BYTES_PER_ROW = 16
"""Generous size of one vehicle and step in ``trajectory.parquet``; the reserve grows with the rows."""

_SAFETY_MODE = 1 + [quantity.name for quantity in BOUND_VEHICLES].index("safety_mode")


class Recorder:
    """Writes one run into one folder.

    ``events.jsonl`` and ``trace.csv`` can be read at any moment of the run; ``trajectory.parquet`` and
    ``road.json`` are written by ``close``, which is to be called however the run ended.

    Args:
        folder: A new or empty folder; it may hold a ``scenario.lock.yaml``.
        safety_mode_name: The profile's name for a safety mode code.
        reserve_bytes: Room to set aside for the files that are written at the end.

    Raises:
        RecordingError: The folder is not empty, or cannot be written, or the disk is full. Raised by the
            methods too: then all recorded before is readable, and ``close`` still writes the rest.
    """

    def __init__(
        self, folder: Path, *, safety_mode_name: Callable[[int], str], reserve_bytes: int = RESERVE_BYTES
    ) -> None:
        self.folder = prepare_run_folder(folder)
        self.num_steps = 0
        self._safety_mode_name = safety_mode_name
        self._hash = TraceHash()
        self._trajectory = TrajectoryBuffer()
        self._road: Road | None = None
        self._lanes: dict[int, dict[str, object]] = {}
        self._reserve_bytes = reserve_bytes
        self._reserve = Reserve(folder / RESERVE)
        self._closed = False
        path = folder / EVENTS
        try:
            self._events = LineLog(path)
            path = folder / TRACE
            self._trace = LineLog(path)
            self._trace.append(TRACE_HEADER)
            path = self._reserve.path
            self._reserve.hold(reserve_bytes)
        except OSError as error:
            self._reserve.give_up()
            fail(path, error, f"A run needs {-(-reserve_bytes // MIB)} MiB or more; nothing was recorded.")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def trace_hash(self) -> str:
        """Return the trace hash of all steps so far, 64 hexadecimal digits."""
        return self._hash.hexdigest

    def use_road(self, road: Road) -> None:
        """Name the world's road, once it is open; lanes that vehicles touch go into ``road.json``."""
        self._road = road

    def record_event(self, event: Event) -> None:
        """Append an event to ``events.jsonl``.

        Raises:
            RecordingError: The disk is full or the file cannot be written.
        """
        self._append(self._events, json.dumps(event.as_row(), ensure_ascii=False, allow_nan=False))

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Record the state at the end of a world step, ``tick`` control ticks after the start.

        Raises:
            RecordingError: The disk is full or the file cannot be written.
        """
        self._hash.update(tick, fleet, snapshot)
        self._trajectory.append(tick, fleet, snapshot)
        self._note_lanes(snapshot)
        line = trace_line(self.num_steps, tick, self._hash.hexdigest)
        self.num_steps += 1
        self._append(self._trace, line)
        try:
            wanted = self._reserve_bytes // 2 + self._trajectory.every.num_rows * BYTES_PER_ROW
            if wanted > self._reserve.size_bytes > 0:
                self._reserve.hold(2 * wanted)
        except OSError as error:
            self._reserve.give_up()
            fail(self._reserve.path, error, self._remains())

    def close(self) -> None:
        """Write ``trajectory.parquet`` and ``road.json``; does nothing the second time.

        Raises:
            RecordingError: A file could not be written; the others were, and no half file is left.
        """
        if self._closed:
            return
        self._closed = True
        self._events.close()
        self._trace.close()
        self._reserve.give_up()
        codes = self._trajectory.bound.columns[_SAFETY_MODE]
        names = {int(code): self._safety_mode_name(int(code)) for code in np.unique(codes)}
        lane_ids = self._road.lane_ids if self._road else ()
        self._write(ROAD, json.dumps({"schema": ROAD_SCHEMA, "lanes": list(self._lanes.values())}).encode())
        self._write(TRAJECTORY, trajectory_file(self._trajectory, lane_ids, names))

    def _write(self, name: str, data: bytes) -> None:
        path = self.folder / name
        try:
            write_whole_file(path, data)
        except OSError as error:
            fail(path, error, self._remains())

    def _append(self, log: LineLog, line: str) -> None:
        try:
            log.append(line)
        except OSError as error:
            if self._reserve.give_up():
                try:
                    log.append(line)  # the reserve has made room for it
                except OSError as second:
                    fail(log.path, second, self._remains())
            fail(log.path, error, self._remains())

    def _remains(self) -> str:
        return (
            f"Readable in {self.folder}: what was recorded until then, {self.num_steps} steps. "
            "Free some space and run again into a new folder."
        )

    def _note_lanes(self, snapshot: Snapshot) -> None:
        if self._road is None or not len(snapshot.lane):
            return
        for number in np.unique(snapshot.lane).tolist():
            if number < 0 or number in self._lanes:
                continue
            one = np.array([number], np.int64)
            self._lanes[number] = {
                "id": self._road.lane_ids[number],
                "length_m": float(self._road.lane_length_m(one)[0]),
                "width_m": float(self._road.lane_width_m(one)[0]),
                "shape_m": np.round(self._road.lane_shape_m(number), 3).tolist(),
            }
