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
from xgv_cosim.snapshot import Snapshot


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


def world_of(*names: str, **columns: object) -> Snapshot:
    """The columns that the hash reads; the others are empty."""
    number = np.array([float(name[-1]) for name in names])
    values: dict[str, object] = {
        name: np.zeros(0) for name in Snapshot.__dataclass_fields__ if name not in {"time_s", "ids", "notes"}
    }
    values |= {"time_s": 0.0, "ids": names, "front_x_m": 30.0 * number, "front_y_m": 0.5 * number}
    values |= {"heading_rad": -0.1 * number, "speed_mps": 10.0 + number}
    return Snapshot(**{**values, **columns})  # type: ignore[arg-type]


def digest(*steps: tuple[int, Fleet], world: Snapshot | None = None) -> str:
    trace = TraceHash()
    for tick, fleet in steps:
        trace.update(tick, fleet, world if world is not None else world_of())
    return trace.hexdigest


def test_hash_is_what_the_rule_says() -> None:
    """Against a digest made by hand: id with its length, then six little-endian float64; then the world's."""
    by_hand = b""
    for name, number in ((b"a\xc3\xa91", 1.0), (b"b2", 2.0)):
        values = (10.0, 10.0 * number, -number, 0.1 * number, 20.0 + number, 1.0)
        by_hand += struct.pack("<I", len(name)) + name + struct.pack("<6d", *values)
    by_hand += struct.pack("<dI", 10.0, 2) + struct.pack("<I", 2) + b"c3" + struct.pack("<I", 2) + b"d4"
    by_hand += struct.pack("<8d", 90.0, 120.0, 1.5, 2.0, -0.1 * 3.0, -0.4, 13.0, 14.0)
    made = digest((10, fleet_of("b2", "aé1")), world=world_of("d4", "c3"))
    assert made == hashlib.sha256(by_hand).hexdigest()


@pytest.mark.parametrize("column", ["front_x_m", "front_y_m", "heading_rad", "speed_mps"])
def test_the_last_bit_of_anybody_changes_the_hash_also_with_nobody_bound(column: str) -> None:
    before = world_of("a1", "b2")
    values = getattr(before, column).copy()
    values[1] = np.nextafter(values[1], np.inf)
    for fleet in (Fleet(), fleet_of("a1")):
        made = digest((10, fleet), world=before)
        assert digest((10, fleet), world=world_of("a1", "b2", **{column: values})) != made
        assert digest((10, fleet), world=world_of("a1", "b2")) == made
        assert digest((11, fleet), world=before) != made


def test_who_is_in_the_world_counts_and_in_which_order_it_tells_of_them_does_not() -> None:
    empty, made = Fleet(), digest((10, Fleet()), world=world_of("a1", "b2"))
    assert digest((10, empty), world=world_of("b2", "a1")) == made
    assert digest((10, empty), world=world_of("a1", "c2")) != made
    assert digest((10, empty), world=world_of("a1")) != made
    assert digest((10, empty)) != hashlib.sha256().hexdigest()


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
    other.motion.x_m[other.num_slots - 1] = 77.0
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
