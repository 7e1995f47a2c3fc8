"""Write the plain network and the traffic of ``freeway_estop``; see ``README.md`` beside it.

The road winds gently: its heading is ``0.35 sin(2 pi s / 5000 m)``, so no curve is tighter than 2.2 km.
Traffic stands on it from the first step on, in three lanes, thinned at the downstream end so that nobody
leaves before the end of the run; three flows feed the upstream end.
"""

from __future__ import annotations

import math
import random
from pathlib import Path
from typing import NamedTuple

SEED = 20
NUM_EDGES = 8
EDGE_LENGTH_M = 1280.0
POINT_SPACING_M = 40.0
LIMIT_MPS = 30.0
LANE_SPEED_MPS = (24.0, 26.0, 27.0)
"""Speeds at the start: below everybody's wish, so that SUMO finds every gap safe and inserts all at once."""
TRUCK_SPEED_MPS = 23.0
TRUCK_SHARE = 0.12
"""Share of trucks in the two right lanes."""
TRAFFIC_END_M = 7000.0
NUM_XGVS = 24
FIRST_XGV_M = 160.0
XGV_SPACING_M = 270.0

HEADER = "<!-- written by generate.py -->\n"
ROUTES = """    <vType id="car" vClass="passenger" length="4.6" width="1.8" sigma="0.3"
           speedFactor="normc(1,0.07,0.9,1.15)"/>
    <vType id="van" vClass="passenger" length="6.2" width="2.0" sigma="0.3"
           speedFactor="normc(0.95,0.05,0.9,1.05)" color="0.5,0.7,0.9"/>
    <vType id="truck" vClass="truck" length="14.5" width="2.5" sigma="0.3" maxSpeed="25"
           speedFactor="normc(0.83,0.02,0.8,0.86)" color="0.6,0.6,0.6"/>
    <vType id="xgv" vClass="passenger" length="4.43" width="1.81" sigma="0.3" speedFactor="0.95" speedDev="0"
           color="1,0.5,0"/>
    <vTypeDistribution id="light" vTypes="car van" probabilities="0.8 0.2"/>
    <vTypeDistribution id="mixed" vTypes="car van truck" probabilities="0.68 0.17 0.15"/>
"""
FLOWS = "".join(
    f'    <flow id="inflow_{lane}" type="{kind}" route="from_e0" begin="1" end="130" vehsPerHour="{rate}" '
    f'departLane="{lane}" departSpeed="max"/>\n'
    for lane, kind, rate in ((0, "mixed", 850), (1, "mixed", 1000), (2, "light", 1000))
)


class Start(NamedTuple):
    """One vehicle at the beginning of the run."""

    s_m: float
    """Distance of its front bumper along the road."""
    lane: int
    kind: str


def road_points() -> list[tuple[float, float]]:
    """Return the road's points, ``POINT_SPACING_M`` apart."""
    x_m = y_m = 0.0
    points = [(x_m, y_m)]
    for step in range(round(NUM_EDGES * EDGE_LENGTH_M / POINT_SPACING_M)):
        heading = 0.35 * math.sin(2.0 * math.pi * (step + 0.5) * POINT_SPACING_M / 5000.0)
        x_m += POINT_SPACING_M * math.cos(heading)
        y_m += POINT_SPACING_M * math.sin(heading)
        points.append((x_m, y_m))
    return points


def network_files() -> dict[str, str]:
    """Return the texts of the node and edge files."""
    points = road_points()
    per_edge = round(EDGE_LENGTH_M / POINT_SPACING_M)
    nodes, edges = ["<nodes>"], ["<edges>"]
    for number in range(NUM_EDGES + 1):
        x_m, y_m = points[number * per_edge]
        nodes.append(f'    <node id="n{number}" x="{x_m:.2f}" y="{y_m:.2f}"/>')
    for number in range(NUM_EDGES):
        shape = " ".join(
            f"{x_m:.2f},{y_m:.2f}" for x_m, y_m in points[number * per_edge : (number + 1) * per_edge + 1]
        )
        edges.append(
            f'    <edge id="e{number}" from="n{number}" to="n{number + 1}" numLanes="3" speed="{LIMIT_MPS}" '
            f'shape="{shape}"/>'
        )
    return {
        "freeway_estop.nod.xml": HEADER + "\n".join([*nodes, "</nodes>", ""]),
        "freeway_estop.edg.xml": HEADER + "\n".join([*edges, "</edges>", ""]),
    }


def starts(rng: random.Random) -> list[Start]:
    """Return everybody who is on the road at the start, lane by lane."""
    found = []
    for lane in range(3):
        s_m = 30.0 + 20.0 * lane
        while s_m < TRAFFIC_END_M:
            kind = "van" if rng.random() < 0.2 else "car"
            if lane < 2 and rng.random() < TRUCK_SHARE:
                kind = "truck"
            found.append(Start(round(s_m, 1), lane, kind))
            s_m += rng.uniform(70.0, 105.0)
    return found


def route_file() -> str:
    """Return the text of the route file."""
    rng = random.Random(SEED)  # noqa: S311 - traffic, not secrets
    vehicles = dict(enumerate(starts(rng)))
    names = {number: f"{start.kind}_{number}" for number, start in vehicles.items()}
    for xgv in range(NUM_XGVS):
        target_m = FIRST_XGV_M + XGV_SPACING_M * xgv
        in_lane = [number for number, start in vehicles.items() if start.lane == xgv % 3]
        chosen = min(in_lane, key=lambda number: abs(vehicles[number].s_m - target_m))
        names[chosen] = f"xgv_{xgv}"
        vehicles[chosen] = vehicles[chosen]._replace(kind="xgv")
    lines = [HEADER + "<routes>", ROUTES.rstrip()]
    for first in range(NUM_EDGES):
        edges = " ".join(f"e{number}" for number in range(first, NUM_EDGES))
        lines.append(f'    <route id="from_e{first}" edges="{edges}"/>')
    for number, start in vehicles.items():
        edge, position_m = divmod(start.s_m, EDGE_LENGTH_M)
        speed_mps = TRUCK_SPEED_MPS if start.kind == "truck" else LANE_SPEED_MPS[start.lane]
        lines.append(
            f'    <vehicle id="{names[number]}" type="{start.kind}" route="from_e{edge:.0f}" depart="0" '
            f'departLane="{start.lane}" departPos="{position_m:.1f}" departSpeed="{speed_mps}"/>'
        )
    return "\n".join([*lines, FLOWS.rstrip(), "</routes>", ""])


def main() -> None:
    """Write the three files beside this one."""
    folder = Path(__file__).parent
    for name, text in {**network_files(), "freeway_estop.rou.xml": route_file()}.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
