"""The rows of the ledger about control, commands, errors and reports."""

from __future__ import annotations

from xgv_cosim.vehicles.xgv.readings import Reading

_EFFECT_TEXTS = (
    ("brake", "the brake"),
    ("steering", "the steering"),
    ("throttle", "the throttle"),
    ("speed_feedback", "the measured speed"),
)

CONTROL_READINGS = (
    Reading(
        "XGV-10",
        "E",
        "Anyone may send Set Signals. Under an override, in a disable and in an inactive system it is "
        "refused, and what the computer had switched on goes off.",
        ("signals", "command_refused:Signals"),
    ),
    Reading(
        "XGV-20",
        "D",
        "Set Component Authority of the controller sets the authority that a pre-emptor must exceed, up or "
        "down; the Motion Profile Driver tells the Primitive Driver the same.",
        ("preempted",),
    ),
    Reading(
        "XGV-21",
        "D",
        "When the car's own controllers fail (9156), the Motion Profile Driver goes to failure. Reset or "
        "Clear Emergency of its controller leads out of it; Resume does not.",
        ("controller_failed", "error:9156"),
    ),
    Reading(
        "XGV-31",
        "D",
        "Whether e-stop disable switches the engine off. Nothing starts it by itself: the car's controller "
        "does, in a pause anyone; the event without_drive says that the computer is to drive without it.",
        ("safety_mode:estop_disable", "without_drive"),
        key="xgv.disable.engine_off",
        setting="disable_engine_off",
    ),
    Reading(
        "XGV-31",
        "D",
        "Whether the brake loses its assistance while the engine is off; then an effort gives a share of its "
        "deceleration. A driver who takes the speed starts the engine and releases the parking brake.",
        ("engine:off",),
        key="xgv.engine.brake_assist_lost",
        setting="engine_brake_assist_lost",
    ),
    Reading(
        "XGV-70",
        "D",
        "Gears: in closed loop the sign of the commanded speed chooses drive or reverse; a change takes "
        "0.5 s of standstill with the brake pressed and 1.0 s of shifting (plant: shift_standstill_s, "
        "shift_delay_s).",
        ("handover", "gear_engaged"),
    ),
    Reading(
        "XGV-70",
        "D",
        "A gear commanded in wrench efforts waits for standstill and brake, and the event gear_shift_waiting "
        "says so. While a change of direction waits or is under way the commanded throttle is withheld, else "
        "it would drive the car on in the old gear for ever. The brake is the client's to press.",
        ("gear_shift_waiting",),
    ),
    Reading(
        "XGV-34",
        "D",
        "A shift that has not come yet is dropped, and has to be commanded anew, when a pause, a human or "
        "closed loop takes the shifting from wrench efforts.",
        ("gear_shift_dropped",),
    ),
    Reading(
        "XGV-34",
        "D",
        "To set the parking brake causes no motion: the car's controller may in drive-by-wire, in a pause "
        "anyone, as with the engine. To release it lets the car roll: refused in a pause. It acts at once, "
        "with or without engine and brake, and stays as it is in a disable and with nobody aboard.",
        ("parking_brake", "command_refused:DiscreteDevices"),
    ),
    Reading(
        "XGV-41",
        "D",
        "In manual speed gear and parking brake belong to the human; the engine stays the computer's.",
        ("partial_mode", "command_refused:DiscreteDevices"),
    ),
    Reading(
        "XGV-34",
        "D",
        "Whether the engine is switched in a pause only by a controller; in drive-by-wire it always is. "
        "Gears are shifted in drive-by-wire and wrench efforts only.",
        ("engine", "gear", "command_refused:DiscreteDevices"),
        key="xgv.nonmotion.needs_control",
        setting="nonmotion_needs_control",
    ),
    Reading(
        "XGV-38",
        "D",
        "Which errors outlast their cause, until the operator clears them: hardware means all that pause the "
        "car but 9157 and 9158.",
        ("error", "error_latched"),
        key="xgv.errors.latch",
        setting="errors_latch",
    ),
    *(
        Reading(
            "XGV-38",
            "D",
            f"Errors that take {what} away while they are in force.",
            ("error",),
            key=f"xgv.errors.effect.{name}",
            setting=f"errors_effect_{name}",
        )
        for name, what in _EFFECT_TEXTS
    ),
    Reading(
        "XGV-38",
        "D",
        "A lost steering is nobody's, like one that is not initialised: a rider takes the wheel after his "
        "reaction time. A lost brake releases no axis: throttle 0, the car rolls on, and the rider stays "
        "passive, for the world's driver would stop it with a brake that it has not.",
        ("steering_control:nobody", "pause_ineffective", "disable_ineffective"),
    ),
    Reading(
        "XGV-38",
        "D",
        "The warnings 9143, 9144, 9175 to 9178 follow from modes and devices: disable, e-stop pause, the "
        "computer driving by speed or throttle against the set parking brake, door, steering, and control or "
        "ready mode in software pause.",
        ("warning",),
    ),
    Reading(
        "XGV-53",
        "D",
        "Firmware of the controller, one that has Report Vehicle Mode, which 1.0 and 1.1 lack.",
        ("bound",),
        key="xgv.firmware",
        setting="firmware",
    ),
    Reading(
        "XGV-65",
        "D",
        "A controller that sends nothing for so long loses control; 0 means never.",
        ("injection:cmd_loss",),
        key="xgv.control.controller_timeout_s",
        setting="controller_timeout_s",
    ),
    Reading(
        "XGV-66",
        "D",
        "Who preempts a commanded car ends its command and sets its drivers to standby, until his first "
        "command or Resume; xgv.rearm.preemption may ask for Resume. A client whose own Motion Profile "
        "Driver takes the Primitive Driver from it preempts nobody.",
        ("control_preempted",),
    ),
    Reading(
        "XGV-43",
        "D",
        "Time-outs (9157, 9158) tell of a stream that ended while its sender was in control, in any status: "
        "standby, shutdown, reset and emergency leave the command in force, since a pause steers on by it. "
        "Release, silence and pre-emption end the command with the control, without a time-out.",
        ("command_dropped", "error:9157", "error:9158"),
    ),
    Reading(
        "XGV-70",
        "D",
        "Whether Set Motion Profile may carry several motions. A pause drops those that wait, an override or "
        "a disable the one in force too.",
        ("motion_queue", "command_refused:MotionQueue"),
        key="xgv.motion.allow_many",
        setting="motion_allow_many",
    ),
)
"""Open readings of the endpoint."""
