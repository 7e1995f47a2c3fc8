"""Vehicle parameters: one vehicle's values with units, and the same as columns for the fleet."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from xgv_cosim.columns import FloatColumn


@dataclass(frozen=True, slots=True)
class VehicleParameters:
    """One vehicle's geometry, actuators, road load and controllers.

    The defaults are the preset ``ford_escape_hybrid``; ``presets/ford_escape_hybrid.yaml`` gives the
    source of each value or says that it is assumed.
    """

    wheelbase_m: float = 2.619
    front_overhang_m: float = 0.9
    mass_kg: float = 1900.0


class ParameterColumns(NamedTuple):
    """``VehicleParameters`` of each slot, field by field; every column has shape ``(num_slots,)``."""

    wheelbase_m: FloatColumn
    front_overhang_m: FloatColumn
    mass_kg: FloatColumn


def parameter_columns(parameters: VehicleParameters, num_slots: int) -> ParameterColumns:
    """Return columns that hold ``parameters`` in every slot."""
    return ParameterColumns(
        *(np.full(num_slots, float(getattr(parameters, field.name))) for field in fields(parameters))
    )
