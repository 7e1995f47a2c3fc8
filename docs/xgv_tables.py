"""Tables of the XGV for the documentation, computed from the rules, registries and models in the code."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from markdown_parts import member_docs, rules_in, table, words
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from xgv_diagrams import plain

from jaus import component
from jaus.address import ComponentId, JausAddress
from jaus.component import (
    CONTROL_TRANSITIONS,
    PERMITTED_STATUS_COMMANDS,
    STATUS_TRANSITIONS,
    ComponentStatus,
    StatusCommand,
)
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim import injection
from xgv_cosim.actuation import LostFunction
from xgv_cosim.cli.modes import mode_words, sections
from xgv_cosim.endpoint import CommandStatus, Endpoint, RequestControl, StackMessage
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.scenario.safestop_section import SafeStopSection
from xgv_cosim.scenario.sections import BindSection
from xgv_cosim.scenario.xgv_section import XgvSection
from xgv_cosim.vehicles.xgv import modes as rules
from xgv_cosim.vehicles.xgv import rearm as rearming
from xgv_cosim.vehicles.xgv.assumptions import ledger
from xgv_cosim.vehicles.xgv.errors import COMMAND_TIMEOUTS, ERRORS, XgvError
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.rearm import PRESETS, WORDS, Rearm, RearmCause, RearmSettings
from xgv_cosim.vehicles.xgv.settings import ErrorLatch, XgvSettings

PD, MPD = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER
_ALICE, _BOB = JausAddress(1, 2, 4, 1), JausAddress(1, 3, 4, 1)
Sent = tuple[JausAddress, StackMessage]
"""Who sends, and what."""
_NAMES = {str(_ALICE): "client A", str(_BOB): "client B"}

_DEVICE_BITS = {
    "manual override engaged": rules.MANUAL_OVERRIDE_ENGAGED,
    "SafeStop pause relay open": rules.SAFESTOP_PAUSE,
    "SafeStop stop relay open": rules.SAFESTOP_STOP,
    "emergency stop button pressed": rules.ESTOP_BUTTON,
    "door or liftgate open": rules.DOOR_OPEN,
    "paused due to errors": rules.ERRORS_DETECTED,
    "emergency manual override engaged": rules.EMERGENCY_OVERRIDE_ENGAGED,
    "steering requires initialisation": rules.STEERING_UNINITIALISED,
    "steering initialisation awaits the user": rules.STEERING_AWAITS_USER,
}

_UNITS = (
    ("_mps2", "m/s²"),
    ("_mps3", "m/s³"),
    ("_mps", "m/s"),
    ("_per_m_s", "1/(m·s)"),
    ("_per_m", "1/m"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_s", "s"),
    ("_m", "m"),
    ("_share", "share 0 to 1"),
)


def modes_page(number: int) -> str:
    """Return one table of ``xgv-cosim modes``."""
    section = sections(XgvSettings())[number]
    return table(section.header, section.rows)


def endpoint_after(*messages: Sent) -> Endpoint:
    """Return the endpoint of a car that was just bound and then got these messages."""
    endpoint = XgvProfile().new_endpoint("documentation", 0.0)
    for sender, message in messages:
        endpoint.receive(message, sender, 0.0)
    return endpoint


def situations() -> str:
    """Return what clients did, the modes that come of it, and the reason that the car gives."""

    def asks(client: JausAddress, driver: ComponentId, authority: int = 6) -> Sent:
        return client, RequestControl(driver, authority)

    def resumes(client: JausAddress, driver: ComponentId) -> Sent:
        return client, CommandStatus(driver, StatusCommand.RESUME)

    stories: tuple[tuple[str, tuple[Sent, ...]], ...] = (
        ("nothing yet", ()),
        ("A takes the Primitive Driver", (asks(_ALICE, PD),)),
        ("... and resumes it", (asks(_ALICE, PD), resumes(_ALICE, PD))),
        ("A takes the Motion Profile Driver", (asks(_ALICE, MPD),)),
        ("... and resumes it", (asks(_ALICE, MPD), resumes(_ALICE, MPD))),
        (
            "... and the Primitive Driver too",
            (asks(_ALICE, MPD), resumes(_ALICE, MPD), resumes(_ALICE, PD)),
        ),
        ("A has the Primitive Driver, B takes the Motion Profile one", (asks(_ALICE, PD), asks(_BOB, MPD))),
        ("... with more authority than A", (asks(_ALICE, PD), asks(_BOB, MPD, 7))),
        (
            "A drives by motion profiles, B takes the Primitive Driver with more authority",
            (asks(_ALICE, MPD), resumes(_ALICE, MPD), resumes(_ALICE, PD), asks(_BOB, PD, 7)),
        ),
    )
    rows = []
    for story, messages in stories:
        endpoint = endpoint_after(*messages)
        reason = "; ".join(endpoint.reasons(rules.LINK_GOOD))
        for address, name in _NAMES.items():
            reason = reason.replace(address, name)
        control, ready = ControlMode(endpoint.control_mode), ReadyMode(endpoint.ready_mode)
        rows.append((story, mode_words(control), mode_words(ready), reason))
    return table(("what clients did", "control mode", "ready mode", "reason"), rows)


def holders() -> str:
    """Return the control mode for every pair of holders of the two drivers (XGV-18)."""
    own = JausAddress(1, 1, MPD, 1)
    choices = (
        ("nobody", None),
        ("client A", _ALICE),
        ("client B", _BOB),
        ("the Motion Profile Driver", own),
    )
    rows = [
        (
            pd_name,
            *(mode_words(rules.resolve_control_mode(pd, mpd, mpd_address=own)) for _, mpd in choices[:3]),
        )
        for pd_name, pd in choices
    ]
    names = [f"Motion Profile Driver: {name}" for name, _ in choices[:3]]
    return table(("Primitive Driver", *names), rows)


def safety_devices() -> str:
    """Return each safety device alone: its bit, the mode, and the reason that the car gives (XGV-52)."""
    endpoint = endpoint_after(
        (_ALICE, RequestControl(MPD)),
        (_ALICE, CommandStatus(MPD, StatusCommand.RESUME)),
        (_ALICE, CommandStatus(PD, StatusCommand.RESUME)),
    )
    return table(
        ("device", "bit", "alone it causes", "reason in the log"),
        [
            (
                name,
                str(bit.bit_length() - 1),
                mode_words(rules.resolve_safety_mode(bit, software_ready=True)),
                endpoint.reasons(bit)[0],
            )
            for name, bit in sorted(_DEVICE_BITS.items(), key=lambda item: item[1])
        ],
    )


def wire_codes() -> str:
    """Return the codes of the three modes in Report Vehicle Mode (XGV-48 to XGV-50)."""
    return table(
        ("mode", "values"),
        [
            (name, ", ".join(f"{int(mode)} {mode_words(mode)}" for mode in kind))
            for name, kind in (
                ("control mode", ControlMode),
                ("ready mode", ReadyMode),
                ("safety mode", SafetyMode),
            )
        ],
    )


def control_messages() -> str:
    """Return the decision table of component control (XGV-19, XGV-20)."""
    situated = member_docs(component, "Situation")
    becomes = {
        name: text or "nothing changes" for name, text in member_docs(component, "ControlEffect").items()
    }
    return table(
        ("message", "situation", "who is told", "what becomes of the control"),
        [
            (plain(message), situated[situation.name], plain(reply), becomes[effect.name])
            for (situation, message), (reply, effect) in CONTROL_TRANSITIONS.items()
        ],
    )


def status_commands() -> str:
    """Return the status after each command (XGV-25); a dash: no effect."""
    return table(
        ("status", *(plain(command) for command in StatusCommand)),
        [
            (plain(status), *(_status_after(status, command) for command in StatusCommand))
            for status in ComponentStatus
        ],
    )


def _status_after(status: ComponentStatus, command: StatusCommand) -> str:
    after = STATUS_TRANSITIONS.get((status, command), status)
    return "-" if after is status else plain(after)


def permissions() -> str:
    """Return who may send which status command (XGV-10, XGV-63)."""
    return table(
        ("the sender is", *(plain(command) for command in StatusCommand)),
        [
            (plain(standing), *(_yes(command in permitted) for command in StatusCommand))
            for standing, permitted in PERMITTED_STATUS_COMMANDS.items()
        ],
    )


def _yes(holds: bool) -> str:
    return "yes" if holds else "-"


def injections() -> str:
    """Return each injection, what it does to an XGV, and the mode that it alone causes."""
    meanings = member_docs(injection, "InjectionKind")
    effects = XgvProfile().effects
    rows = []
    for kind in InjectionKind:
        what, ids = rules_in(meanings[kind.name])
        mode = ""
        if kind in effects:
            bits = effects[kind].device_bits
            what = words(effects[kind].text)
            mode = mode_words(rules.resolve_safety_mode(bits, software_ready=True)) if bits else ""
        else:
            what = f"unsupported, the event log says so: {what}"
        rows.append((f"`{kind.value}`", what, mode, ids))
    return table(("kind", "what happens", "alone it causes", "rules"), rows)


def operator_actions() -> str:
    """Return what an operator can do at the vehicle beside the devices."""
    meanings = member_docs(injection, "OperatorAction")
    return table(
        ("action", "what it does", "rules"),
        [(f"`{action.value}`", *rules_in(meanings[action.name])) for action in OperatorAction],
    )


def rearm() -> str:
    """Return what each cause of a stop needs before the car moves again, by preset (XGV-37)."""
    return table(
        ("key", "after", *(f"`{preset.value}`" for preset in PRESETS)),
        [
            (
                f"`xgv.rearm.{cause.value}`",
                WORDS[cause],
                *(f"`{RearmSettings(preset).of(cause).value}`" for preset in PRESETS),
            )
            for cause in RearmCause
        ],
    )


def rearm_words() -> str:
    """Return what the values of the keys for re-arming mean."""
    meanings = member_docs(rearming, "Rearm")
    return table(("value", "what the car needs"), [(f"`{way.value}`", meanings[way.name]) for way in Rearm])


def errors() -> str:
    """Return every error code with what it does (XGV-38)."""
    effects = XgvSettings().error_effects
    return table(
        ("code", "text", "kind", "pauses the car", "takes away", "is raised until"),
        [
            (
                str(error.code),
                error.text,
                "warning" if error.is_warning else "error",
                _yes(error.pauses),
                ", ".join(plain(lost) for lost in LostFunction if effects.get(error.code, 0) & lost),
                _until(error),
            )
            for _, error in sorted(ERRORS.items())
        ],
    )


def _until(error: XgvError) -> str:
    if error.code in COMMAND_TIMEOUTS:
        return "a fresh command is accepted"
    if error.is_hardware and XgvSettings().errors_latch is ErrorLatch.HARDWARE:
        return "its cause is gone and the operator has cleared it"
    return "its cause is gone"


def xgv_keys() -> str:
    """Return every key of section ``xgv`` of a scenario."""
    return _keys(XgvSection, "xgv")


def safestop_keys() -> str:
    """Return every key of section ``safestop`` of a scenario."""
    return _keys(SafeStopSection, "safestop")


def bind_keys() -> str:
    """Return every key of an entry of section ``bind``."""
    return _keys(BindSection, "bind")


def _keys(section: type[BaseModel], name: str) -> str:
    return table(("key", "default", "unit or values", "meaning", "rules"), sorted(_key_rows(section, name)))


def _key_rows(section: type[BaseModel], prefix: str, above: str = "") -> Iterable[tuple[str, ...]]:
    """Yield one row per key; a key without rules of its own has those of its section."""
    for name, field in section.model_fields.items():
        key = f"{prefix}.{field.alias or name}"
        kind = field.annotation
        meaning, ids = rules_in(words(field.description or ""))
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from _key_rows(kind, key, ids or rules_in(words(kind.__doc__ or ""))[1])
        else:
            yield f"`{key}`", _default(field), _values(name, field), meaning, ids or above


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    value = field.get_default(call_default_factory=True)
    if value is None or value in ((), {}):
        return "none"
    if isinstance(value, Enum):
        return f"`{value.value}`"
    if isinstance(value, tuple):
        return f"`[{', '.join(map(str, value))}]`"
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


def _values(name: str, field: FieldInfo) -> str:
    choices = list(_choices(field.annotation))
    if choices:
        return ", ".join(f"`{choice}`" for choice in choices)
    unit = next((unit for suffix, unit in _UNITS if name.endswith(suffix)), "")
    bounds = []
    for limit in field.metadata:
        for sign, word in (("gt", "more than"), ("ge", "from"), ("lt", "less than"), ("le", "up to")):
            if getattr(limit, sign, None) is not None:
                bounds.append(f"{word} {getattr(limit, sign):g}")
    return ", ".join(part for part in (unit, " ".join(bounds)) if part)


def _choices(kind: Any) -> Iterable[str]:  # noqa: ANN401 - any annotation of a model
    if isinstance(kind, type) and issubclass(kind, Enum):
        yield from (str(member.value) for member in kind)
    elif kind is bool:
        yield from ("false", "true")
    elif get_origin(kind) is Literal:
        yield from (str(choice) for choice in get_args(kind))
    elif get_origin(kind) in {Union, UnionType, tuple, Annotated, dict, list, frozenset}:
        for part in get_args(kind):
            yield from _choices(part)


def assumptions() -> str:
    """Return the ledger: every open reading, its key and default, and what shows it in an event log."""
    return table(
        ("rule", "evidence", "reading", "key", "default", "exercised by"),
        [
            (
                entry.rule,
                entry.evidence,
                words(entry.text),
                f"`{entry.key}`" if entry.key else "",
                f"`{entry.value}`" if entry.key else "",
                ", ".join(f"`{fact}`" for fact in entry.facts),
            )
            for entry in ledger(XgvSettings())
        ],
    )
