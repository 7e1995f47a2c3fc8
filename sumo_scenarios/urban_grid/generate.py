"""Write the traffic of ``urban_grid``; see ``README.md`` beside it.

Trips from one edge of the town to another; SUMO finds the way. A share of them are XGVs.
"""

from __future__ import annotations

import random
from pathlib import Path

SEED = 4
COLUMNS = "ABCD"
NUM_TRIPS = 220
LAST_DEPARTURE_S = 120.0
NUM_XGVS = 16
LAST_XGV_DEPARTURE_S = 40.0

HEADER = "<!-- written by generate.py -->\n"


def gates() -> list[tuple[str, str]]:
    """Return (edge into the town, edge out of it) of every place where a street leaves it."""
    found = []
    for number, column in enumerate(COLUMNS):
        found += [(f"bottom{number}{column}0", f"{column}0bottom{number}")]
        found += [(f"top{number}{column}3", f"{column}3top{number}")]
        found += [(f"left{number}A{number}", f"A{number}left{number}")]
        found += [(f"right{number}D{number}", f"D{number}right{number}")]
    return found


def route_file() -> str:
    """Return the text of the route file."""
    rng = random.Random(SEED)  # noqa: S311 - traffic, not secrets
    lines = [
        f"{HEADER}<routes>",
        '    <vType id="car" vClass="passenger" length="4.6" width="1.8" sigma="0.3"',
        '           speedFactor="normc(1,0.07,0.85,1.1)"/>',
        '    <vType id="xgv" vClass="passenger" length="4.43" width="1.81" sigma="0.3" speedFactor="0.95"',
        '           speedDev="0" color="1,0.5,0"/>',
    ]
    departures = [(rng.uniform(0.0, LAST_DEPARTURE_S), "car") for _ in range(NUM_TRIPS - NUM_XGVS)]
    departures += [(rng.uniform(0.0, LAST_XGV_DEPARTURE_S), "xgv") for _ in range(NUM_XGVS)]
    number = {"xgv": 0, "car": 0}
    for depart_s, kind in sorted(departures):
        (entry, _), (_, leave) = rng.sample(gates(), 2)
        lines.append(
            f'    <trip id="{kind}_{number[kind]}" type="{kind}" depart="{depart_s:.1f}" from="{entry}" '
            f'to="{leave}" departLane="best" departSpeed="10"/>'
        )
        number[kind] += 1
    return "\n".join([*lines, "</routes>", ""])


def main() -> None:
    """Write the file beside this one."""
    (Path(__file__).parent / "urban_grid.rou.xml").write_text(route_file(), encoding="utf-8")


if __name__ == "__main__":
    main()
