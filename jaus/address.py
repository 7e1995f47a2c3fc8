"""JAUS addresses: subsystem, node, component, instance."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from jaus.errors import LocalProtocolError


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

    def __str__(self) -> str:
        return f"{self.subsystem}.{self.node}.{self.component}.{self.instance}"
