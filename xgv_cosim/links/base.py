"""The shape of a link: what carries messages between one stack and one vehicle's endpoint."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from jaus.address import JausAddress
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.observation import Observation


class Received(NamedTuple):
    """One message with the address of who sent it (XGV-65: a controller is its JAUS id)."""

    sender: JausAddress
    message: StackMessage


class Link(Protocol):
    """Carries messages; knows nothing of their meaning."""

    def poll(self) -> list[Received]:
        """Return what has arrived since the last poll, in order."""
        ...

    def send(self, observation: Observation) -> None:
        """Hand the stack its view of the step that has just ended."""
        ...

    def take_faults(self) -> list[str]:
        """Return what went wrong on the stack's side since the last call, in words."""
        ...

    def close(self) -> None:
        """End the link."""
        ...
