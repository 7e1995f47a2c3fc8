"""Imperfections that a stack can see, off by default: what is measured of the speed, and drawn delays.

A draw is a hash of the vehicle's key and a counter, no state: so it follows from the vehicle's id, the seed
and the control tick alone, whoever else is bound and however often somebody looks.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, UInt64Column
    from xgv_cosim.parameters import ParameterColumns

_STEP, _FIRST, _SECOND = (
    np.uint64(number) for number in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
)
"""The constants of SplitMix64 (Steele, Lea, Flood, 2014)."""


def draw_key(vehicle_id: str, seed: int) -> int:
    """Return what all draws of a vehicle follow from, the same on every machine: 64 bits."""
    key = f"imperfections/{seed}".encode()[:64]
    return int.from_bytes(hashlib.blake2b(vehicle_id.encode(), digest_size=8, key=key).digest(), "big")


def uniform(keys: UInt64Column, counter: int) -> FloatColumn:
    """Return one draw for each key, at least 0 and less than 1: SplitMix64 of key and counter."""
    with np.errstate(over="ignore"):  # it counts modulo 2**64
        bits = keys + np.full(keys.shape, counter + 1, np.uint64) * _STEP
        bits = (bits ^ (bits >> np.uint64(30))) * _FIRST
        bits = (bits ^ (bits >> np.uint64(27))) * _SECOND
        bits ^= bits >> np.uint64(31)
    draws: FloatColumn = (bits >> np.uint64(11)) / 2.0**53
    return draws


def normal(keys: UInt64Column, counter: int) -> FloatColumn:
    """Return one draw for each key from the normal distribution (Box and Muller)."""
    radius = np.sqrt(-2.0 * np.log1p(-uniform(keys, 2 * counter)))
    wave: FloatColumn = radius * np.cos(2.0 * np.pi * uniform(keys, 2 * counter + 1))
    return wave


def measured_speed_mps(
    speed_mps: FloatColumn, parameters: ParameterColumns, keys: UInt64Column, tick: int
) -> FloatColumn:
    """Return the speeds as they are measured and reported at a control tick.

    At standstill exactly 0: wheels that stand give no pulses. The speed controller has a sensor of its
    own, without these imperfections.

    Args:
        speed_mps: What the cars do.
        parameters: Of each vehicle: ``speed_noise_mps`` and ``speed_quantum_mps``.
        keys: ``draw_key`` of each vehicle.
        tick: Control tick.
    """
    quantum, noise = parameters.speed_quantum_mps, parameters.speed_noise_mps
    if not (quantum.any() or noise.any()):
        return speed_mps
    speed = np.where(speed_mps == 0.0, 0.0, speed_mps + noise * normal(keys, tick))
    step = np.where(quantum > 0.0, quantum, 1.0)
    return np.where(quantum > 0.0, np.rint(speed / step) * step, speed)


def delay_s(latency_s: float, jitter_s: float, key: int, counter: int) -> float:
    """Return how long a message takes from its arrival until it acts; ``counter`` tells messages apart."""
    if jitter_s == 0.0:
        return latency_s
    return latency_s + jitter_s * float(uniform(np.array([key], np.uint64), counter)[0])
