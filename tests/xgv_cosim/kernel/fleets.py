"""Fleets, setpoints and a small closed loop for the tests of controllers, plant and kernel."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from xgv_cosim import kernel
from xgv_cosim.actuation import Gear, Lateral, Longitudinal
from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.controllers.references import ReferenceGenerator
from xgv_cosim.fleet_columns import Motion, Reference, Setpoints, idle_motion
from xgv_cosim.parameters import ParameterColumns, VehicleParameters, parameter_columns

DEFAULTS = {
    "longitudinal": Longitudinal.CLOSED_LOOP,
    "lateral": Lateral.CLOSED_LOOP,
    "target_speed_mps": 0.0,
    "accel_limit_mps2": 2.0,
    "decel_limit_mps2": 3.0,
    "jerk_limit_mps3": 4.0,
    "target_curvature_per_m": 0.0,
    "curvature_rate_limit_per_m_s": 0.1,
    "curvature_jerk_limit_per_m_s2": 1.0,
    "throttle": 0.0,
    "brake": 0.5,
    "steer_rad": 0.0,
    "gear_wanted": Gear.DRIVE,
    "engine_on": True,
    "parking_brake": False,
    "brake_authority": 1.0,
    "lost_functions": 0,
}
KINDS = {
    "longitudinal": np.uint8,
    "lateral": np.uint8,
    "gear_wanted": np.uint8,
    "engine_on": np.bool_,
    "parking_brake": np.bool_,
    "lost_functions": np.uint8,
}


def setpoints(num_slots: int = 1, **given: float) -> Setpoints:
    """Return the same setpoints in every slot."""
    values = {**DEFAULTS, **given}
    assert values.keys() == set(Setpoints._fields)
    return Setpoints(
        *(np.full(num_slots, values[name], KINDS.get(name, np.float64)) for name in Setpoints._fields)
    )


def at_rest(num_slots: int = 1) -> tuple[Motion, Reference]:
    return (
        idle_motion(num_slots),
        Reference(*(np.zeros(num_slots) for _ in Reference._fields)),
    )


def driving(speed_mps: float, num_slots: int = 1) -> tuple[Motion, Reference]:
    motion, reference = at_rest(num_slots)
    motion.speed_mps[:] = speed_mps
    reference.speed_mps[:] = speed_mps
    return motion, reference


def random_fleet(
    rng: np.random.Generator, num_slots: int
) -> tuple[Motion, Reference, Setpoints, ParameterColumns]:
    """Return vehicles in all modes and states, tame and wild, with some limits 0, infinite or NaN."""

    def pick(*choices: float) -> np.ndarray:
        return rng.choice(np.array(choices), num_slots)

    speed = np.where(
        rng.random(num_slots) < 0.3, pick(0.0, 0.02, 0.3, -0.02, -3.0), rng.uniform(0.0, 35.0, num_slots)
    )
    curvature = rng.uniform(-0.02, 0.02, num_slots)
    motion = Motion(
        x_m=rng.uniform(-1e3, 1e3, num_slots),
        y_m=rng.uniform(-1e3, 1e3, num_slots),
        heading_rad=rng.uniform(-4.0, 4.0, num_slots),
        speed_mps=speed,
        accel_mps2=rng.uniform(-6.0, 3.0, num_slots),
        curvature_per_m=curvature,
        steer_rad=rng.uniform(-0.3, 0.3, num_slots),
        throttle=pick(0.0, 0.1, 0.7, 1.0),
        brake=pick(0.0, 0.004, 0.3, 1.0),
        speed_error_integral_m=rng.uniform(-0.5, 0.5, num_slots),
        travelled_m=rng.uniform(0.0, 3.0, num_slots),
        gear=rng.choice(np.array(Gear, np.uint8), num_slots),
        shift_s=pick(0.0, 0.3, 0.7, 1.45),
        grip_limited_s=pick(0.0, 0.4, 2.0),
        grip_free_s=pick(0.0, 0.3, 100.0),
    )
    reference = Reference(
        speed + rng.uniform(-1.0, 1.0, num_slots) * pick(0.0, 1.0),
        rng.uniform(-4.0, 4.0, num_slots),
        curvature,
        rng.uniform(-0.3, 0.3, num_slots),
    )
    wanted = Setpoints(
        longitudinal=rng.choice(np.array(Longitudinal, np.uint8), num_slots),
        lateral=rng.choice(np.array(Lateral, np.uint8), num_slots),
        target_speed_mps=np.where(rng.random(num_slots) < 0.3, 0.0, rng.uniform(-5.0, 35.0, num_slots)),
        accel_limit_mps2=pick(0.0, 0.5, 2.0, 3.0, 50.0, np.nan),
        decel_limit_mps2=pick(0.0, 0.5, 2.5, 6.0, 50.0, np.inf),
        jerk_limit_mps3=pick(0.5, 4.0, 10.0, np.inf),
        target_curvature_per_m=rng.uniform(-0.1, 0.1, num_slots),
        curvature_rate_limit_per_m_s=pick(0.0, 0.05, 0.15, 5.0),
        curvature_jerk_limit_per_m_s2=pick(0.5, 1.5, np.inf),
        throttle=pick(0.0, 0.01, 0.4, 1.0, 3.0, np.nan),
        brake=pick(0.0, 0.2, 0.5, 1.0, -1.0, np.nan),
        steer_rad=pick(-2.0, -0.1, 0.0, 0.3, np.nan),
        gear_wanted=rng.choice(np.array(Gear, np.uint8), num_slots),
        engine_on=rng.random(num_slots) < 0.8,
        parking_brake=rng.random(num_slots) < 0.2,
        brake_authority=pick(1.0, 1.0, 0.4, 0.0, np.nan),
        lost_functions=np.where(rng.random(num_slots) < 0.6, 0, rng.integers(0, 16, num_slots)).astype(
            np.uint8
        ),
    )
    columns = parameter_columns(VehicleParameters(), num_slots)
    spread = rng.uniform(0.8, 1.25, (len(columns), num_slots))
    parameters = ParameterColumns(*(column * factor for column, factor in zip(columns, spread, strict=True)))
    released = pick(0.0, 1.0)
    return (
        motion,
        reference,
        wanted,
        parameters._replace(
            released_steering_self_aligns=released,
            grade=pick(0.0, 0.0, 0.1, -0.2),
            steer_backlash_rad=pick(0.0, 0.02),
        ),
    )


def merged(limited: Reference, followed: Reference, wanted: Setpoints, motion: Motion) -> Reference:
    """Return the references with which the next step begins."""
    return kernel.settled(motion, motion, followed, limited, wanted, motion.gear, 1).reference


@dataclass
class Drive:
    """One vehicle driven as the simulation drives it, with a record of every tick."""

    motion: Motion
    reference: Reference
    vehicle: VehicleParameters = field(default_factory=VehicleParameters)
    generator: ReferenceGenerator = field(default_factory=ReferenceGenerator)
    motions: list[Motion] = field(default_factory=list)
    references: list[Reference] = field(default_factory=list)

    @classmethod
    def at(cls, speed_mps: float, **parameters: float) -> Drive:
        motion, reference = driving(speed_mps)
        if speed_mps < 0.0:
            motion.gear[:] = Gear.REVERSE
        return cls(motion, reference, replace(VehicleParameters(), **parameters))

    def for_s(self, duration_s: float, ticks: int = 1, **given: float) -> Drive:
        """Drive on with some setpoints, some ticks at a time; the record starts anew."""
        wanted = setpoints(1, **{"gear_wanted": self.motion.gear[0], **given})
        columns = parameter_columns(self.vehicle, 1)
        self.motion = self.motion._replace(travelled_m=np.zeros(1))
        self.motions, self.references = [self.motion], [self.reference]
        for _ in range(round(duration_s / CONTROL_TICK_S / ticks)):
            generated, failed = self.generator.advance(self.reference, wanted, ticks * CONTROL_TICK_S)
            assert not failed.any()
            motion, followed = kernel.advance(self.motion, self.reference, wanted, columns, ticks)
            self.reference = merged(generated, followed, wanted, motion)
            self.motion = motion
            self.motions.append(self.motion)
            self.references.append(self.reference)
        return self

    def column(self, name: str) -> np.ndarray:
        """Return one quantity of the motion over time, the start included."""
        return np.array([getattr(motion, name)[0] for motion in self.motions])

    def wanted(self, name: str) -> np.ndarray:
        """Return one quantity of the reference over time, the start included."""
        return np.array([getattr(reference, name)[0] for reference in self.references])
