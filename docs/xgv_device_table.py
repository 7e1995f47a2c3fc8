"""Who may move which device of an XGV: a decision table, asked of the rules for every input."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from markdown_parts import table

from jaus.component import Standing
from jaus.vehicle_mode import ControlMode, SafetyMode
from xgv_cosim.cli.modes import mode_words
from xgv_cosim.vehicles.xgv.auxiliaries import (
    engine_refusal,
    gear_refusal,
    parking_brake_refusal,
    signals_refusal,
)
from xgv_cosim.vehicles.xgv.modes import PARTIAL_MODE_ACTS_IN

_NEEDS_CONTROL = "`xgv.nonmotion.needs_control`"
_WHO: Mapping[frozenset[Standing], str] = {
    frozenset(): "-",
    frozenset({Standing.CONTROLLER, Standing.DEPUTY}): "a controller",
    frozenset(Standing): "anyone",
}
"""Those whom a rule allows, in words. Another set is a rule that this table cannot tell: ``KeyError``."""
Allowed = Callable[[Standing, bool], bool]
"""Whether the rule allows one who stands so, without and with ``xgv.nonmotion.needs_control``."""


def devices_moved() -> str:
    """Return who moves gear, engine, parking brake and signals in each mode (XGV-09, 10, 31, 34, 41)."""
    rows = []
    for mode in SafetyMode:
        for manual_speed in (False, True) if mode in PARTIAL_MODE_ACTS_IN else (False,):
            human = ("no", "yes")[manual_speed] if mode in PARTIAL_MODE_ACTS_IN else "ignored"
            rows.append((mode_words(mode), human, *_cells(mode, manual_speed=manual_speed)))
    header = ("safety mode", "manual speed", "gear", "engine", "set the parking brake", "release it")
    return table((*header, "lights, horn, signals"), rows)


def _cells(mode: SafetyMode, *, manual_speed: bool) -> tuple[str, ...]:
    def parking(who: Standing, *, sets: bool, needs_control: bool) -> bool:
        return not parking_brake_refusal(
            mode, who, sets=sets, manual_speed=manual_speed, needs_control=needs_control
        )

    return (
        _gear(mode, manual_speed=manual_speed),
        _who(lambda who, needs: not engine_refusal(mode, who, needs_control=needs)),
        _who(lambda who, needs: parking(who, sets=True, needs_control=needs)),
        _who(lambda who, needs: parking(who, sets=False, needs_control=needs)),
        _who(lambda _who, _needs: not signals_refusal(mode)),
    )


def _gear(mode: SafetyMode, *, manual_speed: bool) -> str:
    """Return who shifts, and in which control modes if not in all."""
    by_control: dict[str, list[str]] = {}
    for control in ControlMode:

        def allows(who: Standing, _needs: bool, control: ControlMode = control) -> bool:
            return not gear_refusal(mode, control, who, manual_speed=manual_speed)

        by_control.setdefault(_who(allows), []).append(mode_words(control))
    names = [f"{who}, in {' or '.join(controls)}" for who, controls in by_control.items() if who != "-"]
    return "; ".join(names) or "-"


def _who(allows: Allowed) -> str:
    usual, strict = (
        _WHO[frozenset(who for who in Standing if allows(who, needs))] for needs in (False, True)
    )
    return usual if usual == strict else f"{usual}; with {_NEEDS_CONTROL} {strict}"
