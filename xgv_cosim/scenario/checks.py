"""Checks that look at several sections of a scenario at once. Each message names a remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.scenario.problems import Path

if TYPE_CHECKING:
    from collections.abc import Mapping

    from xgv_cosim.scenario.sections import BindSection, ExpectationSection, InjectionSection

Found = tuple[Path, str]


def disagreements(
    duration_s: float | None,
    step_s: float | None,
    bind: Mapping[int, BindSection],
    injections: Mapping[int, InjectionSection],
    expect: Mapping[int, ExpectationSection],
    *,
    allow_both: bool | None,
    all_bind_rows: bool = True,
) -> list[Found]:
    """Return what does not fit together, as (path, message).

    Args:
        duration_s: Length of the run, None where it is itself wrong.
        step_s: World step, None where it is itself wrong.
        bind: The rows that are right in themselves, by their place in the list; likewise below.
        injections: See ``bind``.
        expect: See ``bind``.
        allow_both: ``xgv.partial.allow_both``, None where it is itself wrong.
        all_bind_rows: False: some row of ``bind`` is wrong, so that nothing may be said of its absence.
    """
    found: list[Found] = []
    if duration_s is not None:
        found += _times_beyond_the_end(duration_s, step_s, injections, expect)
    found += _repeated(
        "injections", injections, "overlapping injections of one kind count as one; remove this row"
    )
    found += _repeated("expect", expect, "remove this row")
    found += _bind_rows_that_never_match(bind)
    if all_bind_rows and bind:
        found += _transmitters_that_nobody_hears(bind, injections)
    if allow_both is False:
        text = "both axes manual are refused (XGV-41); set xgv.partial.allow_both: true or choose one axis"
        found += [(("bind", i, "partial"), text) for i, row in bind.items() if row.partial == "both_manual"]
    if not bind and all_bind_rows:
        if injections:
            found.append(
                (("injections",), "there are injections but no vehicle is bound; add a row to 'bind'")
            )
        if any(row.vehicle is not None for row in expect.values()):
            found.append((("expect",), "vehicles are expected but none is bound; add a row to 'bind'"))
    return found


def _times_beyond_the_end(
    duration_s: float,
    step_s: float | None,
    injections: Mapping[int, InjectionSection],
    expect: Mapping[int, ExpectationSection],
) -> list[Found]:
    end = f"the run ends at duration_s {duration_s:g}"
    found: list[Found] = []
    if step_s is not None and duration_s < step_s:
        found.append((("duration_s",), f"got {duration_s:g}, expected at least one step of {step_s:g} s"))
    for index, injection in injections.items():
        if injection.begin_s >= duration_s:
            text = f"got {injection.begin_s:g}, but {end}; make the run longer or inject earlier"
            found.append((("injections", index, "at_s"), text))
    for index, row in expect.items():
        if row.by_s is not None and row.by_s > duration_s:
            text = f"got {row.by_s:g}, but {end}; make the run longer or expect it earlier"
            found.append((("expect", index, "by_s"), text))
    return found


def _repeated(
    section: str, rows: Mapping[int, InjectionSection] | Mapping[int, ExpectationSection], remedy: str
) -> list[Found]:
    found: list[Found] = []
    first_with: dict[str, int] = {}
    for index, row in rows.items():
        first = first_with.setdefault(row.model_dump_json(), index)
        if first != index:
            found.append(((section, index), f"the same as {section}.{first}; {remedy}"))
    return found


def _transmitters_that_nobody_hears(
    bind: Mapping[int, BindSection], injections: Mapping[int, InjectionSection]
) -> list[Found]:
    known = sorted({row.transmitter for row in bind.values() if row.transmitter is not None})
    there = f"known here: {', '.join(known)}" if known else "no row of 'bind' names one"
    return [
        (("injections", index, "transmitter"), f"got {row.transmitter!r}, which no vehicle hears; {there}")
        for index, row in injections.items()
        if row.transmitter is not None and row.transmitter not in known
    ]


def _bind_rows_that_never_match(bind: Mapping[int, BindSection]) -> list[Found]:
    found: list[Found] = []
    first_with: dict[str, int] = {}
    for index, row in bind.items():
        first = first_with.setdefault(repr(row.vehicles), index)
        if first != index:
            text = (
                f"never matches: bind.{first} takes the same vehicles, and the first row counts; remove one"
            )
            found.append((("bind", index, "vehicles"), text))
    return found
