"""Write the plain network and the traffic of ``merge``; see ``README.md`` beside it.

A two-lane motorway; a ramp joins it from the right as a third lane, the acceleration lane, which ends.
"""

from __future__ import annotations

from pathlib import Path

NODES = {"west": (0, 0), "nose": (900, 0), "end": (1150, 0), "east": (2400, 0), "yard": (500, -90)}
EDGES = (
    # id, from, to, lanes, speed, shape
    ("before", "west", "nose", 2, 27.78, ""),
    ("ramp", "yard", "nose", 1, 19.44, "500,-90 700,-45 800,-17 850,-8.2 900,-6.4"),
    ("merging", "nose", "end", 3, 27.78, ""),
    ("after", "end", "east", 2, 27.78, ""),
)
CONNECTIONS = (
    # from, to, from lane, to lane
    ("before", "merging", 0, 1),
    ("before", "merging", 1, 2),
    ("ramp", "merging", 0, 0),
    ("merging", "after", 1, 0),
    ("merging", "after", 2, 1),
)
NUM_MAIN_XGVS = 3
NUM_RAMP_XGVS = 4

HEADER = "<!-- written by generate.py -->\n"


def network_files() -> dict[str, str]:
    """Return the texts of the node, edge and connection files."""
    nodes = "\n".join(f'    <node id="{name}" x="{x}" y="{y}"/>' for name, (x, y) in NODES.items())
    edges = "\n".join(
        f'    <edge id="{name}" from="{begin}" to="{end}" numLanes="{lanes}" speed="{speed}"'
        + (f' shape="{shape}"' if shape else "")
        + ' spreadType="right"/>'
        for name, begin, end, lanes, speed, shape in EDGES
    )
    links = "\n".join(
        f'    <connection from="{begin}" to="{end}" fromLane="{lane}" toLane="{to_lane}"/>'
        for begin, end, lane, to_lane in CONNECTIONS
    )
    return {
        "merge.nod.xml": f"{HEADER}<nodes>\n{nodes}\n</nodes>\n",
        "merge.edg.xml": f"{HEADER}<edges>\n{edges}\n</edges>\n",
        "merge.con.xml": f"{HEADER}<connections>\n{links}\n</connections>\n",
    }


def route_file() -> str:
    """Return the text of the route file."""
    lines = [
        f"{HEADER}<routes>",
        '    <vType id="car" vClass="passenger" length="4.6" width="1.8" sigma="0.3"',
        '           speedFactor="normc(1,0.07,0.85,1.15)"/>',
        '    <vType id="xgv" vClass="passenger" length="4.43" width="1.81" sigma="0.3" speedFactor="0.95"',
        '           speedDev="0" color="1,0.5,0"/>',
        '    <route id="main" edges="before merging after"/>',
        '    <route id="from_ramp" edges="ramp merging after"/>',
        (
            '    <flow id="right" type="car" route="main" begin="0" end="90" period="4.3" departLane="0" '
            'departSpeed="24"/>'
        ),
        (
            '    <flow id="left" type="car" route="main" begin="0" end="90" period="4.9" departLane="1" '
            'departSpeed="26"/>'
        ),
        '    <flow id="ramp" type="car" route="from_ramp" begin="1" end="90" period="11" departSpeed="15"/>',
    ]
    departures: list[tuple[float, str]] = []
    for number in range(NUM_RAMP_XGVS):
        depart_s = 4.0 + 14.0 * number
        departures.append(
            (
                depart_s,
                (
                    f'    <vehicle id="xgv_ramp_{number}" type="xgv" route="from_ramp" depart="{depart_s:g}" '
                    'departSpeed="15"/>'
                ),
            )
        )
    for number in range(NUM_MAIN_XGVS):
        depart_s = 6.0 + 16.0 * number
        departures.append(
            (
                depart_s,
                (
                    f'    <vehicle id="xgv_main_{number}" type="xgv" route="main" depart="{depart_s:g}" '
                    'departLane="0" departSpeed="24"/>'
                ),
            )
        )
    return "\n".join([*lines, *(row for _, row in sorted(departures)), "</routes>", ""])


def main() -> None:
    """Write the four files beside this one."""
    folder = Path(__file__).parent
    for name, text in {**network_files(), "merge.rou.xml": route_file()}.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
