"""Write the plain network and the traffic of ``curve``; see ``README.md`` beside it.

A rural road, one lane in each direction: a straight, a left-hand curve of constant radius through a quarter
circle, and a straight again. Traffic comes the other way as well.
"""

from __future__ import annotations

import math
from pathlib import Path

RADIUS_M = 300.0
STRAIGHT_M = 400.0
LIMIT_MPS = 25.0
POINTS_IN_CURVE = 90
XGV_EVERY_S = 30.0
"""Far enough apart for each to find the road free."""

HEADER = "<!-- written by generate.py -->\n"


def road_points() -> list[tuple[float, float]]:
    """Return the middle of the road from west to north."""
    turns = (math.radians(90.0) * step / POINTS_IN_CURVE for step in range(POINTS_IN_CURVE + 1))
    curve = [(STRAIGHT_M + RADIUS_M * math.sin(turn), RADIUS_M * (1.0 - math.cos(turn))) for turn in turns]
    return [(0.0, 0.0), *curve, (STRAIGHT_M + RADIUS_M, RADIUS_M + STRAIGHT_M)]


def network_files() -> dict[str, str]:
    """Return the texts of the node and edge files."""
    points = road_points()
    there = " ".join(f"{x_m:.2f},{y_m:.2f}" for x_m, y_m in points)
    back = " ".join(f"{x_m:.2f},{y_m:.2f}" for x_m, y_m in reversed(points))
    nodes = "\n".join(
        f'    <node id="{name}" x="{x_m:.2f}" y="{y_m:.2f}"/>'
        for name, (x_m, y_m) in (("west", points[0]), ("north", points[-1]))
    )
    edges = "\n".join(
        f'    <edge id="{name}" from="{begin}" to="{end}" numLanes="1" speed="{LIMIT_MPS}" shape="{shape}"/>'
        for name, begin, end, shape in (
            ("northbound", "west", "north", there),
            ("southbound", "north", "west", back),
        )
    )
    return {
        "curve.nod.xml": f"{HEADER}<nodes>\n{nodes}\n</nodes>\n",
        "curve.edg.xml": f"{HEADER}<edges>\n{edges}\n</edges>\n",
    }


def route_file() -> str:
    """Return the text of the route file: three XGVs, each with a car behind it, and oncoming traffic."""
    lines = [
        f"{HEADER}<routes>",
        '    <vType id="car" vClass="passenger" length="4.6" width="1.8" sigma="0.3"',
        '           speedFactor="normc(0.95,0.05,0.85,1)"/>',
        '    <vType id="xgv" vClass="passenger" length="4.43" width="1.81" sigma="0.3" speedFactor="0.95"',
        '           speedDev="0" color="1,0.5,0"/>',
        '    <route id="north" edges="northbound"/>',
        '    <route id="south" edges="southbound"/>',
        '    <flow id="oncoming" type="car" route="south" begin="0" end="100" period="9" departSpeed="20"/>',
    ]
    for number in range(3):
        depart = f'depart="{XGV_EVERY_S * number:g}"'
        for kind, position_m in (("xgv", 200), ("car", 155)):
            lines.append(
                f'    <vehicle id="{kind}_{number}" type="{kind}" route="north" {depart} '
                f'departPos="{position_m}" departSpeed="20"/>'
            )
    return "\n".join([*lines, "</routes>", ""])


def main() -> None:
    """Write the three files beside this one."""
    folder = Path(__file__).parent
    for name, text in {**network_files(), "curve.rou.xml": route_file()}.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
