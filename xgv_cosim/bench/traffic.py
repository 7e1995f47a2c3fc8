"""Traffic to measure on: as many vehicles as asked for, all there from the start to the end."""

from __future__ import annotations

import random
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from xgv_cosim.errors import ScenarioError

if TYPE_CHECKING:
    from collections.abc import Iterator

_FREEWAY_EDGE_M = 2000.0
_FREEWAY_EDGES = 75
_FREEWAY_LANES = 3
_GRID_SIDE = {"grid": 10, "large_grid": 20}
_GRID_EDGES_OF_A_ROUTE = 20
_GRID_EDGES_DRIVEN = 8
_PLACE_EVERY_M = 20.0
_GRID_STREET_M = 160.0
"""Of a street of the grid, so much is surely outside its crossings."""
_MOST_ON_SMALL_GRID = 1500
_TYPES = {
    "light_freeway": '<vType id="car" sigma="0.2" speedDev="0.02"/>',
    "busy_freeway": '<vType id="car" sigma="0.5" speedDev="0.1"/>',
    "grid": '<vType id="car" sigma="0.5" speedDev="0.1" lcSpeedGain="0" lcKeepRight="0" lcCooperative="0"/>',
}
_GAP_M = {"light_freeway": 70.0, "busy_freeway": 28.0}
"""From bumper to bumper of the next car of the same lane; car included."""
NETWORKS = tuple(_TYPES)


@dataclass(frozen=True, slots=True)
class Traffic:
    """One traffic to measure on."""

    network: str
    """One of ``NETWORKS``."""
    num_vehicles: int
    seed: int = 1

    def __post_init__(self) -> None:
        if self.network not in NETWORKS:
            raise ScenarioError(f"network: got {self.network!r}, expected one of {', '.join(NETWORKS)}")
        if self.num_vehicles < 1:
            raise ScenarioError(f"vehicles: got {self.num_vehicles}, expected 1 or more")

    @property
    def net_name(self) -> str:
        """Return which of the packaged networks it drives on."""
        if self.network != "grid":
            return "freeway"
        return "grid" if self.num_vehicles <= _MOST_ON_SMALL_GRID else "large_grid"

    def write(self, folder: Path) -> Path:
        """Write network, demand and configuration into a folder, and return the configuration."""
        packed = files("xgv_cosim.bench").joinpath("networks", f"{self.net_name}.net.xml.gz")
        net = folder / f"{self.net_name}.net.xml.gz"
        net.write_bytes(packed.read_bytes())
        vehicles = self._on_grid() if self.network == "grid" else self._on_freeway()
        demand = folder / "demand.rou.xml"
        demand.write_text("\n".join(["<routes>", _TYPES[self.network], *vehicles, "</routes>"]))
        config = folder / "bench.sumocfg"
        config.write_text(
            f'<configuration><net-file value="{net.name}"/><route-files value="{demand.name}"/>'
            '<step-length value="0.1"/></configuration>'
        )
        return config

    def _on_freeway(self) -> Iterator[str]:
        edges = [f"e{number}" for number in range(_FREEWAY_EDGES)]
        gap_m, speed_mps = _GAP_M[self.network], 25.0 if self.network == "light_freeway" else 15.0
        for number in range(self.num_vehicles):
            along_m = 50.0 + gap_m * (number // _FREEWAY_LANES) + 9.0 * (number % _FREEWAY_LANES)
            first, depart_m = divmod(along_m, _FREEWAY_EDGE_M)
            if first >= _FREEWAY_EDGES - 2:
                raise ScenarioError(f"{self.network}: no room for {self.num_vehicles} vehicles")
            yield _vehicle(number, edges[int(first) :], number % _FREEWAY_LANES, depart_m, speed_mps)

    def _on_grid(self) -> Iterator[str]:
        draw = random.Random(self.seed)  # noqa: S311 - traffic, no secret
        side = _GRID_SIDE[self.net_name]
        streets = [(x, y, dx, dy) for x in range(side) for y in range(side) for dx, dy in _ways(x, y, side)]
        per_lane = int(_GRID_STREET_M // _PLACE_EVERY_M)
        places = [(street, lane, n) for street in streets for lane in (0, 1) for n in range(per_lane)]
        number = 0
        for street, lane, n in draw.sample(places, len(places)):
            walk = _walk(street, side, lane, draw)
            if walk:
                yield _vehicle(number, walk, lane, 10.0 + _PLACE_EVERY_M * n, 0.0)
                number += 1
            if number == self.num_vehicles:
                return
        raise ScenarioError(f"grid: no room for {self.num_vehicles} vehicles")


def _vehicle(number: int, edges: list[str], lane: int, depart_m: float, speed_mps: float) -> str:
    return (
        f'<vehicle id="v{number}" type="car" depart="0" departLane="{lane}" departPos="{depart_m:.1f}" '
        f'departSpeed="{speed_mps:g}"><route edges="{" ".join(edges)}"/></vehicle>'
    )


def _ways(x: int, y: int, side: int) -> list[tuple[int, int]]:
    ways = ((1, 0), (-1, 0), (0, 1), (0, -1))
    return [(dx, dy) for dx, dy in ways if 0 <= x + dx < side and 0 <= y + dy < side]


def _name(x: int, y: int) -> str:
    return f"{chr(ord('A') + x)}{y}"


def _walk(street: tuple[int, int, int, int], side: int, lane: int, draw: random.Random) -> list[str]:
    """Return the streets of a walk that begins with one and never turns back; none if there is no good one.

    As far as a measured car comes, it leads straight on or to the side of the lane, so that nobody has to
    change lanes: SUMO does that within a given time, at a crawl nearly sideways, where no car can follow.
    And it keeps clear of the grid's corners, whose turns are tighter than a car's.
    """
    x, y, dx, dy = street
    edges = []
    for number in range(_GRID_EDGES_OF_A_ROUTE):
        edges.append(_name(x, y) + _name(x + dx, y + dy))
        x, y = x + dx, y + dy
        onward = [way for way in _ways(x, y, side) if way != (-dx, -dy)]
        if number < _GRID_EDGES_DRIVEN:
            wrong_side = (-dy, dx) if lane == 0 else (dy, -dx)
            onward = [way for way in onward if way != wrong_side]
            if not onward or len(_ways(x, y, side)) == 2:
                return []
        dx, dy = draw.choice(onward)
    return edges
