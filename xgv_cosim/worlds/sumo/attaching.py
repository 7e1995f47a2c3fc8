"""Which hold fits what a user's script gives: a module or a connection."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.holding import LibsumoHold
from xgv_cosim.worlds.sumo.session import Session

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.holding import Hold, Holder


def hold_of(given: object, holder: Holder) -> Hold:
    """Take hold of the SUMO that a script speaks to.

    Args:
        given: The module ``traci`` or ``libsumo``, or a connection of traci.
        holder: Who is told of the script's steps.

    Raises:
        WorldError: It is none of these, or attached already.
    """
    if isinstance(given, ModuleType) and getattr(given, "isLibtraci", lambda: False)():
        raise WorldError("libtraci cannot be attached; import traci or libsumo instead")
    if isinstance(given, ModuleType) and getattr(given, "isLibsumo", lambda: False)():
        if Session.is_any_open():
            raise WorldError(
                "libsumo runs a simulation of xgv_cosim in this process, none of a script; close it first"
            )
        return LibsumoHold(holder)
    speaks_traci = isinstance(given, ModuleType) and hasattr(given, "connection")
    if speaks_traci or (hasattr(given, "simulationStep") and hasattr(given, "getLabel")):
        from xgv_cosim.worlds.sumo.socket_hold import SocketHold  # noqa: PLC0415 - traci only where it is used

        return SocketHold(given, holder)
    raise WorldError(
        f"attach: got {given!r}, expected the module traci or libsumo, or a connection "
        "(traci.getConnection(label))"
    )
