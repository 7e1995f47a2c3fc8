"""What ruckig lets the cars of a run follow is what the kernel followed, at the end of each step."""

from __future__ import annotations

import numpy as np
import pytest

from tests.xgv_cosim.simulation.bare_world import Car, injection, simulation
from xgv_cosim import kernel
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers.checking import profile_axes
from xgv_cosim.fleet_columns import Reference
from xgv_cosim.injection import InjectionKind

BOUND = {"speed_mps": 1e-9, "accel_mps2": 1e-8, "curvature_per_m": 1e-10, "curvature_rate_per_m_s": 1e-9}
"""Of ruckig's reference and the closed form, tick by tick from the same start to the end of a step."""


def test_ruckig_equals_the_closed_form_at_the_end_of_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """With every target changed in every step, edges inside the steps, stops, and starts from standstill."""
    worst, num_compared = dict.fromkeys(Reference._fields, 0.0), 0
    settled = kernel.settled

    def compared(before, motion, followed, limited, wanted, gear_wanted, ticks):  # type: ignore[no-untyped-def]
        nonlocal num_compared
        speed, curvature = profile_axes(wanted)
        num_compared += int(speed.sum() + curvature.sum())
        axes = (speed, speed & np.isfinite(wanted.jerk_limit_mps3), curvature, curvature)
        for name, axis in zip(Reference._fields, axes, strict=True):
            difference = np.abs(getattr(followed, name) - getattr(limited, name))[axis]
            worst[name] = max(worst[name], difference.max(initial=0.0))
        return settled(before, motion, followed, limited, wanted, gear_wanted, ticks)

    monkeypatch.setattr(kernel, "settled", compared)
    cars = {f"car_{number}": Car(3.0 * number, x_m=100.0 * number) for number in range(8)}
    stops = [
        injection(203, InjectionKind.DOOR, "car_3", end_tick=417),
        injection(331, InjectionKind.ESTOP_PAUSE, "car_5", "car_6", end_tick=502),
    ]
    run, rng = simulation(cars, stops), np.random.default_rng(1)
    run.run_until(1.0)
    command, slots = run.fleet.command, run.fleet.bound
    for _ in range(80):
        run.renew_motions(slots, rng.uniform(0.0, 30.0, 8), rng.uniform(-0.01, 0.01, 8), 60.0)
        command.max_curvature_rate_per_m_s[slots] = rng.uniform(0.01, 0.3, 8)
        run.step()
    assert (command.kind[slots] == CommandKind.MOTION_PROFILE).any()
    assert num_compared > 1000
    assert {name: value for name, value in worst.items() if value > BOUND[name]} == {}
