"""Contacts that an engine does not report: bodies as oriented boxes, overlap by separating axes.

An engine that knows vehicles by their lanes sees no contact across lanes, with a body that stands askew, or
off the road. Here every bound vehicle's box is held against all that are near, as columns.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from xgv_cosim.columns import FloatColumn, IntColumn
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Collision, Snapshot
from xgv_cosim.worlds.boxes import boxes_of, near_pairs, overlap, touching
from xgv_cosim.worlds.levels import Levels

OVERLAP = "overlap"
"""Kind of a contact that was found here."""

_FAR_M = 150.0
"""So near a vehicle has to be to a subject for its distance to count; beyond it is this far."""
_CLOSING_MPS = 120.0
"""How fast two vehicles come together at most: both at 60 m/s."""
_WIDE_M = 10.0
"""What bodies reach beyond the circles of their lengths, at most."""
MOST_ASKEW_RAD = 0.2
"""How far the engine's own driver turns a car from its lane's direction, at most; 11°."""


@dataclass(slots=True)
class Watch:
    """Knows when each vehicle of the traffic has to be looked at again.

    Whoever is far from all subjects cannot touch one before both have driven there. A vehicle that
    something puts elsewhere is missed for ``_FAR_M / _CLOSING_MPS`` at most.
    """

    _ids: tuple[str, ...] = ()
    _subjects: frozenset[str] = frozenset()
    _rows: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    _due_s: FloatColumn = field(default_factory=lambda: np.zeros(0))

    def due(self, snapshot: Snapshot, subjects: IntColumn) -> IntColumn:
        """Return the rows of others that may touch a subject now, and note when those are due again."""
        if len(subjects) == len(snapshot.ids):
            return np.zeros(0, np.int64)
        self._follow(snapshot, subjects)
        is_other = np.ones(len(snapshot.ids), np.bool_)
        is_other[subjects] = False
        rows = np.flatnonzero(is_other & (self._due_s <= snapshot.time_s))
        if not len(rows):
            return rows
        all_rows = np.concatenate([subjects, rows])
        x_m, y_m = snapshot.of("front_x_m", all_rows), snapshot.of("front_y_m", all_rows)
        places, half_far_m = np.arange(len(subjects)), np.full(len(all_rows), 0.5 * _FAR_M)
        one, other = near_pairs(x_m, y_m, half_far_m, places)
        one, other = np.where(other < len(subjects), other, one), np.where(other < len(subjects), one, other)
        apart_m = np.full(len(all_rows), _FAR_M)
        np.minimum.at(apart_m, other, np.hypot(x_m[one] - x_m[other], y_m[one] - y_m[other]))
        lengths_m = snapshot.of("length_m", all_rows)
        free_m = (
            apart_m[len(subjects) :] - lengths_m[len(subjects) :] - lengths_m[: len(subjects)].max() - _WIDE_M
        )
        self._due_s[rows] = snapshot.time_s + np.maximum(free_m, 0.0) / _CLOSING_MPS
        return rows

    def _follow(self, snapshot: Snapshot, subjects: IntColumn) -> None:
        """Look at everybody anew who is new, or at all when a subject is."""
        if snapshot.ids is self._ids and np.array_equal(subjects, self._rows):
            return
        self._rows = subjects
        bound = frozenset([snapshot.ids[row] for row in subjects.tolist()])
        if not bound <= self._subjects:
            self._ids, self._due_s = (), np.zeros(0)
        if snapshot.ids is not self._ids and snapshot.ids != self._ids:
            known = dict(zip(self._ids, self._due_s.tolist(), strict=True))
            self._due_s = np.array([known.get(name, 0.0) for name in snapshot.ids])
        self._ids, self._subjects = snapshot.ids, bound


@dataclass(slots=True)
class Contacts:
    """Merges what the engine reports with what is found here; each pair once, with the same roles."""

    lane_ids: tuple[str, ...]
    """Names of the lanes, by their numbers."""
    places: tuple[frozenset[str], ...] = ()
    """The junctions that each lane belongs to or leads between; empty: not known. Of bodies on lanes
    without a junction in common ``levels`` tells whether one road leads over the other."""
    road: Road | None = None
    """The lanes, by whose direction the headings of the world's own drivers are judged; None: as they are."""
    levels: Levels | None = None
    """None: lanes without a junction in common are on different levels."""
    _watch: Watch = field(default_factory=Watch)
    _roles: dict[frozenset[str], tuple[str, str]] = field(default_factory=dict)
    """(collider, victim) of every pair that has ever touched."""

    def merged(
        self, snapshot: Snapshot, bound_ids: Collection[str], subjects: IntColumn | None = None
    ) -> tuple[Collision, ...]:
        """Return the contacts of this step: the engine's, then those of bound vehicles that it lacks.

        Args:
            snapshot: The world after the step.
            bound_ids: Who is bound.
            subjects: Rows of these, where they are known.
        """
        found: dict[frozenset[str], Collision] = {}
        for contact in snapshot.collisions:
            pair = frozenset((contact.collider, contact.victim))
            collider, victim = self._roles.setdefault(pair, (contact.collider, contact.victim))
            found.setdefault(
                pair, Collision(collider, victim, contact.kind, contact.lane_id, contact.position_m)
            )
        rows = snapshot.rows_of(bound_ids) if subjects is None else subjects
        for one, other in self._touching(snapshot, np.sort(rows[rows >= 0])):
            if self._askew_only(snapshot, one, other, bound_ids) or self._one_above_the_other(
                snapshot, one, other
            ):
                continue
            pair = frozenset((snapshot.ids[one], snapshot.ids[other]))
            if pair not in found:
                found[pair] = self._contact(snapshot, one, other, pair)
        return tuple(found.values())

    def _one_above_the_other(self, snapshot: Snapshot, one: int, other: int) -> bool:
        """Return whether two bodies touch only on the map; off the road anything may be touched."""
        lanes = int(snapshot.value("lane", one)), int(snapshot.value("lane", other))
        if min(lanes) < 0 or not self.places or not self.places[lanes[0]].isdisjoint(self.places[lanes[1]]):
            return False
        if self.levels is None:
            return True
        centre_m, _, _ = boxes_of(snapshot, np.array([one, other], np.int64)).placed()
        x_m, y_m = map(float, centre_m.mean(axis=0))
        return self.levels.are_apart((snapshot.ids[one], snapshot.ids[other]), lanes, x_m, y_m)

    def _askew_only(self, snapshot: Snapshot, one: int, other: int, bound_ids: Collection[str]) -> bool:
        """Return whether two bodies touch only because the engine turns one of its own too far.

        SUMO moves a car that changes lanes sideways even where it stands, and turns it by the angle of that
        motion: by 37° and more. No car stands like that; its heading counts up to ``MOST_ASKEW_RAD`` from its
        lane's.
        """
        if self.road is None:
            return False
        rows = np.array([one, other], np.int64)
        lane, next_lane = snapshot.of("lane", rows), snapshot.of("next_lane", rows)
        along = self.road.points_ahead(lane, snapshot.of("lane_position_m", rows), next_lane)
        askew = (
            np.remainder(snapshot.of("heading_rad", rows) - along.heading_rad + np.pi, 2.0 * np.pi) - np.pi
        )
        own = np.array([snapshot.ids[row] not in bound_ids for row in rows.tolist()]) & (lane >= 0)
        turned = own & (np.abs(askew) > MOST_ASKEW_RAD)
        if not turned.any():
            return False
        straightened = along.heading_rad + np.clip(askew, -MOST_ASKEW_RAD, MOST_ASKEW_RAD)
        boxes = boxes_of(snapshot, rows)
        boxes = boxes._replace(heading_rad=np.where(turned, straightened, boxes.heading_rad))
        return not overlap(*boxes.placed(), np.array([0]), np.array([1]))[0]

    def _touching(self, snapshot: Snapshot, subjects: IntColumn) -> list[tuple[int, int]]:
        """Return the pairs of rows that overlap, the smaller row first; one at least is a subject."""
        if not len(subjects):
            return []
        looked_at = self._watch.due(snapshot, subjects)
        rows = np.sort(np.concatenate([subjects, looked_at]))
        pairs = touching(boxes_of(snapshot, rows), np.searchsorted(rows, subjects))
        return [(one, other) for one, other in rows[pairs].tolist()]

    def _contact(self, snapshot: Snapshot, one: int, other: int, pair: frozenset[str]) -> Collision:
        """Return the contact of two rows; the collider is who moves faster towards the other."""
        if pair not in self._roles:
            towards_x_m = snapshot.value("front_x_m", other) - snapshot.value("front_x_m", one)
            towards_y_m = snapshot.value("front_y_m", other) - snapshot.value("front_y_m", one)
            closing = [
                sign
                * snapshot.value("speed_mps", row)
                * (
                    towards_x_m * np.cos(snapshot.value("heading_rad", row))
                    + towards_y_m * np.sin(snapshot.value("heading_rad", row))
                )
                for row, sign in ((one, 1.0), (other, -1.0))
            ]
            first, second = (one, other) if closing[0] >= closing[1] else (other, one)
            self._roles[pair] = snapshot.ids[first], snapshot.ids[second]
        collider, victim = self._roles[pair]
        row = snapshot.index_of[collider]
        if snapshot.value("lane", row) < 0:
            row = snapshot.index_of[victim]
        lane = int(snapshot.value("lane", row))
        lane_id = self.lane_ids[lane] if lane >= 0 else ""
        return Collision(collider, victim, OVERLAP, lane_id, snapshot.value("lane_position_m", row))
