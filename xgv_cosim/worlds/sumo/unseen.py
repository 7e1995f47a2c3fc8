"""What a user's script reads from SUMO, without ghosts: as if SUMO had the script's vehicles only.

A ghost among ids is left out, counted off a count, and named by its owner where it is somebody's neighbour.
What SUMO averages over a lane or edge, and what detectors gather over an interval, stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from xgv_cosim.worlds.sumo.engine import Engine
from xgv_cosim.worlds.sumo.ghosts import is_ghost, owner_in

HALTING_MPS = 0.1
"""SUMO takes a vehicle for halting below this speed."""

NOBODY = ("", -1.0)
"""Where a leader or follower is asked for; traci makes ``None`` of it for leaders, unless told not to."""
Seen = Any
"""What a getter answers, whatever that is."""
Reading = Callable[[Engine, tuple[Any, ...], Seen], Seen]
"""Takes SUMO as the project sees it, the arguments of a getter and its answer; returns what a script sees."""


def _without_ghosts(_engine: Engine, _args: tuple[Any, ...], ids: Seen) -> Seen:
    return tuple(name for name in ids if not is_ghost(name)) if any(map(is_ghost, ids)) else ids


def _fewer_by(domain: str, getter: str) -> Reading:
    """Return the reading of a count whose ids another getter tells, for the same arguments."""

    def fewer(engine: Engine, args: tuple[Any, ...], number: Seen) -> Seen:
        ids = getattr(getattr(engine, domain), getter)(*args) if number else ()
        return number - sum(map(is_ghost, ids))

    return fewer


def _fewer_expected(engine: Engine, _args: tuple[Any, ...], number: Seen) -> Seen:
    return number - sum(map(is_ghost, engine.vehicle.getLoadedIDList()))


def _fewer_halting(domain: str) -> Reading:
    def fewer(engine: Engine, args: tuple[Any, ...], number: Seen) -> Seen:
        ids = getattr(engine, domain).getLastStepVehicleIDs(*args) if number else ()
        speed_mps = engine.vehicle.getSpeed
        return number - sum(1 for name in ids if is_ghost(name) and speed_mps(name) < HALTING_MPS)

    return fewer


def _owner(_engine: Engine, args: tuple[Any, ...], found: Seen) -> Seen:
    """The owner in the place of its ghost; nobody where that is who asks."""
    if not found or not is_ghost(found[0]):
        return found
    owner = owner_in(found[0])
    return (owner, *found[1:]) if owner != args[0] else NOBODY


def _owners(engine: Engine, args: tuple[Any, ...], found: Seen) -> Seen:
    seen = tuple(_owner(engine, args, other) for other in found)
    return tuple(other for other in seen if other != NOBODY)


def _real_foes(_engine: Engine, _args: tuple[Any, ...], found: Seen) -> Seen:
    return tuple(foe for foe in found if not is_ghost(foe[0]))


def _real_collisions(_engine: Engine, _args: tuple[Any, ...], found: Seen) -> Seen:
    return tuple(one for one in found if not (is_ghost(one.collider) or is_ghost(one.victim)))


def _lists_without_ghosts(_engine: Engine, _args: tuple[Any, ...], results: Seen) -> Seen:
    """Values of subscribed variables, lists of ids among them."""
    if not results:
        return results
    return {
        variable: tuple(one for one in value if not (isinstance(one, str) and is_ghost(one)))
        if isinstance(value, (tuple, list))
        else value
        for variable, value in results.items()
    }


def _subjects_without_ghosts(_engine: Engine, _args: tuple[Any, ...], results: Seen) -> Seen:
    """Results of a context: by the ids of what is around."""
    if not results or not any(map(is_ghost, results)):
        return results
    return {name: values for name, values in results.items() if not is_ghost(name)}


def _all_without_ghosts(engine: Engine, args: tuple[Any, ...], results: Seen) -> Seen:
    """Results of all contexts of a domain."""
    return {subject: _subjects_without_ghosts(engine, args, around) for subject, around in results.items()}


def _readings() -> Iterable[tuple[str, str, Reading]]:
    for domain in ("vehicle", "vehicletype", "route"):
        yield domain, "getIDList", _without_ghosts
        yield domain, "getIDCount", _fewer_by(domain, "getIDList")
    yield "vehicle", "getLoadedIDList", _without_ghosts
    yield "vehicle", "getTeleportingIDList", _without_ghosts
    yield "vehicle", "getLeader", _owner
    yield "vehicle", "getFollower", _owner
    yield "vehicle", "getNeighbors", _owners
    yield "vehicle", "getJunctionFoes", _real_foes
    for what in (
        "Loaded", "Departed", "Arrived", "StartingTeleport", "EndingTeleport", "CollidingVehicles",
        "EmergencyStoppingVehicles", "ParkingStartingVehicles", "ParkingEndingVehicles",
        "StopStartingVehicles", "StopEndingVehicles",
    ):  # fmt: skip
        yield "simulation", f"get{what}IDList", _without_ghosts
        yield "simulation", f"get{what}Number", _fewer_by("simulation", f"get{what}IDList")
    yield "simulation", "getMinExpectedNumber", _fewer_expected
    yield "simulation", "getCollisions", _real_collisions
    yield "simulation", "getSubscriptionResults", _lists_without_ghosts
    for domain in ("lane", "edge", "inductionloop", "lanearea", "multientryexit"):
        yield domain, "getLastStepVehicleIDs", _without_ghosts
        yield domain, "getLastStepVehicleNumber", _fewer_by(domain, "getLastStepVehicleIDs")
    for domain in ("lane", "edge"):
        yield domain, "getLastStepHaltingNumber", _fewer_halting(domain)
    for domain in ("vehicle", "person", "simulation", "lane", "edge", "junction", "poi", "polygon"):
        yield domain, "getContextSubscriptionResults", _subjects_without_ghosts
        yield domain, "getAllContextSubscriptionResults", _all_without_ghosts


READINGS: dict[tuple[str, str], Reading] = {
    (domain, getter): reading for domain, getter, reading in _readings()
}
"""By domain and getter."""
