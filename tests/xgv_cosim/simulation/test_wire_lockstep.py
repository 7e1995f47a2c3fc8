"""The reference stacks through encoded datagrams, in lockstep: the same drive as in the process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

import xgv_cosim
from jaus.transports import LoopbackNetwork
from xgv_cosim.autonomy.reference import ReferenceStack
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.autonomy.wrench import ReferenceWrenchStack
from xgv_cosim.links.jaus_network import JausNetwork
from xgv_cosim.scenario import building
from xgv_cosim.vehicles.xgv.wire.client import StackOverTheWire

if TYPE_CHECKING:
    from pathlib import Path

    from jaus.address import JausAddress
    from xgv_cosim.links.base import Link
    from xgv_cosim.parameters import VehicleParameters
    from xgv_cosim.scenario.sections import BindSection
    from xgv_cosim.simulation.binding import LinkFactory

CARS = "cars"


@dataclass
class Drive:
    """What came of a run."""

    poses: dict[str, np.ndarray]
    """Of each car x, y and speed after each step, shape ``(steps, 3)``."""
    events: list[tuple[float, str, str, str]]
    datagrams: int = 0


def driven(scenario: str, stack: str, seconds: float, loopback: LoopbackNetwork | None = None) -> Drive:
    rows: dict[str, list[tuple[float, float, float]]] = {}
    with xgv_cosim.simulate(scenario, set=[f"bind.0.stack={stack}"]) as run:
        network = None
        if loopback is not None:
            network = JausNetwork(lambda _: loopback.open(CARS))
            run.connect(network)
        while run.now_s < seconds:
            run.step()
            for name in run.vehicle_ids:
                car = run.vehicle(name)
                rows.setdefault(name, []).append((car.pose.x_m, car.pose.y_m, car.speed_mps))
        events = [
            (event.t_s, event.vehicle, event.kind, event.after)
            for event in run.state.journal.events
            if event.kind != "jaus_subsystem"
        ]
        datagrams = 0 if network is None else network.counts.datagrams_received
    return Drive({name: np.array(row) for name, row in rows.items()}, events, datagrams)


def over_the_wire(loopback: LoopbackNetwork) -> object:
    """Return what makes the links of the scenario's stacks: clients behind datagrams."""

    def new_link_of(row: BindSection, parameters: VehicleParameters, _: Path) -> LinkFactory | None:
        settings = ReferenceStackSettings(desired_speed_mps=row.desired_speed_mps)

        def new_link(vehicle_id: str, address: JausAddress) -> Link:
            stack = (
                ReferenceStack(address, settings)
                if row.stack == "reference"
                else ReferenceWrenchStack(address, parameters, settings)
            )
            line = loopback.open(vehicle_id)
            return StackOverTheWire(stack, address, address.subsystem, line, CARS, 0.1)  # type: ignore[return-value]

        return None if row.stack == "none" else new_link

    return new_link_of


@pytest.mark.parametrize(
    ("scenario", "stack", "most_m", "most_mps"),
    [
        ("hello", "reference", 0.03, 0.005),
        ("hello", "reference_wrench", 0.03, 0.01),
        ("freeway_estop", "reference", 0.10, 0.05),
    ],
)
def test_the_same_drive_within_the_wires_quantisation(
    scenario: str, stack: str, most_m: float, most_mps: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """XGV-55 to XGV-61: commands, modes, components, devices and speed, all through bytes.

    A motion profile's speed has steps of 2 mm/s, a brake effort steps of 0.4 %; the events are the very same.
    """
    in_process = driven(scenario, stack, 20.0)
    loopback = LoopbackNetwork()
    monkeypatch.setattr(building, "new_link_of", over_the_wire(loopback))
    by_wire = driven(scenario, stack, 20.0, loopback)

    assert by_wire.datagrams > 200 * len(by_wire.poses)
    assert by_wire.events == in_process.events
    assert {"safety_mode", "component_control", "ready_mode"} <= {kind for _, _, kind, _ in by_wire.events}
    assert by_wire.poses.keys() == in_process.poses.keys()
    for name, poses in by_wire.poses.items():
        other = in_process.poses[name]
        assert np.hypot(*(poses - other)[:, :2].T).max() < most_m, name
        assert np.abs(poses[:, 2] - other[:, 2]).max() < most_mps, name
    assert any(not np.array_equal(poses, in_process.poses[name]) for name, poses in by_wire.poses.items())
