"""``docs/run-folder.md`` lists every column and every file with the unit and scale that the code has."""

from __future__ import annotations

from pathlib import Path

import pytest

from xgv_cosim.recording import folder
from xgv_cosim.recording.quantities import BOUND_VEHICLES, EVERY_VEHICLE, Quantity

PAGE = (Path(__file__).parents[3] / "docs" / "run-folder.md").read_text(encoding="utf-8")


TRAJECTORY = PAGE[PAGE.index("## `trajectory.parquet`") : PAGE.index("## `road.json`")]


@pytest.mark.parametrize("quantity", [*EVERY_VEHICLE, *BOUND_VEHICLES], ids=lambda quantity: quantity.name)
def test_each_column_is_described_with_its_scale(quantity: Quantity) -> None:
    row = next(
        (line for line in TRAJECTORY.splitlines() if line.startswith("|") and f"`{quantity.name}`" in line),
        "",
    )
    assert row, f"{quantity.name} is not on the page"
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    scales = {float(scale) for scale in cells[2].split(",")}
    assert quantity.scale in scales
    assert quantity.unit.replace("2", "²") in cells[1] or not quantity.unit


@pytest.mark.parametrize(
    "name",
    [folder.EVENTS, folder.TRACE, folder.TRAJECTORY, folder.ROAD, folder.RESULT, folder.LOCK, folder.REPORT],
)
def test_each_file_is_described(name: str) -> None:
    assert f"| `{name}` |" in PAGE
