"""Trace hash (requirements, cross-profile rules): stable, sensitive to each quantity, blind to order."""

from __future__ import annotations

import hashlib
import struct
from pathlib import Path

import numpy as np
import pytest

from xgv_cosim.errors import ReplayError
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import TraceHash, first_difference


def fleet_of(*names: str) -> Fleet:
    fleet = Fleet()
    for name in names:
        slot = fleet.occupy(name)
        number = float(name[-1])
        fleet.motion.x_m[slot] = 10.0 * number
        fleet.motion.y_m[slot] = -number
        fleet.motion.heading_rad[slot] = 0.1 * number
        fleet.motion.speed_mps[slot] = 20.0 + number
        fleet.safety_mode[slot] = 1
    return fleet


def digest(*steps: tuple[int, Fleet]) -> str:
    trace = TraceHash()
    for tick, fleet in steps:
        trace.update(tick, fleet)
    return trace.hexdigest


def test_hash_is_what_the_rule_says() -> None:
    """Against a digest made by hand: id with its length, then six little-endian float64."""
    by_hand = b""
    for name, number in ((b"a\xc3\xa91", 1.0), (b"b2", 2.0)):
        values = (10.0, 10.0 * number, -number, 0.1 * number, 20.0 + number, 1.0)
        by_hand += struct.pack("<I", len(name)) + name + struct.pack("<6d", *values)
    assert digest((10, fleet_of("b2", "aé1"))) == hashlib.sha256(by_hand).hexdigest()


def test_same_motion_gives_the_same_hash_whatever_the_slots() -> None:
    one, other = fleet_of("a1", "b2", "c3"), fleet_of("c3", "x9", "a1", "b2")
    other.vacate("x9")
    assert digest((10, one), (20, one)) == digest((10, other), (20, other))


@pytest.mark.parametrize("column", ["x_m", "y_m", "heading_rad", "speed_mps"])
def test_the_last_bit_of_a_quantity_changes_the_hash(column: str) -> None:
    before = digest((10, fleet_of("a1", "b2")))
    fleet = fleet_of("a1", "b2")
    values = getattr(fleet.motion, column)
    values[1] = np.nextafter(values[1], np.inf)
    assert digest((10, fleet)) != before


def test_mode_tick_and_name_change_the_hash() -> None:
    fleet = fleet_of("a1")
    before = digest((10, fleet))
    assert digest((11, fleet)) != before
    assert digest((10, fleet_of("b1"))) != before
    fleet.safety_mode[0] = 8
    assert digest((10, fleet)) != before


def test_minus_zero_counts_as_zero() -> None:
    one, other = fleet_of("a0"), fleet_of("a0")
    one.motion.y_m[0], other.motion.y_m[0] = 0.0, -0.0
    assert digest((10, one)) == digest((10, other))


def test_unbound_slots_do_not_enter_the_hash() -> None:
    one, other = fleet_of("a1"), fleet_of("a1")
    other.motion.x_m[5] = 77.0
    assert digest((10, one)) == digest((10, other))


def write_trace(path: Path, *digests: str) -> Path:
    rows = [f"{n},{10 * n},{n / 10},{text}" for n, text in enumerate(digests)]
    path.write_text("\n".join(["step,tick,t_s,digest", *rows]) + "\n")
    return path


def test_first_difference_names_the_step(tmp_path: Path) -> None:
    one = write_trace(tmp_path / "a.csv", "aa", "bb", "cc")
    assert first_difference(one, write_trace(tmp_path / "b.csv", "aa", "bb", "cc")) is None
    difference = first_difference(one, write_trace(tmp_path / "c.csv", "aa", "xx", "yy"))
    assert difference is not None
    assert (difference.step, difference.tick, difference.t_s) == (1, 10, 0.1)
    assert (difference.first_digest, difference.second_digest) == ("bb", "xx")


def test_a_shorter_trace_differs_where_it_ends(tmp_path: Path) -> None:
    one = write_trace(tmp_path / "a.csv", "aa", "bb")
    difference = first_difference(one, write_trace(tmp_path / "b.csv", "aa"))
    assert difference is not None
    assert (difference.step, difference.second_digest) == (1, "")


@pytest.mark.parametrize(
    "text", ["", "something else\n", "step,tick,t_s,digest\n1,2\n", "step,tick,t_s,digest\na,b,c,d\n"]
)
def test_a_file_that_is_no_trace_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "trace.csv"
    path.write_text(text)
    with pytest.raises(ReplayError, match=r"trace\.csv.*not a"):
        first_difference(path, path)
    with pytest.raises(ReplayError, match="missing"):
        first_difference(tmp_path / "missing.csv", path)
