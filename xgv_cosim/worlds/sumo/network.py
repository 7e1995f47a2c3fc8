"""What a SUMO network says of its lanes beyond their geometry: links, permissions, signals. Read once."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import IntColumn
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad


class Link(NamedTuple):
    """One way on from the end of a lane."""

    first: int
    """The first lane on the way: of the junction, or of the edge reached."""
    target: int
    """The lane of the edge reached."""
    edge_id: str
    """That edge; of a lane inside a junction the edge beyond."""
    letter: str
    """SUMO's letter for its right of way; where a signal stands, that of the moment in which it was read."""
    signal: tuple[str, int] | None
    """(traffic light, index in its state), None: no signal."""


@dataclass(frozen=True)
class SumoNetwork:
    """Links, permissions and neighbours of all lanes, by number in ``SumoRoad``."""

    links: tuple[tuple[Link, ...], ...]
    is_internal: tuple[bool, ...]
    """Inside a junction."""
    lanes_of: dict[str, tuple[int, ...]]
    """The lanes of each edge, the one at the kerb first."""
    place: tuple[int, ...]
    """Each lane's place in its edge, 0: at the kerb."""
    leftwards: int
    """By how much the place of a lane grows from one to its left, see ``SumoRoad.leftwards``."""
    before: tuple[tuple[int, ...], ...]
    """The lanes from which one comes onto each lane."""
    allowed: tuple[frozenset[str], ...]
    """Vehicle classes that may use each lane; empty: all."""
    may_leave_left: tuple[frozenset[str], ...]
    """Vehicle classes that may change to the left; empty: all."""
    may_leave_right: tuple[frozenset[str], ...]
    signal_of_first: dict[int, tuple[str, int]]
    """The signal before the first lane of a way through a junction."""

    @classmethod
    def read(cls, engine: Engine, road: SumoRoad) -> SumoNetwork:
        """Read the network of the open simulation."""
        lane, number = engine.lane, road.index_of
        signals: dict[tuple[int, int], tuple[str, int]] = {}
        for light in engine.trafficlight.getIDList():
            for index, group in enumerate(engine.trafficlight.getControlledLinks(light)):
                for source, target, via in group:
                    first = number.get(via or target, -1)
                    if source in number and first >= 0:
                        signals[number[source], first] = light, index
        links = tuple(
            tuple(
                Link(
                    first := number[via or target],
                    number[target],
                    road.edge_ids[number[target]],
                    letter,
                    signals.get((source, first)),
                )
                for target, _, _, _, via, letter, *_ in lane.getLinks(lane_id)
            )
            for source, lane_id in enumerate(road.lane_ids)
        )
        by_edge: defaultdict[str, list[tuple[int, int]]] = defaultdict(list)
        for index, lane_id in enumerate(road.lane_ids):
            by_edge[road.edge_ids[index]].append((int(lane_id.rpartition("_")[2]), index))
        lanes_of = {edge: tuple(index for _, index in sorted(found)) for edge, found in by_edge.items()}
        before: list[list[int]] = [[] for _ in road.lane_ids]
        for source, ways in enumerate(links):
            for link in ways:
                before[link.first].append(source)
        return cls(
            links=links,
            is_internal=tuple(lane_id.startswith(":") for lane_id in road.lane_ids),
            lanes_of=lanes_of,
            place=tuple(lanes_of[road.edge_ids[index]].index(index) for index in range(len(road.lane_ids))),
            leftwards=road.leftwards,
            before=tuple(map(tuple, before)),
            allowed=tuple(frozenset(lane.getAllowed(lane_id)) for lane_id in road.lane_ids),
            may_leave_left=tuple(
                frozenset(lane.getChangePermissions(lane_id, road.leftwards)) for lane_id in road.lane_ids
            ),
            may_leave_right=tuple(
                frozenset(lane.getChangePermissions(lane_id, -road.leftwards)) for lane_id in road.lane_ids
            ),
            signal_of_first={first: signal for (_, first), signal in signals.items()},
        )

    def may_use(self, lane: int, vehicle_class: str) -> bool:
        """Return whether a class of vehicles may drive on a lane."""
        allowed = self.allowed[lane]
        return not allowed or vehicle_class in allowed

    def beside(self, lane: int, side: int, vehicle_class: str) -> int:
        """Return the lane to the left (1) or right (-1) that may be changed to, -1: none."""
        if self.is_internal[lane]:
            return -1
        permitted = self.may_leave_left[lane] if side > 0 else self.may_leave_right[lane]
        if permitted and vehicle_class not in permitted:
            return -1
        lanes = self.lanes_of_edge_at(lane)
        place = self.place[lane] + side * self.leftwards
        if not 0 <= place < len(lanes) or not self.may_use(lanes[place], vehicle_class):
            return -1
        return lanes[place]

    def lanes_of_edge_at(self, lane: int) -> tuple[int, ...]:
        """Return all lanes of the edge that a lane belongs to, the one at the kerb first."""
        return self._siblings[lane]

    @cached_property
    def before_columns(self) -> tuple[IntColumn, IntColumn]:
        """Return the lanes that lead to each lane, lane by lane, and where those of each begin."""
        counts = [len(sources) for sources in self.before]
        flat = [source for sources in self.before for source in sources]
        return np.array(flat, np.int64), np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    @cached_property
    def _siblings(self) -> tuple[tuple[int, ...], ...]:
        by_lane = {index: lanes for lanes in self.lanes_of.values() for index in lanes}
        return tuple(by_lane[index] for index in range(len(self.links)))
