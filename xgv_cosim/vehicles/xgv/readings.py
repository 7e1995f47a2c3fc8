"""One row of the ledger, and the rows about safety devices."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Reading:
    """One open reading; ``key`` is its key in a scenario, ``setting`` names its value in the settings."""

    rule: str
    evidence: str
    text: str
    facts: tuple[str, ...]
    key: str = ""
    setting: str = ""


_LINK = ("safestop_link", "injection:link", "injection:receiver_dead", "injection:bypass")
_SAFESTOP = ("injection:estop_pause", "injection:estop_disable", *_LINK)
_REARM_FACTS = {
    "estop_pause": ("safety_mode:estop_pause",),
    "disable": ("safety_mode:estop_disable",),
    "link_loss": ("safestop_link:none",),
    "override": ("safety_mode:manual_override", "safety_mode:emergency_manual_override"),
    "error": ("error",),
    "door": ("injection:door",),
    "preemption": ("control_preempted",),
}
_SAFESTOP_TEXTS = (
    ("frame_period_s", "Time between two frames of the SafeStop transmitter."),
    ("latency_s", "Time from sending a SafeStop frame to its arrival."),
    ("loss_share", "Share of SafeStop frames that are lost, for each receiver on its own."),
    (
        "link_timeout_s",
        "Without a frame for this long, the receiver takes the link for lost and raises 9138.",
    ),
    ("link_loss", "Which relays the receiver opens when the link is lost, unless it is in bypass."),
    ("receiver_dead", "Which relays fall open when the receiver is dead: without power, both."),
)

SAFETY_READINGS = (
    Reading(
        "XGV-31",
        "D",
        "An emergency stop button latches; the end of its injection is the hand that resets it.",
        ("injection:estop_button",),
    ),
    Reading(
        "XGV-32",
        "D",
        "A system that becomes active again is newly booted: nobody in control, both drivers in standby.",
        ("injection:inactive",),
    ),
    Reading(
        "XGV-37",
        "D",
        "Preset of what a car needs before it moves again once its stop demand is gone: literal means "
        "nothing latches and it goes on by itself; each cause may differ.",
        ("rearmed",),
        key="xgv.rearm.preset",
        setting="rearm.preset",
    ),
    *(
        Reading(
            "XGV-66" if cause == "preemption" else "XGV-37",
            "D",
            f"What it takes to go on after {cause.replace('_', ' ')}.",
            facts,
            key=f"xgv.rearm.{cause}",
            setting=f"rearm.{cause}",
        )
        for cause, facts in _REARM_FACTS.items()
    ),
    Reading(
        "XGV-41",
        "D",
        "In a pause with manual speed the human brakes. The rider and the world's driver drive on as in "
        "traffic, which knows no pause: so the event pause_ineffective speaks whoever has the pedals, or "
        "nobody. A manual axis with nobody aboard is refused unless it is forced.",
        ("pause_ineffective", "partial_mode"),
    ),
    Reading(
        "XGV-36",
        "D",
        "Where grip, brake or slope do not allow the set deceleration, a pause brakes with what there is; "
        "the event pause_weaker_than_set says so, with what limits it and the duration. A controller that "
        "froze before the brake was there, and full brake without assistance, are told likewise "
        "(pause_weaker_than_set, disable_weaker_than_full).",
        ("pause_weaker_than_set", "disable_weaker_than_full"),
    ),
    Reading(
        "XGV-38",
        "D",
        "An error that takes the brake away leaves a pause or a disable without effect; the events "
        "pause_ineffective and disable_ineffective say so, with the error and the duration.",
        ("pause_ineffective", "disable_ineffective"),
    ),
    *(
        Reading("XGV-42", "D", text, _SAFESTOP, key=f"safestop.{name}", setting=f"safestop.{name}")
        for name, text in _SAFESTOP_TEXTS
    ),
    Reading(
        "XGV-42",
        "D",
        "Bypass suppresses the supervision of the link alone: a relay that says stop still stops.",
        ("injection:bypass",),
    ),
    Reading(
        "XGV-67",
        "D",
        "A frozen controller holds pedals and wheel as they were and answers nobody; only the emergency "
        "manual override acts. When that ends, the held outputs act again. Its clock stands still too.",
        ("injection:frozen",),
    ),
    Reading(
        "XGV-68",
        "D",
        "A SafeStop or button demand that does not stop the car, or only as a pause where it asks for full "
        "brake, is an event with its duration. A frame that is only still on its way is not masked, one that "
        "is due and lost is. A frozen controller masks a door and the manual override too.",
        ("stop_masked", "override_masked"),
    ),
    Reading(
        "XGV-69",
        "D",
        "Steering that needs initialisation or waits for an OK is under nobody's control, until the operator "
        "has initialised it.",
        ("injection:steering_uninitialised", "injection:steering_awaits_user"),
    ),
)
"""Open readings about safety devices, re-arming and a controller that does not compute."""
