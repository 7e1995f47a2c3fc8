"""Which lanes lead along a route: how far each of them does, and which lane changes are needed.

For every lane of every edge of a route, from its end backwards: how far one gets on it without a lane
change (its reach), and how many lane changes are needed from there on. On each edge the lane to be in is
the one that reaches furthest, among equals the one with the fewest changes beyond, then the nearest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xgv_cosim.worlds.sumo.network import Link, SumoNetwork
    from xgv_cosim.worlds.sumo.road import SumoRoad

HORIZON_M = 1500.0
"""Reaches beyond this count as equal: nobody changes lanes so long before."""
_MOST_LANES = 32
"""A way has no more lanes than this."""
_SAME_M = 1.0
"""Reaches that differ by less are equal."""


class LaneChoice(NamedTuple):
    """One lane of one edge of a route."""

    onward: tuple[int, ...]
    """The lanes to the next edge of the route, through the junction, the lane there last; empty: it ends."""
    reach_m: float
    """From its beginning to where it no longer leads on without a lane change; ``inf``: the route's end."""
    changes: int
    """Lanes to be changed on this edge, positive to the left."""
    beyond: int
    """Fewest lane changes on later edges, from the lane that is changed to."""


@dataclass(frozen=True, slots=True)
class RoutePlan:
    """The lanes of one route, for one class of vehicles."""

    edges: tuple[str, ...]
    choices: tuple[dict[int, LaneChoice], ...]
    """For each edge of the route its lanes that may be used."""


def plan_route(road: SumoRoad, network: SumoNetwork, edges: Sequence[str], vehicle_class: str) -> RoutePlan:
    """Return which lanes lead along a route."""
    planned: list[dict[int, LaneChoice]] = []
    following: dict[int, LaneChoice] | None = None
    for index in range(len(edges) - 1, -1, -1):
        usable = [
            lane for lane in network.lanes_of.get(edges[index], ()) if network.may_use(lane, vehicle_class)
        ]
        next_edge = edges[index + 1] if index + 1 < len(edges) else None
        following = _plan_edge(road, network, usable, next_edge, following)
        planned.append(following)
    return RoutePlan(tuple(edges), tuple(reversed(planned)))


def _plan_edge(
    road: SumoRoad,
    network: SumoNetwork,
    usable: Sequence[int],
    next_edge: str | None,
    following: dict[int, LaneChoice] | None,
) -> dict[int, LaneChoice]:
    """Return the choices of one edge from those of the next."""
    straight: dict[int, tuple[tuple[int, ...], float, int]] = {}
    for lane in usable:
        if next_edge is None or following is None:
            straight[lane] = (), math.inf, 0
            continue
        straight[lane] = (), float(road.lengths_m[lane]), 1000
        ways = [
            link for link in network.links[lane] if link.edge_id == next_edge and link.target in following
        ]
        if ways:
            best = min(ways, key=lambda link: _merit(following[link.target]))
            choice, lanes = following[best.target], through(road, network, best, next_edge)
            length_m = float(sum(road.lengths_m[number] for number in (lane, *lanes[:-1])))
            straight[lane] = lanes, length_m + choice.reach_m, abs(choice.changes) + choice.beyond
    place = {lane: network.place[lane] for lane in usable}
    choices: dict[int, LaneChoice] = {}
    for lane in usable:
        best_lane = min(
            (other for other in usable if _connected(place, usable, lane, other)),
            key=lambda other: (
                -min(straight[other][1], HORIZON_M) // _SAME_M,
                straight[other][2],
                abs(place[other] - place[lane]),
                other,
            ),
        )
        onward, reach_m, _ = straight[lane]
        changes = (place[best_lane] - place[lane]) * network.leftwards
        choices[lane] = LaneChoice(onward, reach_m, changes, straight[best_lane][2])
    return choices


def _merit(choice: LaneChoice) -> tuple[float, int, int]:
    return (
        -min(choice.reach_m, HORIZON_M) // _SAME_M,
        abs(choice.changes) + choice.beyond,
        abs(choice.changes),
    )


def _connected(place: dict[int, int], usable: Sequence[int], lane: int, other: int) -> bool:
    """Return whether all lanes between two may be used."""
    low, high = sorted((place[lane], place[other]))
    return set(range(low, high + 1)) <= {place[number] for number in usable}


def through(road: SumoRoad, network: SumoNetwork, link: Link, edge_id: str) -> tuple[int, ...]:
    """Return the lanes of a link: those in the junction, and last the one on the edge reached."""
    lanes = [link.first]
    while road.edge_ids[lanes[-1]] != edge_id and len(lanes) < _MOST_LANES:
        onward = [way for way in network.links[lanes[-1]] if way.edge_id == edge_id]
        if not onward:
            break
        lanes.append(onward[0].first)
    return tuple(lanes)


class Way(NamedTuple):
    """The lanes ahead of one vehicle along its route, from the lane it is on."""

    lanes: tuple[int, ...]
    starts_m: tuple[float, ...]
    """Where each begins, from the beginning of the first."""
    end_m: float
    """Where the way ends because the lane does not lead on, from the beginning of the first; ``inf``: not."""
    route_end_m: float
    """Where the route ends, if the way gets there; ``inf``: beyond ``HORIZON_M``."""
    changes: int
    """Lanes to be changed on the first lane's edge, positive to the left."""


def way_along(
    road: SumoRoad, network: SumoNetwork, plan: RoutePlan, index: int, lane: int, least_m: float
) -> Way:
    """Return the way from a lane along a route.

    Args:
        road: The lanes.
        network: Their links.
        plan: The route's plan.
        index: Where on the route the vehicle is; inside a junction, the edge before it.
        lane: The lane it is on.
        least_m: So far beyond the end of the first lane the way is followed at least.
    """
    lanes, changes = [lane], 0
    on_edge = 0 <= index < len(plan.edges) and lane in plan.choices[index]
    if on_edge:
        changes = plan.choices[index][lane].changes
    else:
        target = plan.edges[index + 1] if index + 1 < len(plan.edges) else ""
        link = next((way for way in network.links[lane] if way.edge_id == target), None)
        if network.is_internal[lane] and link is not None:
            lanes += through(road, network, link, target)
            index += 1
        elif network.links[lane]:
            lanes.append(network.links[lane][0].first)  # beside its route: wherever the lane leads
            while network.is_internal[lanes[-1]] and network.links[lanes[-1]] and len(lanes) < _MOST_LANES:
                lanes.append(network.links[lanes[-1]][0].first)
            index = len(plan.edges)
    length_m = 0.0
    choice = None
    while index < len(plan.edges):
        choice = plan.choices[index].get(lanes[-1])
        length_m = float(sum(road.lengths_m[number] for number in lanes[1:]))
        if choice is None or not choice.onward:
            break
        if length_m > least_m or len(lanes) + len(choice.onward) > _MOST_LANES:
            break
        lanes += choice.onward
        index += 1
    starts_m = [0.0]
    for number in lanes[:-1]:
        starts_m.append(starts_m[-1] + float(road.lengths_m[number]))
    end_m = route_end_m = math.inf
    if index == len(plan.edges) - 1:
        route_end_m = starts_m[-1] + float(road.lengths_m[lanes[-1]])
    elif choice is not None and math.isfinite(choice.reach_m):
        end_m = starts_m[-1] + choice.reach_m
    return Way(tuple(lanes), tuple(starts_m), end_m, route_end_m, changes)
