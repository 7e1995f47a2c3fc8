"""After a plugin has left: the hand-overs to SUMO's driver that are under way are brought to their end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from xgv_cosim.worlds.base import Placement

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.holding import Hold
    from xgv_cosim.worlds.sumo.world import SumoWorld

_NONE = np.zeros(0)
_NOBODY = Placement((), _NONE, _NONE, _NONE, _NONE, _NONE, _NONE > 0.0, _NONE > 0.0)


class Parting:
    """Goes along with the script's steps for as long as a car is on its way to the centre, or slows down.

    Then, at the latest with the end of the simulation or for the next plugin, it lets go of the script.

    Args:
        world: The script's simulation, in which nobody is bound any more.
        hold: The hold on the script.
    """

    def __init__(self, world: SumoWorld, hold: Hold) -> None:
        self._world = world
        self._hold = hold
        self._is_over = False

    @classmethod
    def of(cls, world: SumoWorld, hold: Hold, *, at_once: bool) -> Self | None:
        """Take back what needs no time; return what sees to the rest, None if there is no rest.

        Args:
            world: See the class.
            hold: See the class.
            at_once: Take everything back but what needs SUMO's next step: cars off the road come back in it.
        """
        world.part(at_once=at_once)
        return cls(world, hold) if world.is_handing_over else None

    def step(self) -> None:
        """Make SUMO's next step, which the script asks for."""
        if self._is_over:
            self._hold.step_once()
            return
        try:
            self._world.step(_NOBODY)
        except BaseException:
            self._is_over = True
            self._hold.let_go_soon()
            raise
        if not self._world.is_handing_over:
            self._is_over = True
            self._world.close()
            self._hold.let_go_soon()

    def end(self, *, goes_on: bool) -> None:
        """Let go at once; what is still under way is taken back.

        Args:
            goes_on: SUMO is stepped on, rather than ended.
        """
        try:
            if not self._is_over:
                self._is_over = True
                if goes_on:
                    self._world.bring_back()
                self._world.close()
                if self._hold.engine is not None:
                    self._hold.settle()
        finally:
            self._hold.let_go()
