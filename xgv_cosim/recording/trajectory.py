"""``trajectory.parquet``: written once at the end, read back in SI units.

pyarrow is imported inside the functions: it is large, and it must stay out of the simulation's step. Columns
are made of buffers and read from them: ``pyarrow.array``, ``fill_null`` and ``read_table`` import pandas too,
wherever it is installed, which costs as much as all the rest.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xgv_cosim.columns import BoolColumn, FloatColumn, IntColumn
from xgv_cosim.errors import ReplayError
from xgv_cosim.recording.buffer import TrajectoryBuffer
from xgv_cosim.recording.quantities import BOUND_VEHICLES, EVERY_VEHICLE, NULL, TRAJECTORY_SCHEMA, dequantise

_DICTIONARIES = ("vehicle", "vehicle_type", "lane")


def trajectory_file(
    buffer: TrajectoryBuffer, lane_ids: tuple[str, ...], safety_mode_names: Mapping[int, str]
) -> bytes:
    """Return the content of ``trajectory.parquet``: rows sorted by vehicle, then by time."""
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring
    import pyarrow.parquet as pq  # noqa: PLC0415

    every = buffer.every.columns
    order = np.argsort(every[0], kind="stable")  # rows came in the order of time
    bound = np.full((1 + len(BOUND_VEHICLES), every.shape[1]), NULL, np.int32)
    bound[0] = 0
    recorded = buffer.bound.columns
    bound[0, recorded[0]] = 1
    bound[1:, recorded[0]] = recorded[1:]

    lanes, lane_numbers = np.unique(every[2][order], return_inverse=True)
    fields: list[Any] = []
    columns: list[Any] = []

    def add(name: str, column: Any, unit: str, scale: float, meaning: str) -> None:  # noqa: ANN401 - pyarrow has no types
        fields.append(
            pa.field(name, column.type, metadata={"unit": unit, "scale": repr(scale), "meaning": meaning})
        )
        columns.append(column)

    def add_names(
        name: str,
        numbers: npt.NDArray[Any],
        names: tuple[str, ...],
        meaning: str,
        mask: BoolColumn | None = None,
    ) -> None:
        indices = _integers(numbers, mask)
        add(
            name,
            pa.DictionaryArray.from_arrays(indices, _strings(names)),
            "",
            1.0,
            meaning,
        )

    add_names("vehicle", every[0][order], buffer.vehicles.names, "vehicle id")
    add_names("vehicle_type", every[1][order], buffer.types.names, "the world's vehicle type")
    on_road = lanes[lanes >= 0]
    names = tuple(_lane_name(int(lane), lane_ids) for lane in on_road)
    numbers = lane_numbers.astype(np.int64) - (len(lanes) - len(on_road))
    add_names("lane", np.maximum(numbers, 0), names, "lane id; null off-road", numbers < 0)
    is_bound = _booleans(bound[0][order] == 1)
    add("bound", is_bound, "", 1.0, "true while the vehicle is bound to an emulated one")
    for index, quantity in enumerate((*EVERY_VEHICLE, *BOUND_VEHICLES)):
        source = every[3 + index] if index < len(EVERY_VEHICLE) else bound[1 + index - len(EVERY_VEHICLE)]
        values = source[order]
        add(
            quantity.name,
            _integers(values, values == NULL),
            quantity.unit,
            quantity.scale,
            quantity.meaning,
        )

    metadata = {
        "schema": TRAJECTORY_SCHEMA,
        "frame": "east-north-up; heading counter-clockwise from east",
        "sorted_by": "vehicle, tick",
        "safety_mode_names": json.dumps(
            {str(code): name for code, name in sorted(safety_mode_names.items())}
        ),
    }
    table = pa.table(columns, schema=pa.schema(fields, metadata=metadata))
    sink = pa.BufferOutputStream()
    pq.write_table(
        table,
        sink,
        compression="zstd",
        use_dictionary=list(_DICTIONARIES),
        column_encoding={q.name: "DELTA_BINARY_PACKED" for q in (*EVERY_VEHICLE, *BOUND_VEHICLES)},
    )
    content: bytes = sink.getvalue().to_pybytes()
    return content


def _integers(values: npt.NDArray[Any], mask: BoolColumn | None) -> Any:  # noqa: ANN401 - pyarrow has no types
    """Return a column of 32-bit integers, null where ``mask`` is true."""
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring

    valid = None if mask is None else _bits(~mask)
    whole = np.ascontiguousarray(values, np.int32)
    return pa.Array.from_buffers(pa.int32(), len(whole), [valid, pa.py_buffer(whole)])


def _strings(values: tuple[str, ...]) -> Any:  # noqa: ANN401 - pyarrow has no types
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring

    texts = [value.encode() for value in values]
    ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(texts)))


def _booleans(values: BoolColumn) -> Any:  # noqa: ANN401 - pyarrow has no types
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring

    return pa.Array.from_buffers(pa.bool_(), len(values), [None, _bits(values)])


def _bits(values: BoolColumn) -> Any:  # noqa: ANN401 - pyarrow has no types
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring

    return pa.py_buffer(np.packbits(values, bitorder="little"))


def _lane_name(lane: int, lane_ids: tuple[str, ...]) -> str:
    return lane_ids[lane] if lane < len(lane_ids) else str(lane)


@dataclass(frozen=True, slots=True)
class Trajectory:
    """The trajectories of a run in SI units, rows sorted by vehicle and then by time."""

    vehicle_ids: tuple[str, ...]
    vehicle: IntColumn
    """Number of each row's vehicle in ``vehicle_ids``."""
    vehicle_types: tuple[str, ...]
    vehicle_type: IntColumn
    """Number of each row's type in ``vehicle_types``."""
    lane_ids: tuple[str, ...]
    lane: IntColumn
    """Number of each row's lane in ``lane_ids``, -1 off-road."""
    bound: BoolColumn
    time_s: FloatColumn
    values: Mapping[str, FloatColumn]
    """Every column of ``docs/run-folder.md`` by name, in its unit; NaN stands for null."""
    safety_mode_names: Mapping[int, str]
    rows_of: Mapping[str, slice] = field(default_factory=dict)
    """The rows of each vehicle."""

    def __getitem__(self, name: str) -> FloatColumn:
        return self.values[name]

    @property
    def num_rows(self) -> int:
        """Return the number of rows: vehicles times steps."""
        return len(self.vehicle)


def read_trajectory(path: Path) -> Trajectory:
    """Return the trajectories of a run folder's ``trajectory.parquet``.

    Raises:
        ReplayError: The file is missing, unreadable or of another schema.
    """
    import pyarrow as pa  # noqa: PLC0415 - see the module's docstring
    import pyarrow.parquet as pq  # noqa: PLC0415

    try:
        with pq.ParquetFile(path) as file:
            table = file.read()
    except (OSError, pa.ArrowInvalid) as error:
        raise ReplayError(f"{path}: cannot read the trajectories: {error}") from error
    metadata = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    if metadata.get("schema") != TRAJECTORY_SCHEMA:
        got = metadata.get("schema")
        raise ReplayError(f"{path}: got schema {got!r}, expected {TRAJECTORY_SCHEMA!r}")

    table = table.unify_dictionaries().combine_chunks()
    names: dict[str, tuple[str, ...]] = {}
    numbers: dict[str, IntColumn] = {}
    for name in _DICTIONARIES:
        column = table.column(name)
        if column.num_chunks == 0:
            names[name], numbers[name] = (), np.zeros(0, np.int64)
            continue
        names[name] = tuple(column.chunk(0).dictionary.to_pylist())
        numbers[name] = _read_integers(column.chunk(0).indices, -1)
    values = {}
    for position, quantity in enumerate(table.schema):
        if quantity.name not in (*_DICTIONARIES, "bound"):
            chunks = [_read_integers(chunk, NULL) for chunk in table.column(position).chunks]
            whole = np.concatenate([np.zeros(0, np.int64), *chunks])
            values[quantity.name] = dequantise(whole, float(quantity.metadata[b"scale"]))
    vehicle = numbers["vehicle"]
    starts = np.searchsorted(vehicle, np.arange(len(names["vehicle"]) + 1))
    return Trajectory(
        vehicle_ids=names["vehicle"],
        vehicle=vehicle,
        vehicle_types=names["vehicle_type"],
        vehicle_type=numbers["vehicle_type"],
        lane_ids=names["lane"],
        lane=numbers["lane"],
        bound=np.concatenate(
            [np.zeros(0, np.bool_), *(_read_bits(chunk, 1) for chunk in table.column("bound").chunks)]
        ),
        time_s=values["tick"],
        values=values,
        safety_mode_names={int(c): n for c, n in json.loads(metadata["safety_mode_names"]).items()},
        rows_of={n: slice(int(starts[i]), int(starts[i + 1])) for i, n in enumerate(names["vehicle"])},
    )


def _read_integers(array: Any, null: int) -> IntColumn:  # noqa: ANN401 - pyarrow has no types
    """Return a column of integers with ``null`` in the place of nulls."""
    begin, end = array.offset, array.offset + len(array)
    if not len(array):
        return np.zeros(0, np.int64)
    whole = np.frombuffer(array.buffers()[1], np.dtype(str(array.type)), end)[begin:].astype(np.int64)
    if array.null_count:
        whole[~_read_bits(array, 0)] = null
    return whole


def _read_bits(array: Any, number: int) -> BoolColumn:  # noqa: ANN401 - pyarrow has no types
    """Return a buffer of bits: 0 says which values are no null, 1 has the values of a column of booleans."""
    begin, end = array.offset, array.offset + len(array)
    if not len(array):
        return np.zeros(0, np.bool_)
    packed = np.frombuffer(array.buffers()[number], np.uint8)
    return np.unpackbits(packed, count=end, bitorder="little")[begin:].astype(np.bool_)
