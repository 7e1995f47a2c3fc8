"""Who a vehicle of the world is, by which it is chosen to be bound or to meet an injection."""

from __future__ import annotations

from typing import NamedTuple


class Traveller(NamedTuple):
    """What is known of a vehicle as it enters the traffic."""

    vehicle_id: str
    type_id: str
    """The world's vehicle type."""
    route_id: str = ""
    """The world's name of its route, empty where routes have none."""
    edges: tuple[str, ...] = ()
    """The sections of road that its route passes, in their order."""
