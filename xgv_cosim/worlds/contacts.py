"""Contacts that an engine does not report: bodies as oriented boxes, overlap by separating axes.

An engine that knows vehicles by their lanes sees no contact across lanes, with a body that stands askew, or
off the road. Here every bound vehicle's box is held against all that are near, as columns.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Collision, Snapshot
from xgv_cosim.worlds.levels import Levels

OVERLAP = "overlap"
"""Kind of a contact that was found here."""
TOLERANCE_M = 0.01
"""Boxes overlap when they reach further than this into each other on every axis."""

MOST_ASKEW_RAD = 0.2
"""How far the engine's own driver turns a car from its lane's direction, at most; 11°."""


def near_pairs(
    x_m: FloatColumn, y_m: FloatColumn, reach_m: FloatColumn, subjects: IntColumn
) -> tuple[IntColumn, IntColumn]:
    """Return (subject, other) of the pairs whose circles overlap, shape ``(k,)`` each.

    A pair of two subjects comes up once, with the smaller row first.

    Args:
        x_m: Centres, shape ``(n,)``.
        y_m: Likewise.
        reach_m: Radii of circles around the bodies, shape ``(n,)``.
        subjects: Rows whose neighbours are sought.
    """
    order = np.argsort(x_m, kind="stable")
    sorted_x_m, widest_m = x_m[order], float(reach_m.max(initial=0.0))
    first = np.searchsorted(sorted_x_m, x_m[subjects] - reach_m[subjects] - widest_m, side="left")
    last = np.searchsorted(sorted_x_m, x_m[subjects] + reach_m[subjects] + widest_m, side="right")
    counts = last - first
    one = np.repeat(subjects, counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    other = order[np.repeat(first, counts) + within]
    is_subject = np.zeros(len(x_m), np.bool_)
    is_subject[subjects] = True
    apart_m = np.hypot(x_m[other] - x_m[one], y_m[other] - y_m[one])
    kept = (apart_m < reach_m[one] + reach_m[other]) & (one != other) & (~is_subject[other] | (one < other))
    return one[kept], other[kept]


def overlap(
    centre_m: FloatColumn, heading_rad: FloatColumn, half_m: FloatColumn, one: IntColumn, other: IntColumn
) -> BoolColumn:
    """Return which pairs of boxes overlap by more than ``TOLERANCE_M`` on every axis, shape ``(k,)``.

    Args:
        centre_m: Centres of the boxes, shape ``(n, 2)``.
        heading_rad: Directions of their long sides, shape ``(n,)``.
        half_m: Half lengths and half widths, shape ``(n, 2)``.
        one: First box of each pair, shape ``(k,)``.
        other: Second box of each pair, shape ``(k,)``.
    """
    forward = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
    axes = np.stack([forward, np.column_stack([-forward[:, 1], forward[:, 0]])], axis=1)
    apart_m = centre_m[other] - centre_m[one]
    overlaps = np.ones(len(one), np.bool_)
    for box in (one, other):
        for number in (0, 1):
            axis = axes[box, number]
            room_m = np.abs((apart_m * axis).sum(axis=1))
            for each in (one, other):
                shadow = np.abs(np.einsum("kij,kj->ki", axes[each], axis))
                room_m = room_m - (half_m[each] * shadow).sum(axis=1)
            overlaps &= room_m < -TOLERANCE_M
    return overlaps


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
    _roles: dict[frozenset[str], tuple[str, str]] = field(default_factory=dict)
    """(collider, victim) of every pair that has ever touched."""

    def merged(self, snapshot: Snapshot, bound_ids: Collection[str]) -> tuple[Collision, ...]:
        """Return the contacts of this step: the engine's, then those of bound vehicles that it lacks."""
        found: dict[frozenset[str], Collision] = {}
        for contact in snapshot.collisions:
            pair = frozenset((contact.collider, contact.victim))
            collider, victim = self._roles.setdefault(pair, (contact.collider, contact.victim))
            found.setdefault(
                pair, Collision(collider, victim, contact.kind, contact.lane_id, contact.position_m)
            )
        subjects = np.array(
            sorted(snapshot.index_of[name] for name in bound_ids if name in snapshot.index_of), np.int64
        )
        for one, other in self._overlapping(snapshot, snapshot.heading_rad, subjects):
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
        lanes = int(snapshot.lane[one]), int(snapshot.lane[other])
        if min(lanes) < 0 or not self.places or not self.places[lanes[0]].isdisjoint(self.places[lanes[1]]):
            return False
        if self.levels is None:
            return True
        rows = np.array([one, other], np.int64)
        half_m, heading_rad = 0.5 * snapshot.length_m[rows], snapshot.heading_rad[rows]
        x_m = float((snapshot.front_x_m[rows] - half_m * np.cos(heading_rad)).mean())
        y_m = float((snapshot.front_y_m[rows] - half_m * np.sin(heading_rad)).mean())
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
        lane = snapshot.lane[rows]
        along = self.road.points_ahead(lane, snapshot.lane_position_m[rows], snapshot.next_lane[rows])
        askew = np.remainder(snapshot.heading_rad[rows] - along.heading_rad + np.pi, 2.0 * np.pi) - np.pi
        own = np.array([snapshot.ids[row] not in bound_ids for row in rows.tolist()]) & (lane >= 0)
        turned = own & (np.abs(askew) > MOST_ASKEW_RAD)
        if not turned.any():
            return False
        heading_rad = snapshot.heading_rad.copy()
        straightened = along.heading_rad + np.clip(askew, -MOST_ASKEW_RAD, MOST_ASKEW_RAD)
        heading_rad[rows] = np.where(turned, straightened, heading_rad[rows])
        pair = (min(one, other), max(one, other))
        found = self._overlapping(snapshot, heading_rad, np.array([one], np.int64))
        return pair not in {(min(found_pair), max(found_pair)) for found_pair in found}

    def _overlapping(
        self, snapshot: Snapshot, heading_rad: FloatColumn, subjects: IntColumn
    ) -> list[tuple[int, int]]:
        if not len(subjects):
            return []
        half_m = 0.5 * np.column_stack([snapshot.length_m, snapshot.width_m])
        centre_m = np.column_stack(
            [
                snapshot.front_x_m - half_m[:, 0] * np.cos(heading_rad),
                snapshot.front_y_m - half_m[:, 0] * np.sin(heading_rad),
            ]
        )
        one, other = near_pairs(centre_m[:, 0], centre_m[:, 1], np.hypot(*half_m.T), subjects)
        touching = overlap(centre_m, heading_rad, half_m, one, other)
        return list(zip(one[touching].tolist(), other[touching].tolist(), strict=True))

    def _contact(self, snapshot: Snapshot, one: int, other: int, pair: frozenset[str]) -> Collision:
        """Return the contact of two rows; the collider is who moves faster towards the other."""
        if pair not in self._roles:
            towards_x_m = snapshot.front_x_m[other] - snapshot.front_x_m[one]
            towards_y_m = snapshot.front_y_m[other] - snapshot.front_y_m[one]
            closing = [
                sign
                * float(snapshot.speed_mps[row])
                * (
                    towards_x_m * np.cos(snapshot.heading_rad[row])
                    + towards_y_m * np.sin(snapshot.heading_rad[row])
                )
                for row, sign in ((one, 1.0), (other, -1.0))
            ]
            first, second = (one, other) if closing[0] >= closing[1] else (other, one)
            self._roles[pair] = snapshot.ids[first], snapshot.ids[second]
        collider, victim = self._roles[pair]
        row = snapshot.index_of[collider]
        if snapshot.lane[row] < 0:
            row = snapshot.index_of[victim]
        lane = int(snapshot.lane[row])
        lane_id = self.lane_ids[lane] if lane >= 0 else ""
        return Collision(collider, victim, OVERLAP, lane_id, float(snapshot.lane_position_m[row]))
