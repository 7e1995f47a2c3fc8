"""What a bound drive asks of SUMO, taken down call by call, to be asked again without a model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

from xgv_cosim.worlds.sumo.engine import direct

_READS = ("get", "is")
POSE_CALLS = ("setSpeed", "moveToXY", "setLateralLanePosition", "setSpeedMode")
"""What places a car, and has SUMO plan for it; the floor has no others once the cars are handed over."""
LEFT_OUT = frozenset({"setActionStepLength"})
"""What the floor does without at the hand-over too: how often SUMO thinks about a car stays as it was."""


class Call(NamedTuple):
    """One command."""

    function: Callable[..., Any]
    name: str
    given: tuple[Any, ...]


Replayed = tuple[Callable[..., Any], tuple[Any, ...]]


@dataclass(slots=True)
class CallLog:
    """The commands to ``vehicle`` before each step of SUMO, and after the last one."""

    steps: list[list[Call]] = field(default_factory=lambda: [[]])

    def end_step(self) -> None:
        """SUMO makes a step; what follows belongs to the next one."""
        self.steps.append([])

    def counts(self, first_step: int) -> Counter[str]:
        """Return how often each command was given from a step on."""
        return Counter(call.name for calls in self.steps[first_step:] for call in calls)

    def replay(self, whom: Collection[str], hand_over_steps: int) -> list[list[Replayed]]:
        """Return the floor's calls about some vehicles, step by step."""
        wanted = frozenset(whom)
        return [
            [
                (call.function, call.given)
                for call in calls
                if call.given
                and call.given[0] in wanted
                and (call.name in POSE_CALLS if step >= hand_over_steps else call.name not in LEFT_OUT)
            ]
            for step, calls in enumerate(self.steps)
        ]


class _TappedDomain:
    def __init__(self, domain: Any, log: CallLog) -> None:  # noqa: ANN401 - SUMO carries no types
        self._domain = domain
        self._log = log

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - likewise
        plain = getattr(self._domain, name)
        if name.startswith(_READS) or not callable(plain):
            return plain

        def tapped(*given: Any, **named: Any) -> Any:  # noqa: ANN401 - likewise
            self._log.steps[-1].append(Call(partial(plain, **named) if named else direct(plain), name, given))
            return plain(*given, **named)

        setattr(self, name, tapped)
        return tapped


class TappedEngine:
    """SUMO as it is spoken to, with a log of the commands to vehicles."""

    def __init__(self, engine: Any, log: CallLog) -> None:  # noqa: ANN401 - SUMO carries no types
        self._engine = engine
        self.vehicle = _TappedDomain(engine.vehicle, log)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - likewise
        return getattr(self._engine, name)
