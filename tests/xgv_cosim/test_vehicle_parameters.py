"""The preset file, the dataclass defaults and the columns are one list of parameters."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.parameters import (
    ParameterColumns,
    VehicleParameters,
    checked_preset,
    load_preset,
    parameter_columns,
    preset_names,
    read_preset,
)

NAMES = tuple(field.name for field in dataclasses.fields(VehicleParameters))


def test_defaults_columns_and_preset_file_hold_the_same_parameters_in_the_same_order() -> None:
    assert ParameterColumns._fields == NAMES
    assert tuple(read_preset("ford_escape_hybrid")) == NAMES
    assert load_preset("ford_escape_hybrid") == VehicleParameters()


def test_every_value_has_a_unit_and_a_source_or_is_called_assumed() -> None:
    for name, entry in read_preset("ford_escape_hybrid").items():
        assert set(entry) in ({"value", "unit", "source"}, {"value", "unit", "assumed", "why"}), name
        assert all(value for key, value in entry.items() if key != "value"), name


def test_a_source_names_its_publisher_and_another_cars_number_is_an_assumption() -> None:
    entries = read_preset("ford_escape_hybrid")
    publishers = ("rhwood.blogspot.com", "Edmunds", "CommonRoad", "dry air at")
    for name, entry in entries.items():
        if "source" in entry:
            assert any(publisher in str(entry["source"]) for publisher in publishers), name
    assert all(entries[name]["assumed"] for name in ("front_track_m", "rear_track_m", "front_overhang_m"))
    assert "2005 Escape" in str(entries["rear_track_m"]["why"])


def test_the_unit_in_the_name_is_the_unit_in_the_file() -> None:
    units = {
        "m": "m", "s": "s", "kg": "kg", "rad": "rad", "n": "N", "w": "W", "m2": "m^2",
        "mps": "m/s", "mps2": "m/s^2", "mps3": "m/s^3", "rad_s": "rad/s", "s2_per_m": "s^2/m",
        "rad_s2_per_m": "rad s^2/m", "per_m": "1/m", "per_m_s": "1/(m s)", "per_m_s2": "1/(m s^2)",
        "per_s": "1/s", "per_s2": "1/s^2", "kg_per_m3": "kg/m^3",
    }  # fmt: skip
    unitless = set()
    for name, entry in read_preset("ford_escape_hybrid").items():
        endings = [ending for ending in units if name.endswith(f"_{ending}")]
        if endings:
            assert entry["unit"] == units[max(endings, key=len)], name
        else:
            unitless.add(name)
            assert entry["unit"] in {"1", "share", "0 or 1"}, name
    assert "mass_kg" not in unitless
    assert "friction" in unitless


def test_columns_repeat_the_vehicle_in_every_slot() -> None:
    columns = parameter_columns(VehicleParameters(mass_kg=1000.0), 3)
    assert columns.mass_kg.tolist() == [1000.0] * 3
    assert all(column.shape == (3,) and column.dtype == np.float64 for column in columns)


def test_an_unknown_preset_is_answered_with_those_there_are() -> None:
    assert preset_names() == ("ford_escape_hybrid",)
    with pytest.raises(ScenarioError, match=r"'odin'.*ford_escape_hybrid"):
        load_preset("odin")


def test_a_faulty_preset_is_answered_with_all_its_faults() -> None:
    entries = {name: dict(entry) for name, entry in read_preset("ford_escape_hybrid").items()}
    del entries["mass_kg"]
    del entries["friction"]["why"]
    entries["wheelbase_m"]["value"] = float("nan")
    entries["mas_kg"] = {"value": 1.0, "unit": "kg", "source": "a typing error"}
    with pytest.raises(ScenarioError) as caught:
        checked_preset("mine", entries)
    assert [problem.split(":")[0] for problem in caught.value.problems] == [
        "mass_kg",
        "wheelbase_m.value",
        "friction",
        "mas_kg",
    ]
    with pytest.raises(ScenarioError, match="mapping"):
        checked_preset("mine", None)
