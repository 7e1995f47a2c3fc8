"""Write the plain network and the traffic of ``link_loss``; see ``README.md`` beside it.

A straight two-lane road, dense from the first step on: the gaps are those that SUMO's drivers keep at that
speed. Every third vehicle is an XGV.
"""

from __future__ import annotations

from pathlib import Path

LENGTH_M = 3000.0
LIMIT_MPS = 22.22
SPEED_MPS = 15.0
SPACING_M = 32.0
"""Front bumper to front bumper; at 15 m/s a time gap of 1.8 s behind a car of 4.6 m."""
NUM_PER_LANE = 42
FIRST_M = 60.0

HEADER = "<!-- written by generate.py -->\n"


def network_files() -> dict[str, str]:
    """Return the texts of the node and edge files."""
    return {
        "link_loss.nod.xml": HEADER
        + '<nodes>\n    <node id="west" x="0.00" y="0.00"/>\n'
        + f'    <node id="east" x="{LENGTH_M:.2f}" y="0.00"/>\n</nodes>\n',
        "link_loss.edg.xml": HEADER
        + f'<edges>\n    <edge id="road" from="west" to="east" numLanes="2" speed="{LIMIT_MPS}"/>\n'
        + "</edges>\n",
    }


def route_file() -> str:
    """Return the text of the route file."""
    lines = [
        f"{HEADER}<routes>",
        '    <vType id="car" vClass="passenger" length="4.6" width="1.8" sigma="0.3"',
        '           speedFactor="normc(1,0.05,0.9,1.1)"/>',
        '    <vType id="xgv" vClass="passenger" length="4.43" width="1.81" sigma="0.3" speedFactor="0.95"',
        '           speedDev="0" color="1,0.5,0"/>',
        '    <route id="along" edges="road"/>',
    ]
    number = {"xgv": 0, "car": 0}
    for lane in range(2):
        for place in range(NUM_PER_LANE):
            kind = "xgv" if (place + lane) % 3 == 1 else "car"
            position_m = FIRST_M + SPACING_M * place + 0.5 * SPACING_M * lane
            lines.append(
                f'    <vehicle id="{kind}_{number[kind]}" type="{kind}" route="along" depart="0" '
                f'departLane="{lane}" departPos="{position_m:.1f}" departSpeed="{SPEED_MPS:g}"/>'
            )
            number[kind] += 1
    return "\n".join([*lines, "</routes>", ""])


def main() -> None:
    """Write the three files beside this one."""
    folder = Path(__file__).parent
    for name, text in {**network_files(), "link_loss.rou.xml": route_file()}.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
