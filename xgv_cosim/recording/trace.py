"""The trace: a rolling hash of what every vehicle did, and where two runs part.

Trace hash (requirements, cross-profile rules): SHA-256 over (tick, vehicle, x, y, heading, speed, mode)
of every bound vehicle, ordered, as float64; no link, wall-clock or sequence data. Added to it here: pose and
speed of every vehicle of the world, so that a run with nobody bound has a trace too.
"""

from __future__ import annotations

import csv
import hashlib
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from xgv_cosim.clock import time_of_tick_s
from xgv_cosim.errors import ReplayError
from xgv_cosim.fleet import Fleet
from xgv_cosim.snapshot import Snapshot

TRACE_HEADER = "step,tick,t_s,digest"
DIGITS_PER_STEP = 16
"""Hexadecimal digits of the digest that each line of ``trace.csv`` keeps."""


class TraceHash:
    """Rolling SHA-256 of the bound vehicles' motion and safety mode, and of the motion of all vehicles.

    In each step every bound vehicle adds, in the order of the ids, the length of its id (unsigned 32 bit),
    its id (UTF-8) and the float64 values tick, x, y, heading, speed (rear axle, east-north-up, metres,
    radians, m/s) and safety mode code. Then the world adds the tick (float64), the number of its vehicles
    (unsigned 32 bit), length and id of each, in the order of the ids, and in that order the float64 columns
    x, y, heading and speed of all (front bumper). All is little endian; minus zero counts as zero.
    """

    def __init__(self) -> None:
        self._sha = hashlib.sha256()
        self._ids: list[str | None] = []
        self._slots = np.zeros(0, np.int64)
        self._names: list[bytes] = []
        self._world_ids: tuple[str, ...] = ()
        self._world_order = np.zeros(0, np.int64)
        self._world_names = b""

    def update(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        """Add the state of every bound vehicle, and of the world, at the end of control tick ``tick``."""
        self._add_bound(tick, fleet)
        self._add_world(tick, snapshot)

    def _add_bound(self, tick: int, fleet: Fleet) -> None:
        self._order(fleet)
        if not self._names:
            return
        motion, slots = fleet.motion, self._slots
        rows = np.empty((len(slots), 6), "<f8")
        rows[:, 0] = tick
        rows[:, 1] = motion.x_m[slots]
        rows[:, 2] = motion.y_m[slots]
        rows[:, 3] = motion.heading_rad[slots]
        rows[:, 4] = motion.speed_mps[slots]
        rows[:, 5] = fleet.safety_mode[slots]
        rows += 0.0  # -0.0 becomes 0.0
        data = rows.tobytes()
        width = rows.itemsize * rows.shape[1]
        parts: list[bytes] = []
        for index, name in enumerate(self._names):
            parts += (name, data[index * width : (index + 1) * width])
        self._sha.update(b"".join(parts))

    def _add_world(self, tick: int, snapshot: Snapshot) -> None:
        if snapshot.ids != self._world_ids:
            self._world_ids = snapshot.ids
            ordered = sorted((name, row) for row, name in enumerate(snapshot.ids))
            self._world_order = np.array([row for _, row in ordered], np.int64)
            self._world_names = b"".join(_length_and_name(name) for name, _ in ordered)
        quantities = (snapshot.front_x_m, snapshot.front_y_m, snapshot.heading_rad, snapshot.speed_mps)
        columns = np.empty((len(quantities), len(self._world_order)), "<f8")
        for row, quantity in enumerate(quantities):
            columns[row] = quantity[self._world_order]
        columns += 0.0  # -0.0 becomes 0.0
        head = np.array([tick], "<f8").tobytes() + len(self._world_order).to_bytes(4, "little")
        self._sha.update(head + self._world_names + columns.tobytes())

    def _order(self, fleet: Fleet) -> None:
        if fleet.ids == self._ids:
            return
        self._ids = list(fleet.ids)
        ordered = sorted((name, slot) for slot, name in fleet)
        self._slots = np.array([slot for _, slot in ordered], np.int64)
        self._names = [_length_and_name(name) for name, _ in ordered]

    @property
    def hexdigest(self) -> str:
        """Return the digest of all that was added so far, 64 hexadecimal digits."""
        return self._sha.copy().hexdigest()


def _length_and_name(name: str) -> bytes:
    data = name.encode("utf-8", "surrogatepass")
    return len(data).to_bytes(4, "little") + data


def trace_line(step: int, tick: int, hexdigest: str) -> str:
    """Return one line of ``trace.csv`` without its line feed."""
    return f"{step},{tick},{time_of_tick_s(tick)!r},{hexdigest[:DIGITS_PER_STEP]}"


@dataclass(frozen=True, slots=True)
class TraceDifference:
    """The first world step in which two runs differ."""

    step: int
    tick: int
    t_s: float
    first_digest: str
    """Digest in the first trace, empty where that trace has ended before."""
    second_digest: str
    """Digest in the second trace, empty where that trace has ended before."""


def read_trace(path: Path) -> list[tuple[int, int, float, str]]:
    """Return the rows (step, tick, t_s, digest) of a ``trace.csv``.

    Raises:
        ReplayError: The file is missing, unreadable, or not a trace.
    """
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            table = list(csv.reader(lines))
    except (OSError, UnicodeDecodeError) as error:
        raise ReplayError(f"{path}: cannot read the trace: {error}") from error
    if not table or ",".join(table[0]) != TRACE_HEADER:
        raise ReplayError(f"{path}: not a trace; its first line has to be {TRACE_HEADER!r}")
    rows = []
    for number, cells in enumerate(table[1:], start=2):
        try:
            step, tick, t_s, digest = cells
            rows.append((int(step), int(tick), float(t_s), digest))
        except ValueError as error:
            raise ReplayError(f"{path}:{number}: not a row of a trace: {','.join(cells)!r}") from error
    return rows


def first_difference(first: Path, second: Path) -> TraceDifference | None:
    """Return the first step in which two ``trace.csv`` differ, None where they are equal to the end.

    Raises:
        ReplayError: One of them cannot be read.
    """
    for one, other in zip_longest(read_trace(first), read_trace(second)):
        if one == other:
            continue
        step, tick, t_s, _ = one or other
        return TraceDifference(step, tick, t_s, one[3] if one else "", other[3] if other else "")
    return None
