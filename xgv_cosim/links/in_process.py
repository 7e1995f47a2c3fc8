"""The in-process link: a stack object in this process, in lockstep.

The stack sees the observation of step t as soon as the step has ended; what it answers is polled at
the start of step t+1, as on every other link.
"""

from __future__ import annotations

from typing import get_args

from jaus.address import JausAddress
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.links.base import Received
from xgv_cosim.observation import Observation, Stack


class InProcessLink:
    """Calls ``stack.act`` after each step and queues what it returns.

    Args:
        stack: The driver of one vehicle.
        address: The JAUS address under which the stack speaks.
    """

    def __init__(self, stack: Stack, address: JausAddress) -> None:
        self._stack = stack
        self._address = address
        self._queue: list[Received] = []
        self._faults: list[str] = []
        self._last_fault = ""

    def poll(self) -> list[Received]:
        """Return what the stack has sent since the last poll, in order."""
        arrived, self._queue = self._queue, []
        return arrived

    def send(self, observation: Observation) -> None:
        """Let the stack act on its view.

        A stack that raises, or returns what is no list of messages, is reported in words, once as long
        as it says the same; nothing of that cycle is sent, and it is called again after the next step.
        """
        try:
            messages = list(self._stack.act(observation))
        except Exception as error:  # noqa: BLE001 - a user's stack may raise anything; the run goes on
            self._report(f"{type(error).__name__}: {error}")
            return
        strange = [message for message in messages if not isinstance(message, get_args(StackMessage))]
        if strange:
            self._report(f"act returned {type(strange[0]).__name__}, expected a list of messages")
            return
        self._last_fault = ""
        self._queue.extend(Received(self._address, message) for message in messages)

    def _report(self, fault: str) -> None:
        if fault != self._last_fault:
            self._faults.append(fault)
        self._last_fault = fault

    def take_faults(self) -> list[str]:
        """Return what the stack raised since the last call."""
        faults, self._faults = self._faults, []
        return faults

    def close(self) -> None:
        """Forget what was queued."""
        self._queue.clear()
