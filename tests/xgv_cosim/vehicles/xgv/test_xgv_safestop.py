"""The SafeStop as radio and receiver: relays and link over time (XGV-42)."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xgv_cosim.errors import ScenarioError
from xgv_cosim.vehicles.transmitter import RUN, Demand, Transmitter
from xgv_cosim.vehicles.xgv.safestop import (
    LinkStatus,
    Receiver,
    Relay,
    SafeStopReaction,
    SafeStopSettings,
)

PAUSE, STOP, BOTH = Demand(True, False), Demand(False, True), Demand(True, True)


def pair(**settings: object) -> tuple[Transmitter, Receiver]:
    transmitter = Transmitter()
    return transmitter, Receiver(SafeStopSettings(**settings), transmitter, "1/xgv_0", 0.0)


def run_to(receiver: Receiver, time_s: float) -> list[float]:
    """Wake the receiver as the simulation does: on the tick at or after each time it asks for."""
    woken = []
    while receiver.next_change_s <= time_s:
        tick = math.ceil(round(receiver.next_change_s * 100, 6)) / 100
        if tick > time_s:
            break
        receiver.advance(tick)
        woken.append(tick)
    receiver.advance(time_s)
    return woken


def test_without_delay_and_loss_a_press_acts_at_once_and_nothing_wakes_the_receiver() -> None:
    transmitter, receiver = pair()
    assert receiver.next_change_s == math.inf
    transmitter.set(5.03, pause=True)
    receiver.advance(5.03)
    assert (receiver.relays, receiver.link) == (PAUSE, LinkStatus.GOOD)
    transmitter.set(5.04, stop=True)
    receiver.advance(5.04)
    assert receiver.relays == BOTH
    transmitter.set(9.0, pause=False, stop=False)
    receiver.advance(9.0)
    assert receiver.relays == RUN
    assert receiver.next_change_s == math.inf


def test_latency_delays_both_edges_of_a_press() -> None:
    transmitter, receiver = pair(latency_s=0.12)
    transmitter.set(1.0, stop=True)
    receiver.advance(1.0)
    assert receiver.relays == RUN
    assert receiver.next_change_s == pytest.approx(1.12)
    transmitter.set(1.05, stop=False)  # released before the press has arrived: the pulse still passes
    assert run_to(receiver, 1.12) == [1.12]
    assert receiver.relays == STOP
    assert run_to(receiver, 1.3) == [1.17]
    assert receiver.relays == RUN


@pytest.mark.parametrize(
    ("link_loss", "relays"),
    [(SafeStopReaction.PAUSE, PAUSE), (SafeStopReaction.STOP, BOTH), (SafeStopReaction.NONE, RUN)],
)
def test_loss_of_link_acts_after_the_time_out_and_ends_with_the_next_frame(
    link_loss: SafeStopReaction, relays: Demand
) -> None:
    _, receiver = pair(link_loss=link_loss)
    receiver.set_link(5.0, up=False)
    assert receiver.next_change_s == pytest.approx(5.5)
    receiver.advance(5.49)
    assert (receiver.relays, receiver.link) == (RUN, LinkStatus.GOOD)
    receiver.advance(5.5)
    assert (receiver.relays, receiver.link) == (relays, LinkStatus.NONE)
    assert receiver.next_change_s == math.inf
    receiver.set_link(7.02, up=True)
    assert receiver.next_change_s == pytest.approx(7.05)
    receiver.advance(7.05)
    assert (receiver.relays, receiver.link) == (RUN, LinkStatus.GOOD)


def test_the_time_out_counts_from_the_last_frame_that_arrived() -> None:
    _, receiver = pair()
    receiver.set_link(5.03, up=False)  # the last frame was that of 5.00
    assert receiver.next_change_s == pytest.approx(5.5)


def test_flapping_shorter_than_the_time_out_opens_nothing() -> None:
    _, receiver = pair()
    for number in range(20):
        receiver.set_link(1.0 + number, up=False)
        run_to(receiver, 1.44 + number)
        receiver.set_link(1.44 + number, up=True)
        run_to(receiver, 1.9 + number)
        assert (receiver.relays, receiver.link) == (RUN, LinkStatus.GOOD)


def test_a_press_during_a_loss_is_heard_when_the_link_returns() -> None:
    transmitter, receiver = pair()
    receiver.set_link(1.0, up=False)
    transmitter.set(1.2, stop=True)
    receiver.advance(1.2)
    assert receiver.relays == RUN
    run_to(receiver, 1.5)
    assert receiver.relays == PAUSE  # supervision
    receiver.set_link(2.0, up=True)
    run_to(receiver, 2.05)
    assert receiver.relays == STOP


def test_bypass_suppresses_supervision_and_nothing_else() -> None:
    transmitter, receiver = pair()
    receiver.set_bypass(1.0, bypass=True)
    assert receiver.link is LinkStatus.BYPASS
    transmitter.set(1.5, stop=True)
    receiver.advance(1.5)
    assert receiver.relays == STOP
    receiver.set_link(2.0, up=False)
    run_to(receiver, 3.0)
    assert (receiver.relays, receiver.link) == (STOP, LinkStatus.BYPASS)
    receiver.set_bypass(4.0, bypass=False)
    assert (receiver.relays, receiver.link) == (BOTH, LinkStatus.NONE)


def test_a_dead_receiver_opens_both_and_needs_a_frame_to_close_them() -> None:
    _, receiver = pair()
    receiver.set_dead(1.0, dead=True)
    assert (receiver.relays, receiver.link) == (BOTH, LinkStatus.NONE)
    receiver.set_dead(2.01, dead=False)
    assert receiver.relays == PAUSE  # lives, but has heard nothing yet
    run_to(receiver, 2.05)
    assert (receiver.relays, receiver.link) == (RUN, LinkStatus.GOOD)


@pytest.mark.parametrize(
    ("reaction", "relays"),
    [(SafeStopReaction.PAUSE, PAUSE), (SafeStopReaction.STOP, BOTH), (SafeStopReaction.NONE, RUN)],
)
def test_what_falls_open_in_a_dead_receiver_is_a_key(reaction: SafeStopReaction, relays: Demand) -> None:
    _, receiver = pair(receiver_dead=reaction)
    receiver.set_dead(1.0, dead=True)
    assert receiver.relays == relays


@pytest.mark.parametrize("pressed_first", [False, True])
@pytest.mark.parametrize("relay", list(Relay))
def test_a_stuck_relay_stays_as_it_is(relay: Relay, pressed_first: bool) -> None:
    transmitter, receiver = pair()
    if pressed_first:
        transmitter.set(1.0, pause=True, stop=True)
    receiver.stick(relay, 1.0, stuck=True)
    transmitter.set(2.0, pause=not pressed_first, stop=not pressed_first)
    receiver.advance(2.0)
    stuck, free = (receiver.relays, receiver.relays[::-1])[relay is Relay.STOP]
    assert (stuck, free) == (pressed_first, not pressed_first)
    assert receiver.is_stuck(relay)
    receiver.stick(relay, 3.0, stuck=False)
    assert receiver.relays == ((RUN, BOTH)[not pressed_first])


def test_one_transmitter_serves_many_receivers_and_each_misses_its_own_frames() -> None:
    transmitter = Transmitter()
    settings = SafeStopSettings(loss_share=0.7, link_timeout_s=5.0)
    cars = [Receiver(settings, transmitter, f"1/car_{number}", 0.0) for number in range(40)]
    for car in cars:
        run_to(car, 10.0)
    transmitter.set(10.0, stop=True)
    heard = {}
    for number, car in enumerate(cars):
        car.advance(10.0)
        tick = 10.0
        while not car.relays.stop:
            tick = round(tick + 0.01, 2)
            run_to(car, tick)
        heard[number] = tick
    assert len(set(heard.values())) > 5  # each on its own
    assert min(heard.values()) == 10.0
    again = Receiver(settings, transmitter, "1/car_7", 0.0)
    tick = 10.0
    run_to(again, tick)
    while not again.relays.stop:
        tick = round(tick + 0.01, 2)
        run_to(again, tick)
    assert tick == heard[7]  # the same car in the same run misses the same frames


def test_the_share_of_lost_frames_is_that_of_the_key() -> None:
    _, receiver = pair(loss_share=0.3)
    lost = sum(receiver._is_lost(frame * 0.05) for frame in range(20000))
    assert lost / 20000 == pytest.approx(0.3, abs=0.01)


EVENTS = st.lists(
    st.tuples(
        st.integers(1, 60),
        st.sampled_from(["pause", "run", "stop", "unstop", "down", "up", "dead", "alive"]),
    ),
    max_size=25,
)


@given(
    events=EVENTS,
    latency_ticks=st.integers(0, 30),
    loss_share=st.sampled_from([0.0, 0.2, 0.6, 0.9]),
    seed=st.integers(0, 5),
)
def test_no_run_while_stop_is_pressed_beyond_latency_and_time_out(
    events: list[tuple[int, str]], latency_ticks: int, loss_share: float, seed: int
) -> None:
    """XGV-42: pressed for longer than latency and time-out, some relay is open, whatever the radio does."""
    settings = SafeStopSettings(latency_s=latency_ticks / 100, loss_share=loss_share)
    transmitter = Transmitter()
    receiver = Receiver(settings, transmitter, f"{seed}/car", 0.0)
    at, dead, pressed_since = 0, False, None
    schedule = {}
    for wait, what in events:
        at += wait
        schedule.setdefault(at, []).append(what)
    for tick in range(at + 200):
        now_s = tick / 100
        for what in schedule.get(tick, []):
            match what:
                case "pause" | "run":
                    transmitter.set(now_s, pause=what == "pause")
                case "stop" | "unstop":
                    transmitter.set(now_s, stop=what == "stop")
                case "down" | "up":
                    receiver.set_link(now_s, up=what == "up")
                case _:
                    dead = what == "dead"
                    receiver.set_dead(now_s, dead=dead)
            receiver.advance(now_s)
        if receiver.next_change_s <= now_s + 1e-9:
            receiver.advance(now_s)
        if transmitter.demand.stop:
            pressed_since = tick if pressed_since is None else pressed_since
            limit = latency_ticks + 50
            if tick - pressed_since > limit:
                assert receiver.relays.pause or receiver.relays.stop
        else:
            pressed_since = None
        if dead:  # XGV-42: a dead receiver always stops
            assert receiver.relays == BOTH


@given(events=EVENTS, seed=st.integers(0, 5), loss_share=st.sampled_from([0.0, 0.5]))
def test_waking_only_when_asked_sees_what_looking_at_every_tick_sees(
    events: list[tuple[int, str]], seed: int, loss_share: float
) -> None:
    """XGV-71: the receiver's deadlines miss nothing that a look at each 10 ms tick would find."""
    settings = SafeStopSettings(latency_s=0.07, loss_share=loss_share)
    transmitter = Transmitter()
    lazy, eager = (Receiver(settings, transmitter, f"{seed}/car", 0.0) for _ in range(2))
    at, schedule = 0, {}
    for wait, what in events:
        at += wait
        schedule.setdefault(at, []).append(what)
    for tick in range(at + 150):
        now_s = tick / 100
        eager.advance(now_s)
        for what in schedule.get(tick, []):
            match what:
                case "pause" | "run":
                    transmitter.set(now_s, pause=what == "pause")
                case "stop" | "unstop":
                    transmitter.set(now_s, stop=what == "stop")
                case "down" | "up":
                    for receiver in (lazy, eager):
                        receiver.set_link(now_s, up=what == "up")
                case _:
                    for receiver in (lazy, eager):
                        receiver.set_dead(now_s, dead=what == "dead")
        if lazy.next_change_s <= now_s + 1e-9:
            lazy.advance(now_s)
        eager.advance(now_s)
        assert (lazy.relays, lazy.link) == (eager.relays, eager.link), tick


@given(events=EVENTS)
def test_bypass_never_suppresses_a_stop_that_was_heard(events: list[tuple[int, str]]) -> None:
    """XGV-42: the same run with bypass opens the stop relay whenever the one without does, but for faults."""
    transmitter = Transmitter()
    plain, bypassed = (Receiver(SafeStopSettings(), transmitter, "1/car", 0.0) for _ in range(2))
    bypassed.set_bypass(0.0, bypass=True)
    now_s = 0.0
    for wait, what in events:
        now_s += wait / 100
        if what in {"down", "up"}:
            plain.set_link(now_s, up=what == "up")
            bypassed.set_link(now_s, up=what == "up")
        elif what in {"stop", "unstop"}:
            transmitter.set(now_s, stop=what == "stop")
        elif what in {"pause", "run"}:
            transmitter.set(now_s, pause=what == "pause")
        for receiver in (plain, bypassed):
            receiver.advance(now_s)
        assert plain.relays.stop == bypassed.relays.stop
        assert bypassed.relays == bypassed.heard


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"latency_s": -0.1}, "latency_s"),
        ({"latency_s": math.nan}, "latency_s"),
        ({"loss_share": 1.0}, "loss_share"),
        ({"frame_period_s": 0.5}, "link_timeout_s"),
        ({"link_loss": "brake"}, "link_loss"),
        ({"receiver_dead": "maybe"}, "receiver_dead"),
    ],
)
def test_settings_out_of_range_are_named(settings: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        SafeStopSettings(**settings)


def test_frames_come_at_their_period_and_at_each_move() -> None:
    transmitter = Transmitter()
    transmitter.set(1.02, pause=True)
    frames = [1.0]
    while frames[-1] < 1.2:
        frames.append(transmitter.frame_after(frames[-1], 0.05))
    assert frames == pytest.approx([1.0, 1.02, 1.05, 1.1, 1.15, 1.2])
    for before, after in pairwise(frames):
        assert transmitter.frame_before(after - 0.001, 0.05) == pytest.approx(before)
        assert transmitter.frame_before(after, 0.05) == pytest.approx(after)
    assert transmitter.demand_at(1.019) == RUN
    assert transmitter.demand_at(1.02) == PAUSE
