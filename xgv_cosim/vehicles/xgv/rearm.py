"""Re-arming: what a car needs before it moves again once its stop demand is gone (XGV-37).

By the note nothing latches: the mode follows devices, control and status, and the car goes on by itself
(preset ``literal``). For each cause a key may ask for more: the cause sets both drivers to standby, and
Resume is refused while it lasts; with ``operator``, until the operator has re-armed the car as well.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from types import MappingProxyType

from xgv_cosim.errors import ScenarioError


class RearmCause(StrEnum):
    """What has stopped the car, or taken it out of the computer's hands."""

    ESTOP_PAUSE = "estop_pause"
    DISABLE = "disable"
    LINK_LOSS = "link_loss"
    OVERRIDE = "override"
    ERROR = "error"
    DOOR = "door"
    PREEMPTION = "preemption"


class Rearm(StrEnum):
    """What it takes to move again."""

    AUTO = "auto"
    """Nothing: the car goes on by itself."""
    RESUME_AFTER_RELEASE = "resume_after_release"
    """A Resume that comes after the cause has gone."""
    OPERATOR = "operator"
    """The operator's re-arming after the cause has gone, and then a Resume."""


class RearmPreset(StrEnum):
    """A value for every cause."""

    LITERAL = "literal"
    """The source's text: all auto."""
    CONSERVATIVE = "conservative"
    """A fresh Resume after each stop, after a disable the operator too."""


PRESETS: Mapping[RearmPreset, Mapping[RearmCause, Rearm]] = MappingProxyType(
    {
        RearmPreset.LITERAL: MappingProxyType(dict.fromkeys(RearmCause, Rearm.AUTO)),
        RearmPreset.CONSERVATIVE: MappingProxyType(
            dict.fromkeys(RearmCause, Rearm.RESUME_AFTER_RELEASE) | {RearmCause.DISABLE: Rearm.OPERATOR}
        ),
    }
)
"""What each preset asks for (XGV-37)."""

WORDS: Mapping[RearmCause, str] = MappingProxyType(
    {
        RearmCause.ESTOP_PAUSE: "e-stop pause",
        RearmCause.DISABLE: "e-stop disable",
        RearmCause.LINK_LOSS: "SafeStop link loss",
        RearmCause.OVERRIDE: "manual override",
        RearmCause.ERROR: "error",
        RearmCause.DOOR: "open door or liftgate",
        RearmCause.PREEMPTION: "pre-emption",
    }
)
"""The causes in words."""


@dataclass(frozen=True, slots=True)
class RearmSettings:
    """A preset, and what differs from it.

    Raises:
        ScenarioError: A value is none of the known ones.
    """

    preset: RearmPreset = RearmPreset.LITERAL
    estop_pause: Rearm | None = None
    """None here and below: as the preset says."""
    disable: Rearm | None = None
    link_loss: Rearm | None = None
    override: Rearm | None = None
    error: Rearm | None = None
    door: Rearm | None = None
    preemption: Rearm | None = None

    def __post_init__(self) -> None:
        problems = []
        for field in fields(self):
            value, kind = getattr(self, field.name), RearmPreset if field.name == "preset" else Rearm
            if value is None and kind is Rearm:
                continue
            if value not in list(kind):
                problems.append(f"rearm.{field.name}: got {value!r}, expected one of {', '.join(kind)}")
                continue
            object.__setattr__(self, field.name, kind(value))
        if problems:
            raise ScenarioError("the XGV's re-arming is wrong:", tuple(problems))

    def of(self, cause: RearmCause) -> Rearm:
        """Return what a cause asks for."""
        own: Rearm | None = getattr(self, cause.value)
        return PRESETS[self.preset][cause] if own is None else own


class Rearming:
    """Which causes keep one car from being resumed."""

    def __init__(self, settings: RearmSettings) -> None:
        self._settings = settings
        self._lasting: frozenset[RearmCause] = frozenset()
        self._unarmed: set[RearmCause] = set()
        """Causes after which the operator has not re-armed the car yet."""

    @property
    def refusal(self) -> str:
        """Return why Resume is refused, empty if it is not."""
        parts = [f"the {WORDS[cause]} lasts" for cause in RearmCause if cause in self._lasting]
        parts += [
            f"the operator has not re-armed it after the {WORDS[cause]}"
            for cause in RearmCause
            if cause in self._unarmed - self._lasting
        ]
        return f"Resume is refused: {', '.join(parts)}" if parts else ""

    def follow(self, lasting: Collection[RearmCause]) -> str:
        """Take note of the causes that last now; return why both drivers go to standby, or nothing."""
        counting = frozenset(cause for cause in lasting if self._settings.of(cause) is not Rearm.AUTO)
        begun = counting - self._lasting
        self._lasting = counting
        self._unarmed |= {cause for cause in begun if self._settings.of(cause) is Rearm.OPERATOR}
        return _standby_reason(begun)

    def strike(self, cause: RearmCause) -> str:
        """Take note of a cause that happens and does not last; the answer is that of ``follow``."""
        wanted = self._settings.of(cause)
        if wanted is Rearm.AUTO:
            return ""
        if wanted is Rearm.OPERATOR:
            self._unarmed.add(cause)
        return _standby_reason({cause})

    def rearm(self) -> tuple[RearmCause, ...]:
        """Re-arm the car after the causes that have gone, and return them; those that last stay."""
        gone = tuple(cause for cause in RearmCause if cause in self._unarmed - self._lasting)
        self._unarmed -= set(gone)
        return gone


def _standby_reason(causes: Collection[RearmCause]) -> str:
    words = [WORDS[cause] for cause in RearmCause if cause in causes]
    return f"set to standby by the {' and the '.join(words)}" if words else ""
