"""The ledger of the XGV: every open reading that this version implements, and what exercises it."""

from __future__ import annotations

from xgv_cosim.vehicles.base import Assumption
from xgv_cosim.vehicles.xgv.control_readings import CONTROL_READINGS
from xgv_cosim.vehicles.xgv.readings import SAFETY_READINGS
from xgv_cosim.vehicles.xgv.readings import Reading as _Reading
from xgv_cosim.vehicles.xgv.settings import XgvSettings

_PAUSES = ("safety_mode:software_pause", "safety_mode:estop_pause")
_TIMEOUTS = ("error:9157", "error:9158")
_RELEASES = (
    "safety_mode:manual_override",
    "safety_mode:emergency_manual_override",
    "safety_mode:estop_disable",
)


_READINGS = (
    _Reading(
        "XGV-08",
        "E",
        "Component numbers: Primitive Driver 33, Motion Profile Driver 10, instance 1, node 1.",
        ("bound",),
    ),
    _Reading(
        "XGV-18",
        "D",
        "Figure A is missing: a client controls the Primitive Driver alone: wrench efforts; a "
        "client controls the Motion Profile Driver and that the Primitive Driver: motion "
        "profiles; all else is software pause. The key decides for one client that controls both.",
        ("control_mode",),
        key="xgv.control_mode.both_clients",
        setting="control_mode_both_clients",
    ),
    _Reading(
        "XGV-19",
        "D",
        "The Motion Profile Driver asks for the Primitive Driver with its own controller's "
        "authority, again after this period while it is denied, and gives it back when it loses "
        "its controller.",
        ("component_control:Primitive Driver: Motion Profile Driver",),
        key="xgv.mpd.request_period_s",
        setting="mpd_request_period_s",
    ),
    _Reading(
        "XGV-20",
        "E",
        "A request with a higher authority than the controller's preempts him; an equal one is rejected.",
        ("preempted",),
    ),
    _Reading(
        "XGV-25",
        "E",
        "Resume acts in standby only; Standby in ready only. Set Emergency leads to emergency, Clear "
        "Emergency to standby, from any status as in OpenJAUS: out of shutdown and failure too, and a car "
        "that drives is paused by its controller's Clear Emergency.",
        ("component_status",),
    ),
    _Reading(
        "XGV-25",
        "D",
        "A bound car starts in standby. The Primitive Driver takes Resume, Standby and Clear Emergency also "
        "from the controller of the Motion Profile Driver that controls it; Shutdown and Reset from its own "
        "controller or, while it has none, from anyone.",
        (
            "component_status:Primitive Driver: ready",
            "component_status:Primitive Driver: standby",
        ),
    ),
    _Reading(
        "XGV-25",
        "D",
        "Reset leads to initialize, and after this time to standby.",
        (
            "component_status:Primitive Driver: initialize",
            "component_status:Motion Profile Driver: initialize",
        ),
        key="xgv.initialize_s",
        setting="initialize_s",
    ),
    _Reading(
        "XGV-26",
        "D",
        "Figure B is missing: the safety mode is the greatest of those asked for: stop relay or "
        "button, emergency override, override, pause relay, then door, error, steering, control "
        "and ready mode.",
        ("safety_mode",),
    ),
    _Reading(
        "XGV-31",
        "D",
        "The full brake is held at standstill as long as the disable lasts, with the engine on or off.",
        ("safety_mode:estop_disable",),
    ),
    _Reading(
        "XGV-32",
        "D",
        "Inactive has no wire code; going inactive releases even the full brake of a disable, and the event "
        "disable_released says so.",
        ("safety_mode:inactive", "disable_released"),
    ),
    _Reading(
        "XGV-35",
        "D",
        "What steering does in a pause without a live command.",
        ("control_mode:software_pause", *_TIMEOUTS),
        key="xgv.pause.no_command_steering",
        setting="pause_no_command_steering",
    ),
    _Reading(
        "XGV-36",
        "D",
        "The user's constant deceleration acts in both pauses, without a limit of jerk.",
        _PAUSES,
        key="xgv.pause.decel_mps2",
        setting="pause_decel_mps2",
    ),
    _Reading(
        "XGV-38",
        "D",
        "Warnings and 9138 do not set the bit 'paused due to errors'; other errors do while they are raised.",
        ("error",),
    ),
    _Reading(
        "XGV-41",
        "D",
        "Whether both axes may be manual at once.",
        ("partial_mode",),
        key="xgv.partial.allow_both",
        setting="partial_allow_both",
    ),
    _Reading(
        "XGV-43",
        "E",
        "A command lives as long as its motion's duration, or this long for wrench efforts; then "
        "9157 or 9158 pauses the car until a fresh command is accepted.",
        _TIMEOUTS,
        key="xgv.wrench_timeout_s",
        setting="wrench_timeout_s",
    ),
    _Reading(
        "XGV-50",
        "D",
        "Software pause is reported as 2, whatever its reason; 3 to 7 are read as the same. The note gives "
        "2 to 7 no further meaning: sub-reasons on the wire (3 door, 4 error, 5 link, 6 steering, 7 "
        "time-out) are not offered, since clients take 2 to 7 alike; the reasons are in the event log.",
        ("reported:software_pause",),
    ),
    _Reading(
        "XGV-58",
        "E",
        "Motion profiles outside the ranges that the message can carry are refused on every link.",
        ("command_refused",),
    ),
    _Reading(
        "XGV-63",
        "D",
        "Anyone may set the emergency status, only the controller clears it, on the Primitive Driver also "
        "who controls the Motion Profile Driver that controls it; it makes the ready mode software pause "
        "and does nothing more.",
        (
            "component_status:Primitive Driver: emergency",
            "component_status:Motion Profile Driver: emergency",
        ),
    ),
    _Reading(
        "XGV-64",
        "D",
        "Under an override and for the axis of the partial mode the driver has it at once; a disable and "
        "steering without initialisation come without his doing, whatever other axis he has.",
        (*_RELEASES, "partial_mode", "steering_control:nobody"),
    ),
    _Reading(
        "XGV-64",
        "D",
        "The world's driver wants the car's own motion at first: he slows down to his own speed at "
        "0.6 m/s², with a jerk of 1 m/s³ from the car's acceleration, or speeds up at 1 m/s² for 1 s; he "
        "brings the car to the middle of its lane at 0.5 m/s, and a difference in heading fades to 1/e in "
        "0.5 s. Who has to brake harder for a leader, a signal or a limit does.",
        ("speed_control:driver", "steering_control:driver"),
    ),
    _Reading(
        "XGV-70",
        "D",
        "Before the first accepted command the car stops and holds, and the event no_command says so; a "
        "change of control mode or of the controller drops the command in force, and so do an override and "
        "a disable, motion or effort: afterwards the car stops and holds until a fresh one comes.",
        ("control_mode", "command_dropped", "no_command"),
    ),
    _Reading(
        "imperfections",
        "D",
        "None by default. Noise and quanta are in the speed that the vehicle reports; its own speed "
        "controller has an exact sensor. Latency holds back every message of a stack, in order. The play "
        "is that of the steering's linkage; pedals have springs and none. Draws follow from vehicle id, "
        "seed and control tick.",
        ("bound",),
        key="bind.plant.imperfections",
    ),
    _Reading(
        "contact",
        "D",
        "After a contact with a bound vehicle both stay where they are with speed 0 at once: no push, no "
        "spin, no damage to the computer, which goes on computing its modes. Gaps and times to collision "
        "of the two end there.",
        ("crashed",),
        key="world.contact",
    ),
    _Reading(
        "commands",
        "D",
        "A command is accepted when its sender controls the component, it fits the control mode "
        "and its values are valid, whatever the safety mode. Throttle is a share from 0 to 1: a negative "
        "propulsive effort, for which the message has room (XGV-59), is no command; backwards is a gear.",
        (
            "handover",
            "injection",
        ),
    ),
)


def ledger(settings: XgvSettings) -> tuple[Assumption, ...]:
    """Return every open reading with its value in force; a reading without a key has no value."""
    values = settings.as_text()
    return tuple(
        Assumption(
            reading.rule,
            reading.key,
            values.get(reading.setting, ""),
            reading.evidence,
            reading.text,
            reading.facts,
        )
        for reading in sorted(
            (*_READINGS, *CONTROL_READINGS, *SAFETY_READINGS), key=lambda reading: reading.rule
        )
    )
