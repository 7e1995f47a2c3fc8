"""The XGV's safety devices as one object per car: bits, faults, masked stops, causes of standby."""

from __future__ import annotations

from itertools import combinations

import pytest

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.vehicles.base import SafetyDevices
from xgv_cosim.vehicles.xgv.devices import EFFECTS, XgvDevices
from xgv_cosim.vehicles.xgv.modes import resolve_safety_mode
from xgv_cosim.vehicles.xgv.rearm import Rearm, RearmSettings
from xgv_cosim.vehicles.xgv.settings import XgvSettings

GOOD = 2 << 3
K = InjectionKind


def devices(settings: XgvSettings | None = None) -> XgvDevices:
    made: SafetyDevices = XgvDevices(settings or XgvSettings(), "1/xgv_0", 0.0)
    assert isinstance(made, XgvDevices)
    return made


def begin(car: XgvDevices, *kinds: InjectionKind, at_s: float = 1.0) -> XgvDevices:
    for kind in kinds:
        car.apply(kind, None, at_s, begins=True)
    return car


@pytest.mark.parametrize("kind", list(EFFECTS))
def test_each_injection_sets_its_bits_at_once_and_takes_them_back_xgv_14_xgv_52(kind: InjectionKind) -> None:
    car = devices()
    car.apply(kind, 9109 if kind is K.ERROR else None, 1.0, begins=True)
    expected = {K.BYPASS: 1 << 3, K.RECEIVER_DEAD: 0b110}.get(kind, GOOD | EFFECTS[kind].device_bits)
    assert car.bits == expected
    car.apply(kind, 9109 if kind is K.ERROR else None, 2.0, begins=False)
    car.handle_deadline(2.05)
    assert car.bits == GOOD
    assert car.errors == frozenset()
    assert car.is_active
    assert not car.is_frozen
    assert car.hears_stack


def test_wired_devices_combine_xgv_14() -> None:
    wired = [kind for kind in EFFECTS if EFFECTS[kind].device_bits]
    for several in combinations(wired, 3):
        bits = GOOD
        for kind in several:
            bits |= EFFECTS[kind].device_bits
        assert begin(devices(), *several).bits == bits


def test_a_lost_link_raises_9138_which_goes_with_it_xgv_42() -> None:
    car = begin(devices(), K.LINK)
    assert car.errors == frozenset()
    assert car.next_deadline_s == pytest.approx(1.5)
    (event,) = car.handle_deadline(1.5)
    assert (event.kind, event.before, event.after) == ("safestop_link", "good", "none")
    assert (car.bits, car.errors) == (0b10, frozenset({9138}))
    car.apply(K.LINK, None, 3.0, begins=False)
    (event,) = car.handle_deadline(3.05)
    assert event.after == "good"
    assert (car.bits, car.errors) == (GOOD, frozenset())


def test_bypass_hides_a_lost_link_but_no_stop_xgv_42() -> None:
    car = begin(devices(), K.BYPASS, K.LINK, K.ESTOP_BUTTON)
    car.handle_deadline(1.5)
    assert (car.bits, car.errors) == (1 << 3 | 1 << 5, frozenset())


def test_several_codes_last_on_their_own() -> None:
    car = devices()
    for code in (9109, 9103):
        car.apply(K.ERROR, code, 1.0, begins=True)
    car.apply(K.ERROR, 9109, 2.0, begins=False)
    assert car.errors == frozenset({9103})


def test_the_operator_initialises_the_steering_xgv_69() -> None:
    car = begin(devices(), K.STEERING_UNINITIALISED, K.STEERING_AWAITS_USER)
    assert resolve_safety_mode(car.bits, software_ready=True) is SafetyMode.SOFTWARE_PAUSE
    car.operate(OperatorAction.INITIALISE_STEERING, 2.0)
    assert car.bits == GOOD


def mode_of(car: XgvDevices) -> SafetyMode:
    return resolve_safety_mode(car.bits, software_ready=True, active=car.is_active)


MASKED = [
    ((K.ESTOP_PAUSE, K.OVERRIDE), {"SafeStop pause relay": "manual override"}),
    ((K.ESTOP_PAUSE, K.EMO), {"SafeStop pause relay": "emergency manual override"}),
    ((K.ESTOP_PAUSE, K.INACTIVE), {"SafeStop pause relay": "system not active"}),
    ((K.ESTOP_DISABLE, K.INACTIVE), {"SafeStop stop relay": "system not active"}),
    ((K.ESTOP_BUTTON, K.INACTIVE), {"emergency stop button": "system not active"}),
    ((K.RELAY_STUCK_STOP, K.ESTOP_DISABLE), {"SafeStop stop": "stop relay stuck"}),
    ((K.RELAY_STUCK_PAUSE, K.ESTOP_PAUSE), {"SafeStop pause": "pause relay stuck"}),
    ((K.ESTOP_PAUSE,), {}),
    ((K.ESTOP_DISABLE, K.OVERRIDE), {}),
    ((K.ESTOP_BUTTON, K.EMO), {}),
    ((K.DOOR, K.OVERRIDE), {}),
]


@pytest.mark.parametrize(("kinds", "masked"), MASKED)
def test_masked_stop_demands_xgv_68(kinds: tuple[InjectionKind, ...], masked: dict[str, str]) -> None:
    car = begin(devices(), *kinds)
    assert car.masked_stops(mode_of(car)) == masked


def test_a_frozen_controller_masks_every_stop_xgv_67_xgv_68() -> None:
    car = begin(devices(), K.FROZEN, K.ESTOP_DISABLE, K.ESTOP_BUTTON)
    assert car.masked_stops(SafetyMode.DRIVE_BY_WIRE) == {
        "SafeStop stop relay": "controller frozen",
        "emergency stop button": "controller frozen",
    }


def test_bypass_masks_the_supervision_of_a_lost_link_xgv_42_xgv_68() -> None:
    car = begin(devices(), K.BYPASS, K.LINK)
    assert car.masked_stops(SafetyMode.DRIVE_BY_WIRE) == {}
    car.handle_deadline(1.5)
    assert car.masked_stops(SafetyMode.DRIVE_BY_WIRE) == {"SafeStop link loss": "bypass"}
    begin(car, K.ESTOP_DISABLE, at_s=2.0)
    assert car.masked_stops(SafetyMode.DRIVE_BY_WIRE) == {
        "SafeStop link loss": "bypass",
        "SafeStop stop": "radio link lost",
    }


@pytest.mark.parametrize("reserved", range(2, 8))
def test_every_code_of_software_pause_stops_the_car_xgv_50_xgv_68(reserved: int) -> None:
    assert begin(devices(), K.ESTOP_PAUSE).masked_stops(reserved) == {}


def test_inactive_during_a_disable_says_that_the_brake_is_released_xgv_32() -> None:
    for kind in (K.ESTOP_DISABLE, K.ESTOP_BUTTON):
        car = begin(devices(), kind)
        (event,) = car.apply(K.INACTIVE, None, 2.0, begins=True)
        assert (event.kind, event.before, event.after) == ("disable_released", "estop_disable", "inactive")
    assert devices().apply(K.INACTIVE, None, 2.0, begins=True) == []
    frozen = begin(devices(), K.FROZEN, K.ESTOP_DISABLE)  # never was in disable
    assert frozen.apply(K.INACTIVE, None, 2.0, begins=True) == []


def test_a_frozen_or_inactive_controller_gives_its_own_reasons_xgv_32_xgv_67() -> None:
    computed = ("SafeStop pause relay",)
    assert devices().reasons(computed) == computed
    assert begin(devices(), K.INACTIVE, K.FROZEN).reasons(computed) == ("system not active",)
    assert begin(devices(), K.FROZEN).reasons(computed) == ("controller frozen: last outputs held",)
    assert begin(devices(), K.FROZEN, K.EMO).reasons(computed)[0] == "emergency manual override"
    lost = begin(devices(), K.LINK)
    lost.handle_deadline(1.5)
    assert lost.reasons(computed) == ("SafeStop pause relay, link lost",)


CAUSES = [
    ("estop_pause", (K.ESTOP_PAUSE,), 0),
    ("disable", (K.ESTOP_DISABLE,), 0),
    ("disable", (K.ESTOP_BUTTON,), 0),
    ("link_loss", (K.LINK,), 0),
    ("override", (K.OVERRIDE,), 0),
    ("override", (K.EMO,), 0),
    ("error", (), 1 << 7),
    ("door", (K.DOOR,), 0),
]


@pytest.mark.parametrize(("cause", "kinds", "endpoint_bits"), CAUSES)
def test_each_stop_is_its_own_cause_of_standby_xgv_37(
    cause: str, kinds: tuple[InjectionKind, ...], endpoint_bits: int
) -> None:
    for name in dict.fromkeys(row[0] for row in CAUSES):
        settings = XgvSettings(rearm=RearmSettings(**{name: Rearm.OPERATOR}))
        car = begin(devices(settings), *kinds)
        car.handle_deadline(1.5)
        assert bool(car.follow_stops(endpoint_bits)) == (name == cause), name
        assert bool(car.resume_refusal) == (name == cause)
    car.follow_stops(0)


def test_rearming_says_what_it_did_xgv_37() -> None:
    car = begin(devices(XgvSettings(rearm=RearmSettings(disable=Rearm.OPERATOR))), K.ESTOP_BUTTON)
    car.follow_stops(0)
    (event,) = car.operate(OperatorAction.REARM, 2.0)
    assert event.reasons == ("nothing to re-arm", "Resume is refused: the e-stop disable lasts")
    car.apply(K.ESTOP_BUTTON, None, 3.0, begins=False)
    car.follow_stops(0)
    (event,) = car.operate(OperatorAction.REARM, 4.0)
    assert event.reasons == ("after the e-stop disable",)
    assert car.resume_refusal == ""


def test_a_preemption_is_a_cause_of_its_own_xgv_66() -> None:
    assert devices().control_preempted() == ""
    car = devices(XgvSettings(rearm=RearmSettings(preemption=Rearm.RESUME_AFTER_RELEASE)))
    assert "pre-emption" in car.control_preempted()
    assert car.resume_refusal == ""
