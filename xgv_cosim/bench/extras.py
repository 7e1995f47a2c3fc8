"""What a measured fleet can have switched on: observations, links, stacks, recording, metrics."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from jaus.address import ComponentId
from jaus.component import StatusCommand
from xgv_cosim.autonomy.reference import ReferenceStack
from xgv_cosim.commands import MotionProfile
from xgv_cosim.endpoint import CommandStatus, RequestControl
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.metrics import Watch
from xgv_cosim.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from jaus.address import JausAddress
    from xgv_cosim.endpoint import StackMessage
    from xgv_cosim.links.base import Link
    from xgv_cosim.observation import Observation
    from xgv_cosim.road import Road
    from xgv_cosim.simulation.binding import LinkFactory
    from xgv_cosim.simulation.journal import Observer

LASTS_S = 60.0
"""How long a motion profile of the benchmark lasts: longer than any drive."""
MAX_ACCEL_MPS2 = 4.0
MAX_CURVATURE_RATE_PER_M_S = 0.15


class Extra(StrEnum):
    """Something that costs time of its own."""

    OBSERVATIONS = "observations"
    """Each car has a stack that is shown everything and says nothing."""
    LINKS = "links"
    """Each car has a stack that is shown everything and sends its target as a message, in every step."""
    STACKS = "stacks"
    """Each car is driven by the reference stack."""
    RECORDING = "recording"
    """A recorder writes events, trace and trajectories."""
    METRICS = "metrics"
    """Gaps, contacts and placements of every bound car are watched."""


STACK_EXTRAS = frozenset({Extra.OBSERVATIONS, Extra.LINKS, Extra.STACKS})
"""A car has one stack, so at most one of these."""


def motion_profile(speed_mps: float, curvature_per_m: float) -> MotionProfile:
    """Return the message for a target."""
    return MotionProfile(
        speed_mps, MAX_ACCEL_MPS2, curvature_per_m, MAX_CURVATURE_RATE_PER_M_S, duration_s=LASTS_S
    )


def session_messages() -> list[StackMessage]:
    """Return what a client says first: it wants the car, and both drivers ready."""
    drivers = (ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER)
    return [
        RequestControl(ComponentId.MOTION_PROFILE_DRIVER),
        *(CommandStatus(component, StatusCommand.RESUME) for component in drivers),
    ]


class SilentStack:
    """Is shown everything and says nothing."""

    def act(self, observation: Observation) -> list[StackMessage]:  # noqa: ARG002 - the shape of a stack
        """Say nothing."""
        return []


@dataclass(slots=True)
class Client:
    """Sends the targets that it is given."""

    speed_mps: float = 0.0
    curvature_per_m: float = 0.0
    _has_begun: bool = False

    def act(self, observation: Observation) -> list[StackMessage]:  # noqa: ARG002 - the shape of a stack
        """Ask for control the first time; repeat the motion profile."""
        first = [] if self._has_begun else session_messages()
        self._has_begun = True
        return [*first, motion_profile(self.speed_mps, self.curvature_per_m)]


@dataclass(slots=True)
class SwitchedOn:
    """The extras of one drive."""

    which: frozenset[Extra]
    observers: tuple[Observer, ...] = ()
    use_road: Callable[[Road], None] | None = None
    clients: dict[str, Client] = field(default_factory=dict)
    """By vehicle; with ``LINKS`` only."""

    @property
    def drives_itself(self) -> bool:
        """Return whether nobody needs to be told where to go."""
        return Extra.STACKS in self.which

    @property
    def new_link(self) -> LinkFactory | None:
        """Return what makes the cars' links, if they have any."""
        return self._link if self.which & STACK_EXTRAS else None

    def _link(self, vehicle_id: str, address: JausAddress) -> Link:
        if Extra.STACKS in self.which:
            return InProcessLink(ReferenceStack(address), address)
        if Extra.LINKS in self.which:
            return InProcessLink(self.clients.setdefault(vehicle_id, Client()), address)
        return InProcessLink(SilentStack(), address)


@contextmanager
def switched_on(which: frozenset[Extra], safety_mode_name: Callable[[int], str]) -> Iterator[SwitchedOn]:
    """Yield the extras of a drive; what they write goes into a temporary folder.

    Raises:
        RecordingError: The recording cannot be written.
    """
    observers: list[Observer] = [Watch()] if Extra.METRICS in which else []
    if Extra.RECORDING not in which:
        yield SwitchedOn(which, tuple(observers))
        return
    with (
        TemporaryDirectory(prefix="xgv-cosim-bench-") as folder,
        Recorder(Path(folder) / "run", safety_mode_name=safety_mode_name) as recorder,
    ):
        yield SwitchedOn(which, (*observers, recorder), recorder.use_road)
