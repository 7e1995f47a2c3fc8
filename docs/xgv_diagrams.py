"""Diagrams of the XGV's modes and components, drawn from the tables that the simulation runs on."""

from __future__ import annotations

from itertools import groupby

from markdown_parts import mermaid

from jaus.address import JausAddress
from jaus.component import (
    CONTROL_TRANSITIONS,
    STATUS_TRANSITIONS,
    Component,
    ComponentStatus,
    ControlEffect,
    ControlReply,
    Situation,
    StatusCommand,
)
from xgv_cosim.cli.modes import sections
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.settings import XgvSettings


def safety_chain() -> str:
    """Return figure B: the questions in their order, and the mode that the first yes leads to."""
    causes = [row[:2] for row in sections(XgvSettings())[1].rows]
    groups = [(mode, [cause for cause, _ in rows]) for mode, rows in groupby(causes, key=lambda row: row[1])]
    lines = ["flowchart TD"]
    for number, (mode, asked) in enumerate(groups):
        lines.append(f'    mode{number}(["{mode}"])')
        if number == len(groups) - 1:
            lines.append(f"    question{number - 1} -- no --> mode{number}")
            continue
        lines.append(f'    question{number}{{"{"<br>or ".join(asked)}?"}}')
        lines.append(f"    question{number} -- yes --> mode{number}")
        if number:
            lines.append(f"    question{number - 1} -- no --> question{number}")
    return mermaid(lines)


def component_control() -> str:
    """Return who controls a component, before and after each message that does something."""
    after = {ControlEffect.TAKE: "controlled", ControlEffect.RAISE_AUTHORITY: "controlled"}
    lines = [
        "stateDiagram-v2",
        '    state "nobody controls it" as nobody',
        '    state "a client controls it" as controlled',
        "    [*] --> nobody",
    ]
    for (situation, message), (reply, effect) in CONTROL_TRANSITIONS.items():
        if reply is ControlReply.NOTHING and effect is ControlEffect.NONE:
            continue  # nothing happens; the table beside the diagram has these too
        before = "nobody" if situation is Situation.UNCONTROLLED else "controlled"
        to = "nobody" if effect is ControlEffect.GIVE_UP else after.get(effect, before)
        who = "" if situation is Situation.UNCONTROLLED else f", {plain(situation)}"
        lines.append(f"    {before} --> {to} : {plain(message)}{who} / {plain(reply)}")
    return mermaid(lines)


def component_status() -> str:
    """Return the status of a component under every command; what acts from everywhere is drawn once."""
    always: dict[ComponentStatus, list[str]] = {}
    sometimes: dict[tuple[ComponentStatus, ComponentStatus], list[str]] = {}
    for command in StatusCommand:
        ends = {STATUS_TRANSITIONS.get((status, command)) for status in ComponentStatus}
        (end, *others) = ends
        if end is not None and not others:
            always.setdefault(end, []).append(plain(command))
            continue
        for status in ComponentStatus:
            to = STATUS_TRANSITIONS.get((status, command))
            if to is not None and to is not status:
                sometimes.setdefault((status, to), []).append(plain(command))
    for status in ComponentStatus:
        component = Component(JausAddress(1, 1, 33, 1), status)
        component.finish_initialization()
        if component.status is not status:
            sometimes.setdefault((status, component.status), []).append("initialised")
        failing = Component(component.address, status)
        failing.fail()
        if failing.status is not status:
            sometimes.setdefault((status, failing.status), []).append("failed")
    (begins,) = set(XgvProfile().new_endpoint("documentation", 0.0).component_status.values())
    lines = ["stateDiagram-v2", '    state "any status" as any', f"    [*] --> {plain(begins)} : bound"]
    lines += [f"    any --> {plain(end)} : {' or '.join(commands)}" for end, commands in always.items()]
    lines += [
        f"    {plain(before)} --> {plain(to)} : {' or '.join(commands)}"
        for (before, to), commands in sometimes.items()
    ]
    return mermaid(lines)


def plain(member: Situation | StatusCommand | ComponentStatus | object) -> str:
    """Return the name of an enumeration's member in words."""
    return str(getattr(member, "name", member)).lower().replace("_", " ")
