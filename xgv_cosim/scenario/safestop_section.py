"""The section ``safestop`` of a scenario: radio and receivers of the wireless emergency stop."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from xgv_cosim.scenario.section import Section
from xgv_cosim.vehicles.xgv.safestop import SafeStopReaction, SafeStopSettings

_DEFAULT = SafeStopSettings()


class SafeStopSection(Section):
    """Radio and receivers of the SafeStop (XGV-42).

    An injection into a vehicle presses the transmitter that the vehicle hears: its own one, or the one
    that it shares with all vehicles of the same ``bind.transmitter``. Each receiver hears or misses the
    frames on its own.
    """

    frame_period_s: Annotated[float, Field(ge=0.01, le=10)] = _DEFAULT.frame_period_s
    """Time between two frames of the transmitter; toggle and button send one at once as well."""
    latency_s: Annotated[float, Field(ge=0, le=10)] = _DEFAULT.latency_s
    """Time from sending a frame to its arrival."""
    loss_share: Annotated[float, Field(ge=0, lt=1)] = _DEFAULT.loss_share
    """Share of frames that are lost, drawn for each vehicle from the scenario's seed."""
    link_timeout_s: Annotated[float, Field(ge=0.01, le=60)] = _DEFAULT.link_timeout_s
    """Without a frame for this long, the link is lost."""
    link_loss: SafeStopReaction = _DEFAULT.link_loss
    """What the receiver does when the link is lost: open the pause relay, both (stop), or none."""
    receiver_dead: SafeStopReaction = _DEFAULT.receiver_dead
    """Which relays fall open when the receiver is dead: both (stop), the pause relay, or none."""

    @model_validator(mode="after")
    def _waits_for_more_than_one_frame(self) -> Self:
        if self.link_timeout_s <= self.frame_period_s:
            raise ValueError(
                f"link_timeout_s: got {self.link_timeout_s:g}, expected more than frame_period_s "
                f"({self.frame_period_s:g}), or the link is lost between any two frames"
            )
        return self

    def settings(self) -> SafeStopSettings:
        """Return the settings as the XGV profile takes them."""
        return SafeStopSettings(**{name: getattr(self, name) for name in type(self).model_fields})
