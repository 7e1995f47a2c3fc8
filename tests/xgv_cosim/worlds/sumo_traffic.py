"""Traffic on the packaged networks, written for one test."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

STEADY = 'width="1.8" sigma="0" speedDev="0" lcSpeedGain="0" lcKeepRight="0"'
"""No chance in it, and nobody overtakes."""
TYPES = f'<vType id="xgv" length="4.4" minGap="2.5" {STEADY}/>'
TYPES += f'<vType id="car" length="5.2" minGap="1.5" {STEADY}/>'


def network(name: str) -> Path:
    """Return the network file of a packaged scenario."""
    return Path(str(files("sumo_scenarios") / name / f"{name}.net.xml"))


def write_config(folder: Path, vehicles: str, net: Path) -> Path:
    """Write routes and configuration, and return the latter."""
    (folder / "t.rou.xml").write_text(f"<routes>{TYPES}{vehicles}</routes>")
    config = folder / "t.sumocfg"
    config.write_text(
        f'<configuration><net-file value="{net}"/><route-files value="t.rou.xml"/></configuration>'
    )
    return config


def car(
    vehicle_id: str,
    position_m: float,
    speed_mps: float,
    *,
    lane: int = 0,
    route: str = "road",
    kind: str = "car",
    extra: str = "",
) -> str:
    """Return the XML of a vehicle that departs at 0 s."""
    return (
        f'<vehicle id="{vehicle_id}" type="{kind}" depart="0" departLane="{lane}" departPos="{position_m}" '
        f'departSpeed="{speed_mps}"><route edges="{route}"/>{extra}</vehicle>'
    )
