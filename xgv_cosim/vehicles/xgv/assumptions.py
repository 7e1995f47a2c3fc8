"""The ledger of the XGV: every open reading that this version implements, and what exercises it."""

from __future__ import annotations

from xgv_cosim.vehicles.base import Assumption
from xgv_cosim.vehicles.xgv.settings import XgvSettings

_PAUSES = ("safety_mode:software_pause", "safety_mode:estop_pause")
_TIMEOUTS = ("error:9157", "error:9158")
_RELEASES = (
    "safety_mode:manual_override",
    "safety_mode:emergency_manual_override",
    "safety_mode:estop_disable",
)

# Rule, settings key (empty: none), evidence, reading, facts that exercise it.
_LEDGER = (
    (
        "XGV-08",
        "",
        "E",
        "Component numbers: Primitive Driver 33, Motion Profile Driver 10, instance 1, node 1.",
        ("bound",),
    ),
    (
        "XGV-18",
        "control_mode_both_clients",
        "D",
        "Figure A is missing: a client controls the Primitive Driver alone: wrench efforts; a client controls "
        "the Motion Profile Driver and that the Primitive Driver: motion profiles; all else is software pause. "
        "The key decides for one client that controls both.",
        ("control_mode",),
    ),
    (
        "XGV-19",
        "mpd_request_period_s",
        "D",
        "The Motion Profile Driver asks for the Primitive Driver with its own controller's authority, again "
        "after this period while it is denied, and gives it back when it loses its controller.",
        ("component_control:Primitive Driver: Motion Profile Driver",),
    ),
    (
        "XGV-20",
        "",
        "E",
        "A request with a higher authority than the controller's pre-empts him; an equal one is rejected.",
        ("component_control",),
    ),
    (
        "XGV-25",
        "",
        "E",
        "Resume acts in standby only; Standby in ready only; Clear Emergency leads to standby from any status.",
        ("component_status",),
    ),
    (
        "XGV-25",
        "",
        "D",
        "A bound car starts in standby. The Primitive Driver takes Resume and Standby also from the controller "
        "of the Motion Profile Driver that controls it.",
        ("component_status:Primitive Driver: ready", "component_status:Primitive Driver: standby"),
    ),
    (
        "XGV-25",
        "initialize_s",
        "D",
        "Reset leads to initialize, and after this time to standby.",
        (
            "component_status:Primitive Driver: initialize",
            "component_status:Motion Profile Driver: initialize",
        ),
    ),
    (
        "XGV-26",
        "",
        "D",
        "Figure B is missing: the safety mode is the greatest of those asked for: stop relay or button, "
        "emergency override, override, pause relay, then door, error, steering, control and ready mode.",
        ("safety_mode",),
    ),
    (
        "XGV-31",
        "",
        "D",
        "The full brake is held at standstill as long as the disable lasts, with the engine on or off.",
        ("safety_mode:estop_disable",),
    ),
    (
        "XGV-32",
        "",
        "D",
        "Inactive has no wire code; going inactive releases even the full brake of a disable.",
        ("safety_mode:inactive",),
    ),
    (
        "XGV-35",
        "pause_no_command_steering",
        "D",
        "What steering does in a pause without a live command.",
        ("control_mode:software_pause", *_TIMEOUTS),
    ),
    (
        "XGV-36",
        "pause_decel_mps2",
        "D",
        "The user's constant deceleration acts in both pauses, without a limit of jerk.",
        _PAUSES,
    ),
    (
        "XGV-37",
        "",
        "D",
        "Re-arming as the note says, literally: the mode follows devices, control and status, and nothing "
        "latches; when a stop demand ends the car goes on by itself.",
        ("injection_ended",),
    ),
    (
        "XGV-38",
        "",
        "D",
        "Warnings and 9138 do not set the bit 'paused due to errors'; other errors do while they are raised.",
        ("error",),
    ),
    (
        "XGV-41",
        "partial_allow_both",
        "D",
        "Whether both axes may be manual at once.",
        ("partial_mode",),
    ),
    (
        "XGV-42",
        "",
        "D",
        "The SafeStop link is reported as good; the radio itself is not modelled in this version.",
        ("bound",),
    ),
    (
        "XGV-43",
        "wrench_timeout_s",
        "E",
        "A command lives as long as its motion's duration, or this long for wrench efforts; then 9157 or 9158 "
        "pauses the car until a fresh command is accepted.",
        _TIMEOUTS,
    ),
    (
        "XGV-50",
        "",
        "D",
        "Software pause is reported as 2; the note gives 2 to 7 no further meaning.",
        ("safety_mode:software_pause",),
    ),
    (
        "XGV-58",
        "",
        "E",
        "Motion profiles outside the ranges that the message can carry are refused on every link.",
        ("command_refused",),
    ),
    (
        "XGV-63",
        "",
        "D",
        "Anyone may set the emergency status, only the controller clears it; it makes the ready mode software "
        "pause and does nothing more.",
        ("component_status:Primitive Driver: emergency", "component_status:Motion Profile Driver: emergency"),
    ),
    (
        "XGV-64",
        "",
        "D",
        "Under an override and for the axes of the partial mode the driver has the car at once; a disable "
        "comes without his doing.",
        (*_RELEASES, "partial_mode"),
    ),
    (
        "XGV-65",
        "",
        "D",
        "A controller that falls silent keeps control in this version; its commands expire (XGV-43).",
        ("injection:cmd_loss",),
    ),
    (
        "XGV-70",
        "",
        "D",
        "Before the first accepted command the car stops and holds; a change of control mode or of the "
        "controller drops the command in force.",
        ("control_mode",),
    ),
    (
        "commands",
        "",
        "D",
        "A command is accepted when its sender controls the component, it fits the control mode and its "
        "values are valid, whatever the safety mode.",
        ("handover", "injection"),
    ),
)


def ledger(settings: XgvSettings) -> tuple[Assumption, ...]:
    """Return every open reading with its value in force; keys are written ``xgv.<setting>``."""
    values = settings.as_text()
    return tuple(
        Assumption(rule, f"xgv.{key}" if key else "", values[key] if key else "", evidence, text, facts)
        for rule, key, evidence, text, facts in _LEDGER
    )
