"""The JAUS addresses of bound vehicles and of their stacks; a slot has the same ones for everybody."""

from __future__ import annotations

from jaus.address import JausAddress

SUBSYSTEMS = 254
"""Subsystem 255 is broadcast and 0 is reserved."""
STACK_COMPONENT = 2
"""Component id under which a stack speaks; the subsystem and node tell stacks apart."""
_FIRST_STACK_NODE = 2
"""Node 1 of the subsystem is the vehicle."""


def subsystem_of(slot: int) -> int:
    """Return the subsystem number of the vehicle in a slot; so many have the same one as ports are needed."""
    return slot % SUBSYSTEMS + 1


def port_of(slot: int) -> int:
    """Return behind which port of a network the vehicle in a slot is: 254 subsystems are one port's."""
    return slot // SUBSYSTEMS


def stack_address(slot: int) -> JausAddress:
    """Return the JAUS address of the stack that drives the vehicle in a slot, all different."""
    return JausAddress(subsystem_of(slot), _FIRST_STACK_NODE + port_of(slot), STACK_COMPONENT, 1)
