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
_GRID_EDGES_OF_A_ROUTE = 60
_PLACE_EVERY_M = 20.0
_GRID_STREET_M = 160.0
"""Of a street of the grid, so much is surely outside its crossings."""
_MOST_ON_SMALL_GRID = 1500
_TYPES = {
    "light_freeway": '<vType id="car" sigma="0.2" speedDev="0.02"/>',
    "busy_freeway": '<vType id="car" sigma="0.5" speedDev="0.1"/>',
    "grid": '<vType id="car" sigma="0.5" speedDev="0.1"/>',
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
        if len(places) < self.num_vehicles:
            raise ScenarioError(f"grid: no room for {self.num_vehicles} vehicles")
        for number, (street, lane, n) in enumerate(draw.sample(places, self.num_vehicles)):
            depart_m = 10.0 + _PLACE_EVERY_M * n
            yield _vehicle(number, _wander(street, side, draw), lane, depart_m, 0.0)


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


def _wander(street: tuple[int, int, int, int], side: int, draw: random.Random) -> list[str]:
    """Return the streets of a walk that begins with one and never turns back."""
    x, y, dx, dy = street
    edges = []
    for _ in range(_GRID_EDGES_OF_A_ROUTE):
        edges.append(_name(x, y) + _name(x + dx, y + dy))
        x, y = x + dx, y + dy
        dx, dy = draw.choice([way for way in _ways(x, y, side) if way != (-dx, -dy)])
    return edges
