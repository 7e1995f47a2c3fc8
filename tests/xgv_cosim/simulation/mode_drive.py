"""One vehicle driven through commands and axis modes as the simulation's loop does, tick by tick."""

from __future__ import annotations

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.commands import CommandKind
from xgv_cosim.controllers.references import ReferenceGenerator
from xgv_cosim.fleet import Fleet
from xgv_cosim.fleet_columns import Motion, Reference
from xgv_cosim.simulation import setpoints


class ModeDrive:
    """Slot 0 of a fleet; a record of every tick."""

    def __init__(self, speed_mps: float = 0.0, **parameters: float) -> None:
        self.fleet = Fleet()
        self.generator = ReferenceGenerator()
        for name, value in parameters.items():
            getattr(self.fleet.parameters, name)[0] = value
        self.fleet.motion.speed_mps[0] = self.fleet.reference.speed_mps[0] = speed_mps
        self.fleet.longitudinal[0], self.fleet.lateral[0] = Longitudinal.CLOSED_LOOP, Lateral.CLOSED_LOOP
        self.motions: list[Motion] = [self.fleet.motion]
        self.references: list[Reference] = [self.fleet.reference]

    def command(
        self, speed_mps: float, accel_mps2: float = 2.0, curvature_per_m: float = 0.0, rate: float = 0.1
    ) -> ModeDrive:
        cells = self.fleet.command
        cells.kind[0] = CommandKind.MOTION_PROFILE
        cells.speed_mps[0], cells.max_accel_mps2[0] = speed_mps, accel_mps2
        cells.curvature_per_m[0], cells.max_curvature_rate_per_m_s[0] = curvature_per_m, rate
        return self

    def wrench(self, throttle: float = 0.0, brake: float = 0.0, steering: float = 0.0) -> ModeDrive:
        cells = self.fleet.command
        cells.kind[0] = CommandKind.WRENCH_EFFORT
        cells.throttle[0], cells.brake[0], cells.steering[0] = throttle, brake, steering
        return self

    def enter(self, longitudinal: Longitudinal, lateral: Lateral) -> ModeDrive:
        fleet, here = self.fleet, np.arange(self.fleet.num_slots) == 0
        fleet.reference = setpoints.seeded_references(
            fleet.reference,
            fleet.motion,
            fleet.parameters,
            here & (fleet.longitudinal != longitudinal),
            here & (fleet.lateral != lateral),
        )
        modes = fleet.longitudinal.copy()
        modes[0] = longitudinal
        fleet.engine_on = fleet.engine_on | setpoints.started_by_driver(fleet, modes)
        fleet.longitudinal[0], fleet.lateral[0] = longitudinal, lateral
        return self

    def for_s(self, duration_s: float, ticks: int = 1) -> ModeDrive:
        """Drive on, some ticks at a time; the record starts anew."""
        fleet = self.fleet
        self.motions, self.references = [fleet.motion], [fleet.reference]
        for _ in range(round(duration_s / CONTROL_TICK_S / ticks)):
            wanted = setpoints.setpoints_of(fleet)
            limited, failed = self.generator.advance(fleet.reference, wanted, ticks * CONTROL_TICK_S)
            assert not failed.any()
            motion, followed = kernel.advance(fleet.motion, fleet.reference, wanted, fleet.parameters, ticks)
            driven = kernel.settled(fleet.motion, motion, followed, limited, wanted, fleet.gear_wanted, ticks)
            fleet.motion, fleet.reference, fleet.gear_wanted = motion, driven.reference, driven.gear_wanted
            self.motions.append(fleet.motion)
            self.references.append(fleet.reference)
        return self

    def column(self, name: str) -> np.ndarray:
        return np.array([getattr(motion, name)[0] for motion in self.motions])

    def wanted(self, name: str) -> np.ndarray:
        return np.array([getattr(reference, name)[0] for reference in self.references])
