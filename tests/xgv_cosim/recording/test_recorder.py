"""The run folder: what lies in it at each moment, and that commanded and measured stay apart."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.errors import RecordingError, ReplayError
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import Recorder, TraceHash, prepare_run_folder, read_trace, read_trajectory


def recorder_in(folder: Path) -> Recorder:
    return Recorder(folder, safety_mode_name=lambda code: f"mode_{code}", reserve_bytes=1 << 16)


def test_events_are_readable_at_any_moment(tmp_path: Path) -> None:
    recorder = recorder_in(tmp_path / "run")
    recorder.record_event(
        Event(1.25, "xgv_0", "safety_mode", "drive_by_wire", "estop_pause", ("SafeStop → relay",))
    )
    rows = [json.loads(line) for line in (tmp_path / "run/events.jsonl").read_text("utf-8").splitlines()]
    assert rows == [
        {
            "t_s": 1.25,
            "vehicle": "xgv_0",
            "kind": "safety_mode",
            "from": "drive_by_wire",
            "to": "estop_pause",
            "reasons": ["SafeStop → relay"],
        }
    ]
    recorder.close()


def test_trace_is_readable_at_any_moment_and_ends_in_the_hash(
    tmp_path: Path, fleet: Fleet, make_snapshot
) -> None:
    recorder, trace = recorder_in(tmp_path / "run"), TraceHash()
    for tick in (10, 20, 30):
        fleet.motion.x_m[0] += 2.0
        recorder.record_step(tick, fleet, make_snapshot("xgv_0", "car"))
        trace.update(tick, fleet, make_snapshot("xgv_0", "car"))
        step, at_tick, t_s, digest = read_trace(tmp_path / "run/trace.csv")[-1]
        assert (step, at_tick, t_s) == (tick // 10 - 1, tick, tick / 100)
        assert recorder.trace_hash == trace.hexdigest
        assert trace.hexdigest.startswith(digest)
        assert len(digest) == 16
    recorder.close()


def test_commanded_and_measured_are_apart(tmp_path: Path, fleet: Fleet, make_snapshot) -> None:
    fleet.longitudinal[0] = Longitudinal.CLOSED_LOOP
    fleet.command.kind[0] = CommandKind.MOTION_PROFILE
    fleet.command.speed_mps[0], fleet.reference.speed_mps[0], fleet.motion.speed_mps[0] = 30.0, 25.0, 24.56
    fleet.command.throttle[0], fleet.motion.throttle[0], fleet.motion.brake[0] = 0.9, 0.25, 0.125
    fleet.safety_mode[0] = 8
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("car", "xgv_0"))
    track = read_trajectory(tmp_path / "run/trajectory.parquet")
    row, other = track.rows_of["xgv_0"].start, track.rows_of["car"].start
    assert track["commanded_speed"][row] == 30.0
    assert track["reference_speed"][row] == 25.0
    assert track["measured_speed"][row] == 24.56
    assert np.isnan(track["commanded_throttle"][row]), "a motion profile commands no throttle"
    assert (track["throttle"][row], track["brake"][row]) == (0.25, 0.125)
    assert track.safety_mode_names == {8: "mode_8"}
    assert track["safety_mode"][row] == 8
    assert track.bound.tolist()[row] is True
    assert not track.bound[other]
    assert np.isnan(track["commanded_speed"][other])
    assert track["measured_speed"][other] == 20.0


def test_wrench_efforts_are_commanded_shares_and_no_speed(
    tmp_path: Path, fleet: Fleet, make_snapshot
) -> None:
    fleet.command.kind[0] = CommandKind.WRENCH_EFFORT
    fleet.command.throttle[0], fleet.command.brake[0], fleet.command.steering[0] = 0.5, 0.0, -0.25
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("xgv_0"))
    track = read_trajectory(tmp_path / "run/trajectory.parquet")
    assert [track[name][0] for name in ("commanded_throttle", "commanded_brake", "commanded_steering")] == [
        0.5,
        0.0,
        -0.25,
    ]
    assert np.isnan(track["commanded_speed"][0])


def test_the_world_measures_while_its_driver_drives(tmp_path: Path, fleet: Fleet, make_snapshot) -> None:
    fleet.longitudinal[0] = Longitudinal.DRIVER
    fleet.motion.speed_mps[0] = 1.0
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("xgv_0", speed_mps=np.array([17.0])))
    assert read_trajectory(tmp_path / "run/trajectory.parquet")["measured_speed"].tolist() == [17.0]


def test_rows_are_sorted_by_vehicle_then_time_though_vehicles_come_and_go(
    tmp_path: Path, fleet: Fleet, make_snapshot
) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        for tick, names in ((10, ("b", "xgv_0")), (20, ("a", "xgv_0", "b")), (30, ("a",)), (40, ())):
            recorder.record_step(tick, fleet, make_snapshot(*names))
    track = read_trajectory(tmp_path / "run/trajectory.parquet")
    assert track.vehicle_ids == ("b", "xgv_0", "a")
    assert {name: track.time_s[rows].tolist() for name, rows in track.rows_of.items()} == {
        "b": [0.1, 0.2],
        "xgv_0": [0.1, 0.2],
        "a": [0.2, 0.3],
    }
    assert track["x"][track.rows_of["b"]].tolist() == [0.0, 200.0]


def test_units_scales_and_schema_stand_in_the_file(tmp_path: Path, fleet: Fleet, make_snapshot) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("xgv_0", "car"))
    file = pq.ParquetFile(tmp_path / "run/trajectory.parquet")
    schema = file.schema_arrow
    assert schema.metadata[b"schema"] == b"xgv-cosim/trajectory/1"
    speed = schema.field("measured_speed")
    assert (speed.metadata[b"unit"], float(speed.metadata[b"scale"])) == (b"m/s", 0.01)
    assert all({b"unit", b"scale", b"meaning"} <= set(field.metadata) for field in schema)
    group = file.metadata.row_group(0)
    columns = {group.column(i).path_in_schema: group.column(i) for i in range(group.num_columns)}
    assert "DELTA_BINARY_PACKED" in columns["x"].encodings
    assert all(column.compression == "ZSTD" for column in columns.values())
    assert pq.read_table(tmp_path / "run/trajectory.parquet")["x"].to_pylist() == [0, 10000], "centimetres"


def test_off_road_and_unseen_values_are_null(tmp_path: Path, fleet: Fleet, make_snapshot, one_lane) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        recorder.use_road(one_lane)
        recorder.record_step(
            10,
            fleet,
            make_snapshot("xgv_0", "car", lane=np.array([-1, 0]), leader_gap_m=np.array([np.inf, 12.344])),
        )
    track = read_trajectory(tmp_path / "run/trajectory.parquet")
    assert track.lane_ids == ("main_0",)
    assert track.lane.tolist() == [-1, 0]
    assert np.isnan(track["leader_gap"][0])
    assert track["leader_gap"][1] == pytest.approx(12.344, abs=0.005)


def test_road_holds_the_lanes_that_were_touched(
    tmp_path: Path, fleet: Fleet, make_snapshot, one_lane
) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        recorder.use_road(one_lane)
        recorder.record_step(10, fleet, make_snapshot("xgv_0"))
    road = json.loads((tmp_path / "run/road.json").read_text())
    assert road == {
        "schema": "xgv-cosim/road/1",
        "lanes": [{"id": "main_0", "length_m": 500.0, "width_m": 3.2, "shape_m": [[0.0, 0.0], [500.0, 1.0]]}],
    }


def test_a_run_without_steps_leaves_readable_files(tmp_path: Path) -> None:
    recorder_in(tmp_path / "run").close()
    assert read_trajectory(tmp_path / "run/trajectory.parquet").num_rows == 0
    assert read_trace(tmp_path / "run/trace.csv") == []
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == [
        "events.jsonl",
        "road.json",
        "trace.csv",
        "trajectory.parquet",
    ]


def test_a_bound_vehicle_that_left_the_world_is_left_out(tmp_path: Path, fleet: Fleet, make_snapshot) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("car"))
    assert read_trajectory(tmp_path / "run/trajectory.parquet").vehicle_ids == ("car",)


def test_a_folder_that_holds_another_run_is_refused_and_left_alone(
    tmp_path: Path, fleet: Fleet, make_snapshot
) -> None:
    with recorder_in(tmp_path / "run") as recorder:
        recorder.record_step(10, fleet, make_snapshot("xgv_0"))
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    with pytest.raises(RecordingError, match=r"holds another run .*events\.jsonl.*nothing was changed"):
        recorder_in(tmp_path / "run")
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before


def test_a_folder_with_foreign_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(RecordingError, match=r"is not empty \(thesis\.tex\)"):
        prepare_run_folder(tmp_path)


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run").write_text("")
    with pytest.raises(RecordingError, match="it is a file"):
        prepare_run_folder(tmp_path / "run")


def test_a_lock_file_written_before_is_no_obstacle(tmp_path: Path) -> None:
    (tmp_path / "scenario.lock.yaml").write_text("seed: 1\n")
    recorder_in(tmp_path).close()
    assert (tmp_path / "scenario.lock.yaml").read_text() == "seed: 1\n"


def test_recording_after_the_end_is_an_error(tmp_path: Path) -> None:
    recorder = recorder_in(tmp_path / "run")
    recorder.close()
    recorder.close()
    with pytest.raises(RecordingError, match="the recording is closed"):
        recorder.record_event(Event(1.0, "", "late"))


@pytest.mark.parametrize("content", [b"", b"not parquet at all"])
def test_an_unreadable_trajectory_is_named(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "trajectory.parquet"
    path.write_bytes(content)
    with pytest.raises(ReplayError, match=r"trajectory\.parquet"):
        read_trajectory(path)


def test_pyarrow_stays_out_of_the_step() -> None:
    """libsumo prints on stdout when it meets pyarrow; and pyarrow takes long to load."""
    code = (
        "import sys, xgv_cosim.recording; sys.exit('pyarrow' in sys.modules or 'matplotlib' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
