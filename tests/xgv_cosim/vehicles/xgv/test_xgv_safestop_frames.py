"""Single frames of the SafeStop's radio: what is heard, when the receiver wakes, which are lost (XGV-42)."""

from __future__ import annotations

import math

import pytest

from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import InjectionKind
from xgv_cosim.vehicles.transmitter import RUN, TRANSMITTER_KINDS, Demand, Transmitter
from xgv_cosim.vehicles.xgv.safestop import LinkStatus, Receiver, Relay, SafeStopReaction, SafeStopSettings

PAUSE, STOP, BOTH = Demand(True, False), Demand(False, True), Demand(True, True)


def pair(**settings: object) -> tuple[Transmitter, Receiver]:
    transmitter = Transmitter()
    return transmitter, Receiver(SafeStopSettings(**settings), transmitter, "1/xgv_0", 0.0)


def tick_after(time_s: float) -> float:
    return math.ceil(round(time_s * 100, 6)) / 100


@pytest.mark.parametrize(
    ("name", "lower", "upper", "others"),
    [
        ("frame_period_s", 0.01, 10.0, {"link_timeout_s": 30.0}),
        ("latency_s", 0.0, 10.0, {}),
        ("link_timeout_s", 0.02, 60.0, {"frame_period_s": 0.01}),
        ("loss_share", 0.0, 0.999, {}),
    ],
)
def test_settings_reach_from_limit_to_limit(
    name: str, lower: float, upper: float, others: dict[str, float]
) -> None:
    for value in (lower, upper):
        assert getattr(SafeStopSettings(**{name: value}, **others), name) == value
    for value in (lower - 0.011, upper + 0.011):
        with pytest.raises(ScenarioError, match=name):
            SafeStopSettings(**{name: value}, **others)


def test_every_wrong_setting_is_told_at_once() -> None:
    with pytest.raises(ScenarioError) as caught:
        SafeStopSettings(latency_s=11.0, loss_share=2.0, link_loss="brake", receiver_dead="maybe")
    assert [problem.split(":")[0] for problem in caught.value.problems] == [
        "latency_s",
        "loss_share",
        "link_loss",
        "receiver_dead",
    ]


def test_the_time_out_has_to_be_longer_than_one_frame() -> None:
    with pytest.raises(ScenarioError, match="between any two frames"):
        SafeStopSettings(frame_period_s=0.3, link_timeout_s=0.3)
    SafeStopSettings(frame_period_s=0.3, link_timeout_s=0.31)


def test_reactions_may_be_given_in_words() -> None:
    settings = SafeStopSettings(link_loss="stop", receiver_dead="none")  # type: ignore[arg-type]
    assert settings.link_loss is SafeStopReaction.STOP
    assert settings.receiver_dead is SafeStopReaction.NONE
    _, receiver = pair(link_loss="stop", receiver_dead="pause")
    receiver.set_link(1.0, up=False)
    receiver.advance(2.0)
    assert receiver.supervision == BOTH


def test_the_link_status_has_the_numbers_of_the_wire_xgv_52() -> None:
    assert {status.name: int(status) for status in LinkStatus} == {"NONE": 0, "BYPASS": 1, "GOOD": 2}


def test_a_revived_receiver_has_no_link_until_it_hears_a_frame_however_short_it_was_dead() -> None:
    _, receiver = pair()
    receiver.advance(1.0)
    receiver.set_dead(1.01, dead=True)
    assert receiver.next_change_s == math.inf
    receiver.set_dead(1.02, dead=False)
    assert (receiver.link, receiver.relays) == (LinkStatus.NONE, PAUSE)
    assert receiver.next_change_s == pytest.approx(1.05)
    receiver.advance(1.05)
    assert (receiver.link, receiver.relays) == (LinkStatus.GOOD, RUN)


def test_a_receiver_that_is_said_to_live_and_does_has_missed_nothing() -> None:
    _, receiver = pair()
    receiver.set_dead(1.0, dead=False)
    assert (receiver.link, receiver.relays) == (LinkStatus.GOOD, RUN)


def test_a_dead_receiver_hears_no_press() -> None:
    transmitter, receiver = pair(receiver_dead=SafeStopReaction.NONE)
    receiver.set_dead(1.0, dead=True)
    transmitter.set(2.0, stop=True)
    receiver.advance(2.0)
    assert (receiver.heard, receiver.relays, receiver.supervision) == (RUN, RUN, RUN)


def test_switching_bypass_off_finds_a_link_that_was_lost_meanwhile_at_once() -> None:
    _, receiver = pair()
    receiver.set_bypass(1.0, bypass=True)
    receiver.set_link(2.0, up=False)
    receiver.set_bypass(4.0, bypass=False)
    assert (receiver.link, receiver.relays) == (LinkStatus.NONE, PAUSE)


def test_switching_bypass_on_hides_a_lost_link_and_closes_what_supervision_opened() -> None:
    _, receiver = pair()
    receiver.set_link(2.0, up=False)
    receiver.advance(3.0)
    assert receiver.relays == PAUSE
    receiver.set_bypass(3.0, bypass=True)
    assert (receiver.link, receiver.relays, receiver.is_silent) == (LinkStatus.BYPASS, RUN, True)


@pytest.mark.parametrize(
    ("pressed", "stuck", "later", "relays"),
    [
        (PAUSE, Relay.PAUSE, RUN, PAUSE),
        (PAUSE, Relay.STOP, BOTH, PAUSE),
        (STOP, Relay.STOP, RUN, STOP),
        (STOP, Relay.PAUSE, BOTH, STOP),
    ],
)
def test_each_relay_sticks_in_its_own_position(
    pressed: Demand, stuck: Relay, later: Demand, relays: Demand
) -> None:
    transmitter, receiver = pair()
    transmitter.set(1.0, pause=pressed.pause, stop=pressed.stop)
    receiver.stick(stuck, 1.0, stuck=True)
    transmitter.set(2.0, pause=later.pause, stop=later.stop)
    receiver.advance(2.0)
    assert (receiver.relays, receiver.wanted) == (relays, later)
    other = next(relay for relay in Relay if relay is not stuck)
    assert (receiver.is_stuck(stuck), receiver.is_stuck(other)) == (True, False)
    receiver.stick(other, 3.0, stuck=False)  # which did not stick
    receiver.stick(stuck, 3.0, stuck=False)
    assert receiver.relays == later


def test_two_moves_on_one_tick_are_both_heard_on_it() -> None:
    transmitter, receiver = pair()
    transmitter.set(5.0, pause=True)
    receiver.advance(5.0)
    transmitter.set(5.0, stop=True)
    assert receiver.next_change_s == 5.0
    receiver.advance(5.0)
    assert receiver.relays == BOTH


def test_a_press_inside_a_short_loss_is_heard_with_the_next_frame() -> None:
    transmitter, receiver = pair()
    receiver.set_link(1.0, up=False)
    transmitter.set(1.2, stop=True)
    receiver.advance(1.2)
    receiver.set_link(1.3, up=True)
    assert (receiver.relays, receiver.link) == (RUN, LinkStatus.GOOD)
    assert receiver.next_change_s == pytest.approx(1.35)
    receiver.advance(1.35)
    assert receiver.relays == STOP


def test_a_car_bound_while_a_frame_is_under_way_hears_it_when_it_arrives() -> None:
    transmitter = Transmitter()
    transmitter.set(1.0, stop=True)
    transmitter.set(2.0, pause=True)
    receiver = Receiver(SafeStopSettings(latency_s=0.2), transmitter, "1/late", 2.1)
    assert (receiver.relays, receiver.link) == (STOP, LinkStatus.GOOD)
    assert receiver.next_change_s == pytest.approx(2.2)
    receiver.advance(2.2)
    assert receiver.relays == BOTH


def test_which_frames_are_lost_follows_from_the_cars_key_alone() -> None:
    """Pinned: the same run on any machine, and after any change that does not say so."""
    _, receiver = pair(loss_share=0.5)
    lost = [number for number in range(40) if receiver._is_lost(number * 0.05)]
    assert lost == [0, 1, 2, 4, 6, 9, 10, 11, 12, 15, 17, 18, 20, 21, 24, 26, 27, 33, 34, 36, 39]


@pytest.mark.parametrize(
    ("loss_share", "timeout_s", "latency_s"),
    [(0.0, 0.5, 0.12), (0.5, 0.1, 0.0), (0.8, 0.3, 0.03), (0.9, 1.0, 0.12)],
)
def test_a_receiver_wakes_just_when_something_changes(
    loss_share: float, timeout_s: float, latency_s: float
) -> None:
    """XGV-71: on the very tick, and hardly ever else; a press and a silence of the radio come between."""
    transmitter = Transmitter()
    settings = SafeStopSettings(loss_share=loss_share, link_timeout_s=timeout_s, latency_s=latency_s)
    lazy, eager = (Receiver(settings, transmitter, "1/car", 0.0) for _ in range(2))
    woken, changed, seen = 0, 0, (eager.relays, eager.link)
    for tick in range(2100):
        now_s = tick / 100
        if tick in {533, 700, 1204}:
            transmitter.set(now_s, pause=tick == 533, stop=tick == 1204)
        if tick in {1650, 1810}:
            transmitter.set_silent(now_s, silent=tick == 1650)
        eager.advance(now_s)
        if tick_after(min(lazy.next_change_s, 1e6)) <= now_s:
            lazy.advance(now_s)
            woken += 1
        assert (lazy.relays, lazy.link) == (eager.relays, eager.link), tick
        changed += (eager.relays, eager.link) != seen
        seen = eager.relays, eager.link
    assert changed >= 5
    assert woken <= changed + 5  # at times to look further ahead


def test_a_silent_radio_is_lost_after_the_time_out_and_back_with_its_next_frame() -> None:
    transmitter, receiver = pair(latency_s=0.02)
    transmitter.set_silent(5.0, silent=True)  # the frame of 5.0 is sent
    assert receiver.next_change_s == pytest.approx(5.52)
    receiver.advance(5.51)
    assert receiver.link is LinkStatus.GOOD
    receiver.advance(5.52)
    assert (receiver.link, receiver.relays) == (LinkStatus.NONE, PAUSE)
    transmitter.set(6.0, stop=True)
    receiver.advance(6.02)
    assert receiver.relays == PAUSE
    transmitter.set_silent(7.0, silent=False)  # that of 7.0 is not
    assert receiver.next_change_s == pytest.approx(7.07)
    receiver.advance(7.07)
    assert (receiver.link, receiver.relays) == (LinkStatus.GOOD, STOP)


def test_a_control_is_released_with_its_last_holder() -> None:
    transmitter = Transmitter()
    for kind, held in (
        (InjectionKind.ESTOP_PAUSE, PAUSE),
        (InjectionKind.ESTOP_DISABLE, STOP),
        (InjectionKind.LINK, RUN),
    ):
        transmitter.use(kind, "a", 1.0, begins=True)
        transmitter.use(kind, "b", 2.0, begins=True)
        transmitter.use(kind, "a", 3.0, begins=False)
        transmitter.use(kind, "stranger", 3.0, begins=False)
        assert (transmitter.demand, transmitter.is_silent) == (held, kind is InjectionKind.LINK)
        transmitter.use(kind, "b", 4.0, begins=False)
        assert (transmitter.demand, transmitter.is_silent) == (RUN, False)
    assert set(TRANSMITTER_KINDS) == {
        InjectionKind.ESTOP_PAUSE,
        InjectionKind.ESTOP_DISABLE,
        InjectionKind.LINK,
    }


def test_a_transmitter_remembers_when_what_changed() -> None:
    transmitter = Transmitter()
    assert (transmitter.revision, transmitter.is_silent, transmitter.demand) == (0, False, RUN)
    assert not transmitter.has_changed_after(-1.0)
    transmitter.set(1.02, pause=True)
    transmitter.set(1.03, pause=True)  # a repeat
    transmitter.set(1.06, stop=True)
    assert transmitter.revision == 2
    assert [transmitter.num_moves(time_s) for time_s in (1.01, 1.02, 1.05, 1.06)] == [0, 1, 1, 2]
    assert [transmitter.demand_at(time_s) for time_s in (1.01, 1.02, 1.05, 1.06)] == [RUN, PAUSE, PAUSE, BOTH]
    assert [transmitter.has_changed_after(time_s) for time_s in (1.05, 1.06, 1.07)] == [True, False, False]
    transmitter.set_silent(2.0, silent=False)  # a repeat
    transmitter.set_silent(2.0, silent=True)
    transmitter.set_silent(3.0, silent=False)
    assert transmitter.revision == 4
    assert [transmitter.is_silent_at(time_s) for time_s in (1.9, 2.0, 2.01, 3.0, 3.01)] == [
        False,
        False,
        True,
        True,
        False,
    ]
    assert [transmitter.has_changed_after(time_s) for time_s in (2.99, 3.0)] == [True, False]
    assert transmitter.frame_before(1.03, 0.05) == pytest.approx(1.02)
    assert transmitter.frame_before(1.02, 0.05) == 1.02
    assert transmitter.frame_before(1.019, 0.05) == pytest.approx(1.0)
    assert transmitter.frame_before(0.15, 0.05) == pytest.approx(0.15)  # 0.15 is a little more than 3 x 0.05
    assert transmitter.frame_after(0.15, 0.05) == pytest.approx(0.2)
    assert transmitter.frame_after(1.0, 0.05) == pytest.approx(1.02)
    assert transmitter.frame_after(1.02, 0.05) == pytest.approx(1.05)


def test_a_press_that_is_due_and_unheard_is_missed_until_it_is_heard_or_let_go_xgv_68() -> None:
    transmitter, receiver = pair(latency_s=0.2)
    receiver.advance(1.0)
    receiver.set_link(1.0, up=False)
    transmitter.set(1.5, pause=True)
    receiver.advance(1.69)
    assert receiver.missed == RUN  # still on its way
    receiver.advance(1.7)
    assert receiver.missed == PAUSE
    transmitter.set(2.0, pause=False, stop=True)
    receiver.advance(2.2)
    assert receiver.missed == STOP
    receiver.set_link(2.3, up=True)
    receiver.advance(2.5)
    assert (receiver.heard, receiver.missed) == (STOP, RUN)
    receiver.set_link(2.6, up=False)
    transmitter.set(2.7, stop=False)
    receiver.advance(3.0)
    assert (receiver.heard, receiver.missed) == (STOP, RUN)  # an end that is missed is no missed press
    transmitter.set(3.1, pause=True)
    receiver.set_link(3.2, up=True)
    receiver.advance(3.35)
    assert (receiver.heard, receiver.missed) == (PAUSE, RUN)
    transmitter.set(3.4, pause=False)
    receiver.set_link(3.5, up=False)
    receiver.advance(3.7)
    assert (receiver.heard, receiver.missed) == (PAUSE, RUN)


def test_a_silence_that_has_ended_at_the_transmitter_is_still_to_come_at_the_receiver() -> None:
    """The latency is longer than the time-out: the link is lost a second after the radio has come back."""
    transmitter, receiver = pair(latency_s=1.0)
    transmitter.set_silent(5.02, silent=True)
    transmitter.set_silent(5.82, silent=False)
    assert receiver.next_change_s == pytest.approx(6.5)  # the frame of 5.00 came at 6.00
    receiver.advance(6.5)
    assert receiver.link is LinkStatus.NONE
    assert receiver.next_change_s == pytest.approx(6.85)
    receiver.advance(6.85)
    assert receiver.link is LinkStatus.GOOD
