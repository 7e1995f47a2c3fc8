"""Vehicle parameters: one vehicle's values with units, and the same as columns for the fleet."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.errors import ScenarioError

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatColumn, FloatMatrix

DEFAULT_PRESET = "ford_escape_hybrid"
GRAVITY_MPS2 = 9.81
"""Of the plant and of every metric that is held against it."""


@dataclass(frozen=True, slots=True)
class VehicleParameters:
    """One vehicle's geometry, actuators, road load and controllers.

    The defaults are the preset ``ford_escape_hybrid``; ``presets/ford_escape_hybrid.yaml`` gives the
    source of each value or says that it is assumed.
    """

    # Geometry
    wheelbase_m: float = 2.619
    """Distance of the axles."""
    front_overhang_m: float = 0.9
    """Front axle to front bumper."""
    front_track_m: float = 1.557
    """Distance of the front wheels."""
    rear_track_m: float = 1.547
    """Distance of the rear wheels."""
    mass_kg: float = 1900.0
    """Mass with the drive-by-wire kit and a rider."""
    # Limits of the vehicle
    max_curvature_per_m: float = 0.24
    """Greatest path curvature of the rear axle."""
    max_curvature_rate_per_m_s: float = 0.15
    """Greatest rate of change of curvature that the steering can follow."""
    max_curvature_jerk_per_m_s2: float = 1.5
    """Greatest change of the curvature rate in profiles."""
    max_accel_mps2: float = 3.2
    """Greatest acceleration from standstill."""
    max_decel_mps2: float = 8.0
    """Greatest deceleration that closed-loop speed control asks for."""
    max_jerk_mps3: float = 10.0
    """Greatest jerk of closed-loop speed profiles."""
    # Drive
    throttle_dead_band: float = 0.02
    """Throttle share without effect."""
    throttle_lag_s: float = 0.3
    """Time constant of the driving force."""
    max_drive_force_n: float = 6200.0
    """Greatest driving force at the wheels."""
    max_drive_power_w: float = 105000.0
    """Greatest driving power at the wheels."""
    creep_accel_mps2: float = 0.3
    """Acceleration in gear at standstill with both pedals released."""
    creep_speed_mps: float = 2.0
    """Speed at which creep has faded to nothing."""
    low_engine_braking_mps2: float = 0.9
    """Deceleration in low gear with the throttle released."""
    low_speed_cap_mps: float = 15.0
    """Speed above which low gear gives no drive."""
    # Gear selector
    shift_speed_mps: float = 0.1
    """Speed below which the gear may change."""
    shift_brake: float = 0.1
    """Brake effort above which the gear may change, share 0 to 1."""
    shift_standstill_s: float = 0.5
    """Time at standstill, braked, before a change of gear begins."""
    shift_delay_s: float = 1.0
    """Time that a change of gear takes."""
    # Brake and tyres
    brake_lag_s: float = 0.12
    """Time constant of the brake effort."""
    max_brake_decel_mps2: float = 8.4
    """Deceleration at 100 % brake effort on unlimited grip."""
    unassisted_brake_share: float = 0.4
    """Share of its deceleration that a brake effort gives without the assistance of the engine."""
    parking_brake_decel_mps2: float = 2.0
    """What the parking brake, set, gives against motion: it holds a 20 % grade."""
    friction: float = 0.85
    """Coefficient of friction between tyre and road."""
    min_lateral_grip: float = 0.3
    """Share of the grip that steering keeps under any braking."""
    # Road load
    rolling_resistance: float = 0.01
    """Coefficient of rolling resistance."""
    drag_area_m2: float = 1.13
    """Drag coefficient times frontal area."""
    air_density_kg_per_m3: float = 1.2
    """Density of air."""
    grade: float = 0.0
    """Rise of the road per distance in the vehicle's heading: positive uphill."""
    # Steering
    max_steer_rad: float = 0.57
    """Greatest road-wheel angle."""
    max_steer_rate_rad_s: float = 0.4
    """Greatest rate of the road-wheel angle."""
    steer_lag_s: float = 0.1
    """Time constant of the road-wheel angle."""
    understeer_rad_s2_per_m: float = 0.0025
    """Further road-wheel angle per lateral acceleration."""
    yaw_lag_s2_per_m: float = 0.01
    """Time constant of the curvature per speed."""
    released_steering_self_aligns: float = 1.0
    """1: a released wheel turns back while the car rolls. 0: it stays."""
    self_align_distance_m: float = 5.0
    """Way in which a released wheel angle falls to 1/e."""
    # Controllers
    speed_gain_per_s: float = 1.6
    """Proportional gain of the speed controller."""
    speed_integral_gain_per_s2: float = 0.4
    """Integral gain of the speed controller."""
    speed_response_s: float = 0.06
    """Time constant with which acceleration follows the demand, pedal lags compensated."""
    pedal_band_mps2: float = 0.15
    """Demand below which the other pedal is not yet taken."""
    standstill_brake: float = 0.25
    """Brake effort with which closed-loop control holds a standstill."""
    # Imperfections, off by default (``bind.plant.imperfections``)
    steer_backlash_rad: float = 0.0
    """Play of the steering: so far its command may turn back and forth before the road wheel follows."""
    speed_quantum_mps: float = 0.0
    """Step in which speed is measured, 0: continuously."""
    speed_noise_mps: float = 0.0
    """Standard deviation of the measured speed while the car rolls."""
    command_latency_s: float = 0.0
    """Time from a message's arrival at the vehicle until it acts."""
    command_jitter_s: float = 0.0
    """Up to this much longer, drawn for each message."""


class ParameterColumns(NamedTuple):
    """``VehicleParameters`` of each slot, field by field; every column has shape ``(num_slots,)``."""

    wheelbase_m: FloatColumn
    front_overhang_m: FloatColumn
    front_track_m: FloatColumn
    rear_track_m: FloatColumn
    mass_kg: FloatColumn
    max_curvature_per_m: FloatColumn
    max_curvature_rate_per_m_s: FloatColumn
    max_curvature_jerk_per_m_s2: FloatColumn
    max_accel_mps2: FloatColumn
    max_decel_mps2: FloatColumn
    max_jerk_mps3: FloatColumn
    throttle_dead_band: FloatColumn
    throttle_lag_s: FloatColumn
    max_drive_force_n: FloatColumn
    max_drive_power_w: FloatColumn
    creep_accel_mps2: FloatColumn
    creep_speed_mps: FloatColumn
    low_engine_braking_mps2: FloatColumn
    low_speed_cap_mps: FloatColumn
    shift_speed_mps: FloatColumn
    shift_brake: FloatColumn
    shift_standstill_s: FloatColumn
    shift_delay_s: FloatColumn
    brake_lag_s: FloatColumn
    max_brake_decel_mps2: FloatColumn
    unassisted_brake_share: FloatColumn
    parking_brake_decel_mps2: FloatColumn
    friction: FloatColumn
    min_lateral_grip: FloatColumn
    rolling_resistance: FloatColumn
    drag_area_m2: FloatColumn
    air_density_kg_per_m3: FloatColumn
    grade: FloatColumn
    max_steer_rad: FloatColumn
    max_steer_rate_rad_s: FloatColumn
    steer_lag_s: FloatColumn
    understeer_rad_s2_per_m: FloatColumn
    yaw_lag_s2_per_m: FloatColumn
    released_steering_self_aligns: FloatColumn
    self_align_distance_m: FloatColumn
    speed_gain_per_s: FloatColumn
    speed_integral_gain_per_s2: FloatColumn
    speed_response_s: FloatColumn
    pedal_band_mps2: FloatColumn
    standstill_brake: FloatColumn
    steer_backlash_rad: FloatColumn
    speed_quantum_mps: FloatColumn
    speed_noise_mps: FloatColumn
    command_latency_s: FloatColumn
    command_jitter_s: FloatColumn


def parameter_columns(parameters: VehicleParameters, num_slots: int) -> ParameterColumns:
    """Return columns that hold ``parameters`` in every slot."""
    row = [float(getattr(parameters, field.name)) for field in fields(parameters)]
    return parameters_in(np.tile(row, (num_slots, 1)))


class ParameterTable(ParameterColumns):
    """Parameters whose columns are those of one table, which compiled code takes as a whole."""

    table: FloatMatrix | None = None
    """Shape ``(num_slots, 50)``: the columns in their order."""


def parameters_in(table: FloatMatrix) -> ParameterColumns:
    """Return the parameters whose columns are those of a table, as views."""
    parameters = ParameterTable(*table.T)
    parameters.table = table
    return parameters


def parameter_table(parameters: ParameterColumns) -> FloatMatrix:
    """Return the table of parameters, a new one if their columns are not those of a table."""
    if isinstance(parameters, ParameterTable) and parameters.table is not None:
        return parameters.table
    return np.ascontiguousarray(np.array(parameters, np.float64).T)


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets that come with the package, sorted."""
    folder = files("xgv_cosim").joinpath("presets")
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in folder.iterdir() if entry.name.endswith(".yaml"))
    )


def load_preset(name: str = DEFAULT_PRESET) -> VehicleParameters:
    """Return the parameters of a preset.

    Raises:
        ScenarioError: There is no such preset, or its file is not complete and well formed.
    """
    return VehicleParameters(**{field: float(entry["value"]) for field, entry in read_preset(name).items()})


def read_preset(name: str) -> dict[str, dict[str, float | str | bool]]:
    """Return a preset as written: ``value``, ``unit``, and ``source`` or ``assumed`` with ``why``, by name.

    Raises:
        ScenarioError: As for ``load_preset``.
    """
    from ruamel.yaml import YAML  # noqa: PLC0415 - only scenarios that load a preset pay for it
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    if name not in preset_names():
        raise ScenarioError(f"preset: got {name!r}, expected one of {', '.join(preset_names())}")
    text = files("xgv_cosim").joinpath("presets", f"{name}.yaml").read_text(encoding="utf-8")
    try:
        entries = YAML(typ="safe").load(text)
    except YAMLError as error:
        raise ScenarioError(f"preset {name!r} is not valid YAML: {error}") from error
    return checked_preset(name, entries)


def checked_preset(name: str, entries: object) -> dict[str, dict[str, float | str | bool]]:
    """Return the entries of a preset file if they are complete and well formed.

    Raises:
        ScenarioError: They are not; ``problems`` has one line for each fault.
    """
    if not isinstance(entries, dict):
        raise ScenarioError(
            f"preset {name!r}: expected a mapping of parameters, got {type(entries).__name__}"
        )
    expected = [field.name for field in fields(VehicleParameters)]
    problems = [f"{missing}: missing" for missing in expected if missing not in entries]
    for key, entry in entries.items():
        if key not in expected:
            problems.append(f"{key}: no such parameter")
        elif not isinstance(entry, dict) or not _is_finite_number(entry.get("value")):
            problems.append(f"{key}.value: expected a finite number")
        elif not entry.get("unit") or not (
            entry.get("source") or (entry.get("assumed") and entry.get("why"))
        ):
            problems.append(f"{key}: expected a unit, and a source or 'assumed: true' with why")
    if problems:
        raise ScenarioError(f"preset {name!r}:", tuple(problems))
    return {key: entries[key] for key in expected}


def _is_finite_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
