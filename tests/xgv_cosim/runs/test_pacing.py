"""Real time, with a clock that the test moves: no step ahead of its time, clients served every 10 ms."""

from __future__ import annotations

from itertools import pairwise

import pytest

from xgv_cosim.runs.pacing import COMMUNICATION_PERIOD_S, RealTime


class FakeClock:
    """A wall clock that goes on while somebody sleeps or works."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0.0
        self.now_s += max(seconds, 1e-6)


def paced(clock: FakeClock, serving_s: float = 0.0) -> tuple[RealTime, list[float]]:
    served: list[float] = []

    def communicate(now_s: float) -> None:
        served.append(now_s)
        clock.now_s += serving_s

    return RealTime(communicate, clock, clock.sleep), served


def test_each_step_waits_for_its_time_and_clients_are_served_meanwhile() -> None:
    clock = FakeClock()
    real_time, served = paced(clock)
    for step in range(1, 11):
        clock.now_s += 0.02  # what a step takes
        real_time.wait_until(0.1 * step)
        assert clock.now_s == pytest.approx(1000.02 + 0.1 * (step - 1), abs=1e-3)
    assert served == sorted(served)
    assert served[-1] == pytest.approx(1.0, abs=1e-4)
    gaps = [after - before for before, after in pairwise(served)]
    assert max(gaps) < 0.02 + COMMUNICATION_PERIOD_S + 1e-3
    assert len(served) == pytest.approx(9 * 8 + 10, abs=15)
    assert real_time.most_behind_s == pytest.approx(0.0, abs=1e-9)


def test_a_run_that_is_too_slow_serves_once_a_step_and_catches_up() -> None:
    clock = FakeClock()
    real_time, served = paced(clock)
    real_time.wait_until(0.1)
    before = len(served)
    for step in range(2, 5):
        clock.now_s += 0.3
        real_time.wait_until(0.1 * step)
    assert len(served) == before + 3
    assert served[-3:] == pytest.approx([0.2, 0.3, 0.4])  # the network's time is never ahead of the run's
    assert real_time.most_behind_s == pytest.approx(0.6)
    for step in range(5, 14):
        real_time.wait_until(0.1 * step)
    assert clock.now_s == pytest.approx(1000.0 + 1.2, abs=2e-2)


def test_clients_who_take_long_to_serve_do_not_make_steps_late() -> None:
    clock = FakeClock()
    real_time, served = paced(clock, serving_s=0.004)
    for step in range(1, 6):
        real_time.wait_until(0.1 * step)
        assert clock.now_s < 1000.0 + 0.1 * (step - 1) + 0.02
    assert len(served) > 30
