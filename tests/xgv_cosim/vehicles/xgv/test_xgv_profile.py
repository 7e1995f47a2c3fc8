"""The XGV as a profile: injections, settings, partial mode, ledger."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from xgv_cosim.actuation import Driver
from xgv_cosim.errors import ScenarioError
from xgv_cosim.injection import InjectionKind
from xgv_cosim.scenario.safestop_section import SafeStopSection
from xgv_cosim.scenario.xgv_section import XgvSection
from xgv_cosim.vehicles.base import StopSettings, VehicleProfile
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.settings import BothClients, PauseSteering, XgvSettings

if TYPE_CHECKING:
    from xgv_cosim.endpoint import Endpoint

PROFILE = XgvProfile()


def test_it_is_a_vehicle_profile() -> None:
    profile: VehicleProfile = PROFILE
    endpoint: Endpoint = profile.new_endpoint("xgv_0", 0.0)
    assert (profile.name, endpoint.device_bits) == ("xgv", 0)


def test_injections_set_the_bits_of_the_note_xgv_52() -> None:
    bits = {kind: effect.device_bits for kind, effect in PROFILE.effects.items() if effect.device_bits}
    assert bits == {
        InjectionKind.OVERRIDE: 1 << 0,
        InjectionKind.ESTOP_PAUSE: 1 << 1,
        InjectionKind.ESTOP_DISABLE: 1 << 2,
        InjectionKind.ESTOP_BUTTON: 1 << 5,
        InjectionKind.DOOR: 1 << 6,
        InjectionKind.EMO: 1 << 8,
        InjectionKind.STEERING_UNINITIALISED: 1 << 9,
        InjectionKind.STEERING_AWAITS_USER: 1 << 10,
    }
    assert PROFILE.effects[InjectionKind.ERROR].raises_error
    unsupported = set(InjectionKind) - set(PROFILE.effects)
    assert unsupported == {
        InjectionKind.PAUSE_REQUEST,
        InjectionKind.SHUTDOWN,
        InjectionKind.REINIT,
    }


def test_an_idle_car_reports_a_good_link_xgv_42() -> None:
    assert PROFILE.base_device_bits == 2 << 3


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0, "inactive"),
        (1, "drive_by_wire"),
        *((code, "software_pause") for code in range(2, 8)),
        (8, "estop_pause"),
        (9, "manual_override"),
        (10, "emergency_manual_override"),
        (11, "estop_disable"),
    ],
)
def test_names_of_safety_modes_xgv_50(code: int, name: str) -> None:
    assert PROFILE.safety_mode_name(code) == name


def test_reserved_codes_have_no_name_xgv_50() -> None:
    with pytest.raises(ValueError, match="12"):
        PROFILE.safety_mode_name(12)


def test_stop_settings_come_from_the_users_settings_xgv_33_xgv_35_xgv_36() -> None:
    assert PROFILE.stop_settings == StopSettings(2.5, 0.5, centres_without_command=False)
    settings = XgvSettings(
        pause_decel_mps2=4.0, pause_hold_brake=0.6, pause_no_command_steering=PauseSteering.CENTRE
    )
    assert XgvProfile(settings).stop_settings == StopSettings(4.0, 0.6, centres_without_command=True)


@pytest.mark.parametrize("bits", [0, 1, 2])
def test_partial_modes_of_the_note_need_a_driver_xgv_39_xgv_41(bits: int) -> None:
    PROFILE.validate_partial_mode(bits, Driver.RIDER)
    PROFILE.validate_partial_mode(bits, Driver.NONE, forced=True)
    if bits:
        with pytest.raises(ScenarioError, match="nobody aboard"):
            PROFILE.validate_partial_mode(bits, Driver.NONE)


def test_both_axes_manual_only_where_allowed_xgv_41() -> None:
    with pytest.raises(ScenarioError, match=r"xgv\.partial\.allow_both"):
        PROFILE.validate_partial_mode(3, Driver.RIDER)
    XgvProfile(XgvSettings(partial_allow_both=True)).validate_partial_mode(3, Driver.RIDER)


@pytest.mark.parametrize("bits", [4, -1, 7])
def test_reserved_partial_bits_are_refused_xgv_51(bits: int) -> None:
    with pytest.raises(ScenarioError, match="expected 0"):
        XgvProfile(XgvSettings(partial_allow_both=True)).validate_partial_mode(bits, Driver.RIDER)


def test_all_wrong_settings_are_told_at_once() -> None:
    with pytest.raises(ScenarioError) as caught:
        XgvSettings(pause_decel_mps2=0.0, pause_hold_brake=float("nan"), wrench_timeout_s=float("inf"))
    assert len(caught.value.problems) == 3
    assert "pause_decel_mps2: got 0.0" in str(caught.value)


def test_settings_take_plain_words_and_refuse_others() -> None:
    settings = XgvSettings(
        pause_no_command_steering="hold_angle",  # type: ignore[arg-type]
        control_mode_both_clients="wrench_efforts",  # type: ignore[arg-type]
    )
    assert settings.pause_no_command_steering is PauseSteering.HOLD_ANGLE
    assert settings.control_mode_both_clients is BothClients.WRENCH_EFFORTS
    with pytest.raises(ScenarioError, match="hold_curvature, hold_angle, centre"):
        XgvSettings(pause_no_command_steering="straight")  # type: ignore[arg-type]


def test_ledger_shows_values_in_force_and_what_exercises_them() -> None:
    profile = XgvProfile(
        XgvSettings(wrench_timeout_s=0.25, control_mode_both_clients=BothClients.WRENCH_EFFORTS)
    )
    ledger = profile.assumptions()
    values = {entry.key: entry.value for entry in ledger if entry.key}
    assert values["xgv.wrench_timeout_s"] == "0.25"
    assert values["xgv.control_mode.both_clients"] == "wrench_efforts"
    assert all(entry.facts and entry.text and entry.evidence in {"D", "E"} for entry in ledger)
    elsewhere = {entry.key for entry in ledger if entry.key and not entry.value}
    assert elsewhere == {"world.contact", "bind.plant.imperfections"}  # no settings of the profile
    assert all(bool(entry.key) == bool(entry.value) for entry in ledger if entry.key not in elsewhere)


def test_ledger_keys_are_keys_of_a_scenario() -> None:
    roots = {"xgv": XgvSection(), "safestop": SafeStopSection()}
    for entry in PROFILE.assumptions():
        if entry.key and entry.value:
            first, *parts = entry.key.split(".")
            section: object = roots[first]
            for part in parts:
                section = getattr(section, part)
            by_preset = "auto" if section is None and first == "xgv" and parts[0] == "rearm" else None
            assert (by_preset or str(section)) == entry.value
