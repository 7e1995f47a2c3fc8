"""A made-up run, written by the real Recorder: three lanes, about sixty cars, two events, no SUMO."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xgv_cosim.actuation import Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.events import Event
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import Recorder
from xgv_cosim.snapshot import Snapshot

STEP_S = 0.1
EDGES = (("in", 1000.0), (":mid_0", 12.0), ("out", 800.0))
MODE_NAMES = {1: "drive_by_wire", 2: "software_pause", 8: "estop_pause", 11: "estop_disable"}


class StraightRoad:
    """Three lanes along x over three edges, the middle one as short as a junction."""

    lane_ids = tuple(f"{edge}_{lane}" for edge, _ in EDGES for lane in range(3))

    def lane_length_m(self, lane: Any) -> Any:
        return np.array([EDGES[int(number) // 3][1] for number in lane])

    def lane_width_m(self, lane: Any) -> Any:
        return np.full(len(lane), 3.5)

    def lane_limit_mps(self, lane: Any) -> Any:
        return np.full(len(lane), 30.0)

    def lane_shape_m(self, lane: int) -> Any:
        start = sum(length for _, length in EDGES[: lane // 3])
        y_m = 3.5 * (lane % 3)
        return np.array([[start, y_m], [start + EDGES[lane // 3][1], y_m]])

    def points_ahead(self, lane: Any, position_m: Any, next_lane: Any) -> Any:
        raise AssertionError("the recorder asks for shapes only")


class Traffic:
    """Cars that keep the distance of the intelligent driver model; a few of them may be told to brake."""

    def __init__(self, num_cars: int, pause: tuple[str, str, str]) -> None:
        rng = np.random.default_rng(7)
        self.lane = np.arange(num_cars) % 3
        row = np.arange(num_cars) // 3
        self.s_m = 60.0 + 38.0 * row + rng.uniform(-6, 6, num_cars)
        self.v_mps = rng.uniform(22.0, 27.0, num_cars)
        self.a_mps2 = np.zeros(num_cars)
        self.wish_mps = rng.uniform(24.0, 31.0, num_cars)
        self.ids = [f"xgv_{n // 10}" if n % 10 == 5 else f"car_{n}" for n in range(num_cars)]
        for name, new in zip(("xgv_1", "xgv_2", "xgv_4"), pause, strict=True):
            self.ids[self.ids.index(name)] = new

    def leader_gaps(self) -> Any:
        gaps = np.full(len(self.ids), np.inf)
        speeds = np.zeros(len(self.ids))
        for lane in range(3):
            order = np.flatnonzero(self.lane == lane)
            order = order[np.argsort(self.s_m[order])]
            gaps[order[:-1]] = self.s_m[order[1:]] - 4.6 - self.s_m[order[:-1]]
            speeds[order[:-1]] = self.v_mps[order[1:]]
        return gaps, speeds

    def advance(self, braking: dict[str, float]) -> None:
        gaps, leader_mps = self.leader_gaps()
        wanted = 2.0 + np.maximum(0.0, 1.1 * self.v_mps + self.v_mps * (self.v_mps - leader_mps) / 4.0)
        with np.errstate(divide="ignore"):
            free = 1.0 - (self.v_mps / self.wish_mps) ** 4
            self.a_mps2 = 1.5 * (free - (wanted / np.maximum(gaps, 0.5)) ** 2)
        for name, decel in braking.items():
            if name in self.ids:
                self.a_mps2[self.ids.index(name)] = -decel
        self.a_mps2 = np.maximum(self.a_mps2, -9.0)
        before = self.v_mps
        self.v_mps = np.maximum(0.0, before + self.a_mps2 * STEP_S)
        self.a_mps2 = (self.v_mps - before) / STEP_S
        self.s_m = self.s_m + 0.5 * (before + self.v_mps) * STEP_S

    def leave(self) -> tuple[str, ...]:
        stays = self.s_m < sum(length for _, length in EDGES)
        gone = tuple(name for name, stay in zip(self.ids, stays, strict=True) if not stay)
        if gone:
            for column in ("lane", "s_m", "v_mps", "a_mps2", "wish_mps"):
                setattr(self, column, getattr(self, column)[stays])
            self.ids = [name for name, stay in zip(self.ids, stays, strict=True) if stay]
        return gone

    def snapshot(self, time_s: float, gone: tuple[str, ...]) -> Snapshot:
        n = len(self.ids)
        starts = np.cumsum([0.0] + [length for _, length in EDGES])
        edge = np.clip(np.searchsorted(starts, self.s_m, side="right") - 1, 0, len(EDGES) - 1)
        none = np.full(n, -1, np.int64)
        gaps, _ = self.leader_gaps()
        return Snapshot(
            time_s=time_s,
            ids=tuple(self.ids),
            type_ids=("car",) * n,
            front_x_m=self.s_m,
            front_y_m=3.5 * self.lane,
            heading_rad=np.zeros(n),
            speed_mps=self.v_mps,
            accel_mps2=self.a_mps2,
            length_m=np.full(n, 4.6),
            width_m=np.full(n, 1.8),
            lane=(3 * edge + self.lane).astype(np.int64),
            lane_position_m=self.s_m - starts[edge],
            next_lane=none,
            leader=none,
            leader_gap_m=gaps,
            follower=none,
            follower_gap_m=np.full(n, np.inf),
            placement_error_m=np.zeros(n),
            placement_error_rad=np.zeros(n),
            in_lane_frame=np.zeros(n, np.bool_),
            arrived=gone,
        )


def _copy_into_fleet(
    fleet: Fleet, traffic: Traffic, modes: dict[str, int], braking: dict[str, float]
) -> None:
    for slot, name in list(fleet):
        if name not in traffic.ids:
            fleet.vacate(name)
            continue
        row = traffic.ids.index(name)
        stops = name in braking
        fleet.motion.x_m[slot] = traffic.s_m[row] - 3.5
        fleet.motion.y_m[slot] = 3.5 * traffic.lane[row]
        fleet.motion.speed_mps[slot] = traffic.v_mps[row]
        fleet.motion.accel_mps2[slot] = traffic.a_mps2[row]
        fleet.motion.brake[slot] = min(1.0, max(0.0, -traffic.a_mps2[row]) / 9.0)
        fleet.motion.throttle[slot] = min(1.0, max(0.0, traffic.a_mps2[row]) / 4.0)
        fleet.reference.speed_mps[slot] = 0.0 if stops else traffic.v_mps[row] + 0.3
        fleet.command.kind[slot] = CommandKind.MOTION_PROFILE
        fleet.command.speed_mps[slot] = traffic.wish_mps[row]
        fleet.command.max_accel_mps2[slot] = 2.0
        fleet.control_mode[slot], fleet.ready_mode[slot] = 3, 2
        fleet.safety_mode[slot] = modes.get(name, 1)
        fleet.longitudinal[slot] = Longitudinal.CONTROLLED_STOP if stops else Longitudinal.CLOSED_LOOP


def make_run(
    folder: Path,
    *,
    names: tuple[str, str, str] = ("xgv_1", "xgv_2", "xgv_4"),
    duration_s: float = 60.0,
    events: bool = True,
) -> Path:
    """Record a made-up run into ``folder`` and return it.

    ``names``: the car that is paused (8 s to 28 s), the one that is disabled (12 s on), a bystander.
    """
    paused, disabled, _ = names
    traffic, fleet = Traffic(60, names), Fleet()
    for name in traffic.ids:
        if not name.startswith("car_"):
            fleet.occupy(name)
    num_steps = round(duration_s / STEP_S)
    with Recorder(folder, safety_mode_name=MODE_NAMES.__getitem__, reserve_bytes=1 << 16) as recorder:
        recorder.use_road(StraightRoad())
        braking: dict[str, float] = {}
        modes: dict[str, int] = {}
        for step in range(num_steps):
            t_s = step * STEP_S
            for at_s, name, mode, decel in (
                (8.0, paused, 8, 2.5),
                (28.0, paused, 1, None),
                (12.0, disabled, 11, 7.5),
            ):
                if events and abs(t_s - at_s) < 1e-9:
                    before = MODE_NAMES[modes.get(name, 1)]
                    modes[name] = mode
                    braking.pop(name, None)
                    if decel is not None:
                        braking[name] = decel
                    reasons = ("SafeStop stop button",) if mode == 11 else ("SafeStop pause relay",)
                    recorder.record_event(Event(at_s, name, "injection", "", "start" if decel else "end"))
                    recorder.record_event(Event(at_s, name, "safety_mode", before, MODE_NAMES[mode], reasons))
            traffic.advance(braking)
            gone = traffic.leave()
            _copy_into_fleet(fleet, traffic, modes, braking)
            recorder.record_step((step + 1) * 10, fleet, traffic.snapshot(t_s + STEP_S, gone))
        trace_hash = recorder.trace_hash
    result = make_result(names, duration_s, trace_hash, events=events)
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    return folder


def _metrics(**values: Any) -> dict[str, Any]:
    keys = (
        "time_to_standstill_s stopping_distance_m ideal_stopping_distance_m stopping_distance_ratio "
        "speed_at_event_mps peak_decel_mps2 min_ttc_s min_ttc_follower_s min_gap_m "
        "unattended_speed_s unattended_steering_s"
    )
    return {
        **dict.fromkeys(keys.split()),
        "collisions": 0,
        "time_in_mode_s": {"drive_by_wire": 60.0},
        **values,
    }


def make_result(
    names: tuple[str, str, str], duration_s: float, trace_hash: str, *, events: bool
) -> dict[str, Any]:
    def row(t_s: float, safety: str, *reasons: str) -> dict[str, Any]:
        return {
            "t_s": t_s,
            "control_mode": "motion_profiles",
            "ready_mode": "ready",
            "safety_mode": safety,
            "reasons": list(reasons),
        }

    start = row(0.0, "drive_by_wire", "start of the run")
    vehicles: dict[str, Any] = {
        names[2]: {
            "injected": False,
            "injections": [],
            "modes": [start],
            "metrics": {"time_in_mode_s": {"drive_by_wire": 60.0}, "collisions": 0},
        }
    }
    if events:
        vehicles[names[0]] = {
            "injected": True,
            "injections": [{"kind": "estop_pause", "at_s": 8.0, "end_s": 28.0}],
            "modes": [
                start,
                row(8.0, "estop_pause", "SafeStop pause relay"),
                row(28.0, "drive_by_wire", "pause relay released"),
            ],
            "metrics": _metrics(
                speed_at_event_mps=25.1,
                time_to_standstill_s=10.0,
                stopping_distance_m=126.8,
                ideal_stopping_distance_m=126.0,
                stopping_distance_ratio=1.006,
                peak_decel_mps2=2.5,
                min_ttc_follower_s=4.1,
                min_gap_m=33.0,
                time_in_mode_s={"drive_by_wire": 40.0, "estop_pause": 20.0},
            ),
        }
        vehicles[names[1]] = {
            "injected": True,
            "injections": [{"kind": "estop_disable", "at_s": 12.0, "end_s": None}],
            "modes": [start, row(12.0, "estop_disable", "SafeStop stop button")],
            "metrics": _metrics(
                speed_at_event_mps=24.0,
                time_to_standstill_s=3.2,
                stopping_distance_m=38.6,
                ideal_stopping_distance_m=38.4,
                stopping_distance_ratio=1.005,
                peak_decel_mps2=7.5,
                min_ttc_follower_s=1.4,
                min_gap_m=12.0,
                time_in_mode_s={"drive_by_wire": 12.0, "estop_disable": 48.0},
            ),
        }
    return {
        "schema": "xgv-cosim/result/1",
        "status": "ok",
        "error": None,
        "scenario": "made_up",
        "description": "Three lanes, sixty cars, one pause and one stop.",
        "seed": 7,
        "versions": {"xgv-cosim": "0.1.0", "python": "3.11.2"},
        "started_at": "2026-01-01T12:00:00+00:00",
        "simulated_s": duration_s,
        "step_s": STEP_S,
        "wall_s": 4.0,
        "real_time_factor": duration_s / 4.0,
        "trace_hash": trace_hash,
        "num_vehicles_max": 60,
        "num_bound_max": 6,
        "collisions": [],
        "teleports": [],
        "vehicles": vehicles,
        "expectations": [
            {
                "text": f"{names[0]} stands still by 20 s",
                "status": "ok",
                "detail": "stood still at 18.0 s",
            },
            {"text": "no collision", "status": "ok", "detail": ""},
        ],
        "assumptions": [
            {
                "rule": "XGV-36",
                "key": "xgv.pause.decel_mps2",
                "value": "2.5",
                "evidence": "D",
                "text": "Deceleration of a pause.",
                "exercised": True,
            },
            {
                "rule": "XGV-43",
                "key": "xgv.wrench_timeout_s",
                "value": "0.5",
                "evidence": "D",
                "text": "Wrench efforts that stop coming raise an error after this time.",
                "exercised": False,
            },
        ],
        "notes": [],
    }


@pytest.fixture(scope="session")
def made_up_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_run(tmp_path_factory.mktemp("report") / "run")


@pytest.fixture(name="make_run", scope="session")
def make_run_fixture() -> Any:
    return make_run
