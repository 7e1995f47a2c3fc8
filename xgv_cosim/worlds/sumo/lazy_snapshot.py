"""A snapshot whose columns are read from SUMO when somebody asks for them, before SUMO goes on.

Of bound vehicles their own plant knows pose and motion, and mostly the lane too; of the others nobody may
want to know anything. So what costs a call for each vehicle waits until a column is asked for. What has not
been asked for by the next step is gone.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from xgv_cosim.errors import WorldError
from xgv_cosim.snapshot import Collision, Snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
    from xgv_cosim.worlds.sumo.neighbours import Nearest


_MOST_ASKED = 8


@dataclass(frozen=True, slots=True)
class Cast:
    """Who is there; the same object from step to step as long as nobody comes or goes."""

    ids: tuple[str, ...]
    index_of: Mapping[str, int]
    type_ids: tuple[str, ...]
    length_m: FloatColumn
    width_m: FloatColumn
    _rows: dict[tuple[str, ...], IntColumn] = field(default_factory=dict)
    """Rows that have been asked for: mostly those of the bound vehicles, in every step."""

    def rows_of(self, ids: tuple[str, ...]) -> IntColumn:
        """Return the row of each of some vehicles, -1 where it is not there; not to be written to."""
        rows = self._rows.get(ids)
        if rows is None:
            rows = np.array([self.index_of.get(name, -1) for name in ids], np.int64)
            rows.flags.writeable = False
            if len(self._rows) >= _MOST_ASKED:
                self._rows.clear()
            self._rows[ids] = rows
        return rows


class Happened(NamedTuple):
    """What SUMO did in the step."""

    time_s: float
    departed: tuple[str, ...] = ()
    arrived: tuple[str, ...] = ()
    teleported: tuple[str, ...] = ()
    teleported_from: tuple[str, ...] = ()
    collisions: tuple[Collision, ...] = ()
    notes: tuple[tuple[str, str], ...] = ()


class Columns:
    """What is known so far, a value for each vehicle; ``has_*`` says of whom."""

    def __init__(self, num_vehicles: int) -> None:
        self.x_m, self.y_m, self.heading_rad, self.speed_mps, self.accel_mps2, self.position_m = np.empty(
            (6, num_vehicles)
        )
        self.lane = np.empty(num_vehicles, np.int64)
        self.next_lane = np.full(num_vehicles, -1, np.int64)
        self.has_pose, self.has_motion, self.has_place = np.zeros((3, num_vehicles), np.bool_)


class Source(Protocol):
    """Whoever reads from SUMO what is not known yet; only as long as SUMO has not gone on."""

    def read_poses(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in places and headings."""
        ...

    def read_motions(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in speeds and accelerations."""
        ...

    def read_places(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in lanes and positions along them."""
        ...

    def leaders(self, cast: Cast, lane: IntColumn, position_m: FloatColumn) -> Nearest:
        """Return who is before the bound vehicles."""
        ...

    def followers(self, cast: Cast, lane: IntColumn, position_m: FloatColumn) -> Nearest:
        """Return who is behind them."""
        ...

    def placement_errors(self, cast: Cast) -> tuple[FloatColumn, FloatColumn]:
        """Return distance and turn of SUMO's poses from the plant's."""
        ...


class LazySnapshot(Snapshot):
    """See the module. Everything else is as in ``Snapshot``.

    Args:
        cast: Who is there.
        happened: What SUMO did.
        columns: What is known from the start; goes on being filled.
        in_lane_frame: Who was written as speed and lateral position.
        source: Reads the rest.
    """

    def __init__(
        self, cast: Cast, happened: Happened, columns: Columns, in_lane_frame: BoolColumn, source: Source
    ) -> None:
        known: dict[str, Any] = dict(
            happened._asdict(),
            ids=cast.ids,
            index_of=cast.index_of,
            type_ids=cast.type_ids,
            length_m=cast.length_m,
            width_m=cast.width_m,
            next_lane=columns.next_lane,
            in_lane_frame=in_lane_frame,
            cast=cast,
            _columns=columns,
            _source=source,
        )
        self.__dict__.update(known)  # the class it derives from is frozen

    cast: Cast
    _columns: Columns
    _source: Source | None

    def close(self) -> None:
        """SUMO goes on: what has not been read is gone."""
        self.__dict__["_source"] = None

    def read_all(self) -> None:
        """Read whatever has not been read yet, so that the snapshot can be kept."""
        for each in fields(Snapshot):
            getattr(self, each.name)

    def keep(self, row: int) -> None:
        """Read what SUMO knows of one vehicle now, before something is done to it between two steps."""
        if self._source is None:
            return  # the step after this snapshot has failed
        for name in ("front_x_m", "speed_mps", "lane"):
            self.of(name, np.array([row]))

    def lose(self, vehicle_id: str) -> None:
        """Let nobody find a vehicle by its id any more: SUMO has lost it."""
        if vehicle_id not in self.index_of:
            return
        if self.index_of is self.cast.index_of:
            self.__dict__["index_of"] = dict(self.index_of)
        del self.__dict__["index_of"][vehicle_id]

    def with_collisions(self, collisions: tuple[Collision, ...]) -> None:
        """Take note of contacts that were found after reading."""
        self.__dict__["collisions"] = collisions

    def rows_of(self, vehicle_ids: Iterable[str]) -> IntColumn:
        """Return the index of each of some vehicles, -1 where it is not there; not to be written to."""
        if isinstance(vehicle_ids, tuple) and self.index_of is self.cast.index_of:
            return self.cast.rows_of(vehicle_ids)
        return super().rows_of(vehicle_ids)

    def of(self, name: str, rows: IntColumn) -> Any:  # noqa: ANN401 - a column of the name's own type
        """Return the values of some rows of a column; nobody else's is read."""
        columns = self._columns
        if name in {"front_x_m", "front_y_m", "heading_rad"}:
            self._fill(columns.has_pose, "read_poses", rows)
            return getattr(columns, name.removeprefix("front_"))[rows]
        if name in {"speed_mps", "accel_mps2"}:
            self._fill(columns.has_motion, "read_motions", rows)
            return getattr(columns, name)[rows]
        if name in {"lane", "lane_position_m"}:
            self._fill(columns.has_place, "read_places", rows)
            return (columns.lane if name == "lane" else columns.position_m)[rows]
        return getattr(self, name)[rows]

    def _fill(self, has: BoolColumn, how: str, rows: IntColumn) -> None:
        if has[rows].all():
            return
        missing = np.zeros(len(has), np.bool_)
        missing[rows] = True
        missing &= ~has
        getattr(self._reading(how), how)(self.cast, self._columns, np.flatnonzero(missing).tolist())
        has[missing] = True

    def _reading(self, what: str) -> Source:
        source = self._source
        if source is None:
            words = what.removeprefix("read_")
            raise WorldError(
                f"the {words} of the snapshot at {self.time_s:g} s were not read before SUMO went on; "
                "read the column before the next step, or call snapshot.read_all() to keep all of it"
            )
        return source

    def _floats(self, name: str) -> FloatColumn:
        column: FloatColumn = self.of(name, np.arange(len(self.ids)))
        return column

    @cached_property
    def front_x_m(self) -> FloatColumn:  # noqa: D102 - as in Snapshot; so all below
        return self._floats("front_x_m")

    @cached_property
    def front_y_m(self) -> FloatColumn:  # noqa: D102
        return self._floats("front_y_m")

    @cached_property
    def heading_rad(self) -> FloatColumn:  # noqa: D102
        return self._floats("heading_rad")

    @cached_property
    def speed_mps(self) -> FloatColumn:  # noqa: D102
        return self._floats("speed_mps")

    @cached_property
    def accel_mps2(self) -> FloatColumn:  # noqa: D102
        return self._floats("accel_mps2")

    @cached_property
    def lane(self) -> IntColumn:  # noqa: D102
        lane: IntColumn = self.of("lane", np.arange(len(self.ids)))
        return lane

    @cached_property
    def lane_position_m(self) -> FloatColumn:  # noqa: D102
        return self._floats("lane_position_m")

    @cached_property
    def _leaders(self) -> Nearest:
        return self._reading("leaders").leaders(self.cast, self.lane, self.lane_position_m)

    @cached_property
    def _followers(self) -> Nearest:
        return self._reading("followers").followers(self.cast, self.lane, self.lane_position_m)

    @property
    def leader(self) -> IntColumn:  # noqa: D102
        return self._leaders.row

    @property
    def leader_gap_m(self) -> FloatColumn:  # noqa: D102
        return self._leaders.gap_m

    @property
    def follower(self) -> IntColumn:  # noqa: D102
        return self._followers.row

    @property
    def follower_gap_m(self) -> FloatColumn:  # noqa: D102
        return self._followers.gap_m

    @cached_property
    def _errors(self) -> tuple[FloatColumn, FloatColumn]:
        return self._reading("placement errors").placement_errors(self.cast)

    @property
    def placement_error_m(self) -> FloatColumn:  # noqa: D102
        return self._errors[0]

    @property
    def placement_error_rad(self) -> FloatColumn:  # noqa: D102
        return self._errors[1]
