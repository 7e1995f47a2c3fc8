"""JAUS addresses: subsystem, node, component, instance."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

from jaus.errors import LocalProtocolError

BROADCAST = 255
"""As a part of an address: all subsystems, nodes, components or instances."""


class ComponentId(IntEnum):
    """Component ids of the six components on an XGV controller (XGV-08)."""

    NODE_MANAGER = 1
    MOTION_PROFILE_DRIVER = 10
    SIGNALS_DRIVER = 11
    ERROR_MANAGER = 12
    PRIMITIVE_DRIVER = 33
    VELOCITY_STATE_SENSOR = 42


@dataclass(frozen=True, slots=True, order=True)
class JausAddress:
    """A component's address; on the wire 32 bits (XGV-07, XGV-55).

    Raises:
        LocalProtocolError: A part does not fit into one byte.
    """

    subsystem: int
    node: int
    component: int
    instance: int

    def __post_init__(self) -> None:
        for name in ("subsystem", "node", "component", "instance"):
            value = getattr(self, name)
            if not 0 <= value <= 255:
                raise LocalProtocolError(f"JAUS address {name}: got {value!r}, expected 0 to 255")

    @classmethod
    def from_jaus_id(cls, jaus_id: int) -> JausAddress:
        """Return the address whose 32-bit form is ``jaus_id``."""
        return _address_of(jaus_id)

    @property
    def jaus_id(self) -> int:
        """Return the 32-bit form: subsystem, node, component, instance from the highest byte down."""
        return ((self.subsystem << 8 | self.node) << 8 | self.component) << 8 | self.instance

    @property
    def is_broadcast(self) -> bool:
        """Return whether more than one component may be meant: a part is 255."""
        return BROADCAST in {self.subsystem, self.node, self.component, self.instance}

    def __str__(self) -> str:
        return f"{self.subsystem}.{self.node}.{self.component}.{self.instance}"


# A peer sees few addresses, again and again; the bound keeps forged ones from filling the memory.
@lru_cache(maxsize=4096)
def _address_of(jaus_id: int) -> JausAddress:
    return JausAddress(*jaus_id.to_bytes(4, "big"))
