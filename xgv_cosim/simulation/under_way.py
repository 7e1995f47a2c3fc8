"""How many messages may be under way to a car whose commands have latency (``command_latency_s``)."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jaus.address import JausAddress
    from xgv_cosim.simulation.binding import BoundVehicle

MOST_UNDER_WAY = 1024
"""So many messages of who controls a component of a car may be under way to it;
further ones are refused."""
MOST_UNDER_WAY_OF_ONE = 256
"""And of anybody else ..."""
MOST_UNDER_WAY_OF_OTHERS = 1024
"""... and of all who control nothing: the room of who does is his own."""


class UnderWay:
    """How many messages are under way to a car; they are counted once for each exchange."""

    def __init__(self, vehicle: BoundVehicle) -> None:
        self._vehicle = vehicle
        self._by_sender: Counter[JausAddress] = Counter()
        self._of_others = 0

    def count(self) -> None:
        """Count anew: some have acted since."""
        self._by_sender, self._of_others = Counter(sender for _, sender, _ in self._vehicle.on_the_way), 0
        if not self._by_sender:
            return
        holders = self._holders()
        self._of_others = sum(number for each, number in self._by_sender.items() if each not in holders)

    def take(self, sender: JausAddress) -> bool:
        """Return whether there is room for one more of a sender, and count it."""
        number = self._by_sender[sender]
        if sender in self._holders():
            if number >= MOST_UNDER_WAY:
                return False
        elif number >= MOST_UNDER_WAY_OF_ONE or self._of_others >= MOST_UNDER_WAY_OF_OTHERS:
            return False
        else:
            self._of_others += 1
        self._by_sender[sender] += 1
        return True

    def _holders(self) -> set[JausAddress | None]:
        """Return who controls a component of the car now."""
        return set(self._vehicle.endpoint.component_controller.values())
