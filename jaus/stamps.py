"""Time and date as one number on the wire, UTC."""

from __future__ import annotations

from typing import NamedTuple, Self

from jaus.errors import LocalProtocolError


class TimeStamp(NamedTuple):
    """A point in time within a month; fields named ``time_stamp`` hold its packed form."""

    day: int
    hour: int
    minute: int
    second: int
    millisecond: int

    @property
    def packed(self) -> int:
        """Return the 32 bits on the wire.

        Raises:
            LocalProtocolError: There is no such time.
        """
        is_time = 0 <= self.hour < 24 and 0 <= self.minute < 60 and 0 <= self.second < 60
        if not (is_time and 1 <= self.day <= 31 and 0 <= self.millisecond < 1000):
            raise LocalProtocolError(
                f"time stamp: got {self}, expected day 1 to 31 and a time from 00:00:00.000 to 23:59:59.999"
            )
        clock = (self.hour << 6 | self.minute) << 6 | self.second
        return (self.day << 17 | clock) << 10 | self.millisecond

    @classmethod
    def from_packed(cls, packed: int) -> Self:
        """Return what 32 bits of the wire say."""
        return cls(packed >> 27, packed >> 22 & 31, packed >> 16 & 63, packed >> 10 & 63, packed & 1023)

    def __str__(self) -> str:
        return f"day {self.day}, {self.hour:02}:{self.minute:02}:{self.second:02}.{self.millisecond:03}"


class DateStamp(NamedTuple):
    """A day; fields named ``date_stamp`` hold its packed form."""

    year: int
    """2000 to 2127."""
    month: int
    """1 to 12."""
    day: int

    @property
    def packed(self) -> int:
        """Return the 16 bits on the wire.

        Raises:
            LocalProtocolError: There is no such date.
        """
        if not (2000 <= self.year < 2128 and 1 <= self.month <= 12 and 1 <= self.day <= 31):
            raise LocalProtocolError(f"date stamp: got {self}, expected 2000-01-01 to 2127-12-31")
        return (self.year - 2000 << 4 | self.month) << 5 | self.day

    @classmethod
    def from_packed(cls, packed: int) -> Self:
        """Return what 16 bits of the wire say."""
        return cls(2000 + (packed >> 9), packed >> 5 & 15, packed & 31)

    def __str__(self) -> str:
        return f"{self.year}-{self.month:02}-{self.day:02}"
