"""Scaled integers, addresses, stamps: the numbers of jaus-wire's third section."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaus.address import JausAddress
from jaus.errors import LocalProtocolError
from jaus.fields import Integer, Scaled
from jaus.header import DataFlag, MessageProperties
from jaus.messages import core, discovery, torc
from jaus.messages.base import Message, message
from jaus.stamps import DateStamp, TimeStamp


@pytest.mark.parametrize(
    ("kind", "scale", "bias", "raw_bounds"),
    [
        (Scaled("B", 0.0, 100.0, "%"), 100 / 255, 0.0, (0, 255)),
        (Scaled("H", -65.535, 65.535, "m/s"), 131.07 / 65535, -65.535, (0, 65535)),
        (Scaled("h", -100.0, 100.0, "%"), 200 / 65534, 0.0, (-32767, 32767)),
        (Scaled("i", -10_000.0, 35_000.0, "m"), 45_000 / 4294967294, 12_500.0, (-2147483647, 2147483647)),
        (Scaled("I", 0.0, 100.0, "m"), 100 / 4294967295, 0.0, (0, 4294967295)),
    ],
    ids=str,
)
def test_scale_and_bias(kind: Scaled, scale: float, bias: float, raw_bounds: tuple[int, int]) -> None:
    assert (kind.scale, kind.bias) == (pytest.approx(scale), bias)
    assert kind.raw_bounds == raw_bounds


def test_kinds_say_in_words_what_they_are() -> None:
    assert str(Scaled("H", -math.pi / 2, math.pi / 2, "rad")) == "u16 [-π/2, π/2] rad"
    assert str(Scaled("i", -100_000.0, 100_000.0, "m")) == "s32 [-100000, 100000] m"
    assert str(Integer("H", unit="ms")) == "u16 ms"
    assert str(Integer("B", core.ComponentStatus)) == "u8 ComponentStatus"
    assert str(Integer("H", torc.SafetyDeviceBit, bits=True)) == "u16 bits of SafetyDeviceBit"


def test_integers_name_their_values() -> None:
    assert Integer("B", torc.SafetyMode).words(8) == "estop_pause"
    assert Integer("B", torc.SafetyMode).words(5) is None
    assert Integer("B").words(5) is None
    devices = Integer("H", torc.SafetyDeviceBit, bits=True)
    assert devices.words(0x12) == "safestop_pause | link_good"
    assert devices.words(0) is None


@given(st.integers(0, 2**32 - 1))
def test_an_address_has_a_32_bit_form(jaus_id: int) -> None:
    """XGV-07, XGV-55: subsystem in the highest byte, so instance first on the little-endian wire."""
    address = JausAddress.from_jaus_id(jaus_id)
    assert address.jaus_id == jaus_id
    assert address == JausAddress(*jaus_id.to_bytes(4, "big"))


def test_an_address_knows_broadcasts() -> None:
    assert JausAddress(255, 255, 1, 1).is_broadcast
    assert not JausAddress(254, 1, 1, 1).is_broadcast


times = st.builds(
    TimeStamp,
    st.integers(1, 31),
    st.integers(0, 23),
    st.integers(0, 59),
    st.integers(0, 59),
    st.integers(0, 999),
)
dates = st.builds(DateStamp, st.integers(2000, 2127), st.integers(1, 12), st.integers(1, 31))


@given(times, dates)
def test_stamps_go_there_and_back(time: TimeStamp, date: DateStamp) -> None:
    assert TimeStamp.from_packed(time.packed) == time
    assert DateStamp.from_packed(date.packed) == date


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**16 - 1))
def test_any_bits_of_the_wire_are_a_stamp_to_look_at(time: int, date: int) -> None:
    assert str(TimeStamp.from_packed(time)).startswith("day ")
    assert DateStamp.from_packed(date).year >= 2000


@pytest.mark.parametrize(
    "stamp",
    [
        *(TimeStamp(0, 0, 0, 0, 0), TimeStamp(32, 0, 0, 0, 0), TimeStamp(1, 24, 0, 0, 0)),
        *(TimeStamp(1, 0, 60, 0, 0), TimeStamp(1, 0, 0, 60, 0), TimeStamp(1, 0, 0, 0, 1000)),
        *(
            TimeStamp(1, 0, 0, 0, -1),
            TimeStamp(1, 0, 0, -1, 0),
            TimeStamp(1, 0, -1, 0, 0),
            TimeStamp(1, -1, 0, 0, 0),
        ),
        *(DateStamp(1999, 1, 1), DateStamp(2128, 1, 1), DateStamp(2026, 0, 1), DateStamp(2026, 13, 1)),
        *(DateStamp(2026, 1, 0), DateStamp(2026, 1, 32)),
    ],
)
def test_a_stamp_that_is_none_does_not_spill_into_its_neighbours(stamp: TimeStamp | DateStamp) -> None:
    with pytest.raises(LocalProtocolError, match=r"(time|date) stamp: got .*, expected"):
        _ = stamp.packed


def test_stamps_lie_as_the_standard_says() -> None:
    assert TimeStamp(day=31, hour=23, minute=2, second=1, millisecond=999).packed == 0xFDC207E7
    assert DateStamp(year=2026, month=12, day=31).packed == 0x359F


@pytest.mark.parametrize(("name", "value"), [("priority", 16), ("priority", -1), ("version", 64)])
def test_header_properties_fit_into_their_bits(name: str, value: int) -> None:
    with pytest.raises(LocalProtocolError, match=f"header {name}: got {value}"):
        MessageProperties(**{name: value})


def test_data_flags_are_those_of_the_wire() -> None:
    assert [flag.value for flag in DataFlag] == [0, 1, 2, 4, 8]


def test_the_controller_of_nobody_is_none() -> None:
    assert core.ReportComponentControl().controller is None
    assert core.ReportComponentControl(2, 2, 4, 1, 6).controller == JausAddress(2, 2, 4, 1)


def test_the_presence_vector_follows_from_the_fields() -> None:
    assert torc.SetSignals(horn=torc.Horn(1)).presence_vector == 2
    assert core.ReportTime(time_stamp=0, date_stamp=0).presence_vector == 3
    assert discovery.QueryServices().presence_vector == 0


def test_a_code_is_declared_once() -> None:
    with pytest.raises(TypeError, match="code 0x4202 belongs to ReportHeartbeatPulse"):

        @message(0x4202)
        class Another(Message):
            """Takes a code that has an owner."""
