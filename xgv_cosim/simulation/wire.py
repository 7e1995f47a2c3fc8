"""Bound vehicles as subsystems of a JAUS network: clients' messages in, answers and reports out.

The core stays the same: a message that is a command meets the endpoint as one of the in-process link does.
What is the wire's own is here: who may speak as whom, and who is told that control was granted, refused or
lost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from jaus.address import ComponentId, JausAddress
from jaus.messages import Message
from jaus.messages.core import (
    ConfirmComponentControl,
    ControlResponse,
    RejectComponentControl,
)
from jaus.service_connection import Client
from xgv_cosim.endpoint import ReleaseControl, RequestControl, StackMessage
from xgv_cosim.errors import CommandError
from xgv_cosim.links.in_process import InProcessLink
from xgv_cosim.simulation import commanding
from xgv_cosim.simulation.addresses import port_of, stack_address, subsystem_of
from xgv_cosim.simulation.readings import Readings
from xgv_cosim.simulation.under_way import UnderWay

if TYPE_CHECKING:
    from jaus.port import MessageReceived
    from xgv_cosim.links.jaus_network import JausNetwork
    from xgv_cosim.simulation.binding import BoundVehicle
    from xgv_cosim.simulation.state import RunState
    from xgv_cosim.vehicles.base import VehicleOnTheWire

_ROUNDING_S = 1e-6
"""Deadlines of reports are sums of floats; one this near is due."""
Announce = Callable[[str, int, str], None]


class _Request(NamedTuple):
    """A request for control that is not answered yet: the message is under way (``command_latency_s``)."""

    client: Client
    command: RequestControl
    message: Message


@dataclass(slots=True)
class _Car:
    vehicle: BoundVehicle
    face: VehicleOnTheWire
    port: int
    holders: dict[ComponentId, JausAddress | None]
    """Who controlled each component when it was last looked at."""
    clients: dict[JausAddress, Client] = field(default_factory=dict)
    """Who has control or asked for it, and where he speaks from."""
    requests: list[_Request] = field(default_factory=list)
    gives_back: dict[tuple[JausAddress, ComponentId], StackMessage] = field(default_factory=dict)
    """Releases that act now or are under way: who gives a component back need not be told that he has lost
    it. One of who does not hold it is forgotten when it has acted, before he can have asked for it."""
    under_way: UnderWay = field(init=False)

    def __post_init__(self) -> None:
        self.under_way = UnderWay(self.vehicle)
        self.face.node.prefers = self.is_controlled_by

    def is_controlled_by(self, client: Client) -> bool:
        """Return whether a client controls a component of the car; nobody does by his JAUS id alone."""
        holders = self.vehicle.endpoint.component_controller.values()
        return self.clients.get(client.address) == client and client.address in holders


class VehiclesOnTheWire:
    """All bound vehicles that speak JAUS, on a network.

    Args:
        network: Its ports; this object closes it.
        announce: Told of each vehicle that comes onto it: vehicle, subsystem number, place of its port.
    """

    def __init__(self, network: JausNetwork, announce: Announce | None = None) -> None:
        self.network = network
        self._announce = announce
        self._cars: dict[str, _Car] = {}
        self._by_node: dict[int, _Car] = {}
        self._known: list[BoundVehicle] | None = None
        self._last_s = 0.0

    def follow(self, state: RunState) -> None:
        """Put vehicles on the network that were bound since, and take away those that were released."""
        present = state.vehicles.in_slot_order
        if present is self._known:
            return
        self._known = present
        vehicles = {vehicle.vehicle_id: vehicle for vehicle in present}
        for name, car in list(self._cars.items()):
            if vehicles.get(name) is not car.vehicle:
                self._remove(name)
        for name, vehicle in vehicles.items():
            if name not in self._cars:
                self._add(state, vehicle)

    def exchange(self, state: RunState, now_s: float) -> None:
        """Take what clients have sent, and send what they are to have.

        Args:
            state: The run; commands act at its time.
            now_s: The time on the network: the run's in lockstep, in real time as far on as the wall's clock.
        """
        self.follow(state)
        for car in self._cars.values():
            devices = car.vehicle.devices
            car.face.node.is_silent = not (car.vehicle.is_computing and devices.hears_stack)
            car.under_way.count()
        for arrived in self.network.receive(now_s):
            self._take(state, arrived)
        for car in self._cars.values():
            self._answer(car)
            self._note_traffic(state, car, now_s)
        self.network.flush(now_s + _ROUNDING_S)
        self._last_s = now_s

    def close(self) -> None:
        """Leave the network; clients with service connections are told.

        Raises:
            LinkError: What goes over the network cannot be recorded; its ports are given back all the same.
        """
        try:
            for name in list(self._cars):
                self._remove(name)
            self.network.flush(self._last_s)
        finally:
            self.network.close()

    def _add(self, state: RunState, vehicle: BoundVehicle) -> None:
        subsystem, port = subsystem_of(vehicle.slot), port_of(vehicle.slot)
        face = vehicle.binding.profile.on_the_wire(
            vehicle.vehicle_id, subsystem, Readings(state, vehicle), state.now_s
        )
        if face is None:
            return
        car = _Car(vehicle, face, port, vehicle.endpoint.component_controller)
        self.network.add(face.node, port)
        self._cars[vehicle.vehicle_id] = self._by_node[id(face.node)] = car
        place = self.network.places[port]
        where = f"{place[0]}:{place[1]}" if isinstance(place, tuple) else str(place)
        state.note(vehicle.vehicle_id, "jaus_subsystem", after=str(subsystem), reasons=(f"at {where}",))
        if self._announce is not None:
            self._announce(vehicle.vehicle_id, subsystem, where)

    def _remove(self, vehicle_id: str) -> None:
        car = self._cars.pop(vehicle_id)
        del self._by_node[id(car.face.node)]
        self.network.remove(car.face.node, car.port)

    def _take(self, state: RunState, arrived: MessageReceived) -> None:
        message, client = arrived.message, arrived.client
        if not isinstance(message, Message):
            return  # an acknowledgement, or a part of what is not whole
        if message.header.destination.is_broadcast:
            return  # commands are for one component
        car = self._by_node[id(arrived.node)]
        if car.face.clears_errors(message):
            self._clear_errors(state, car, client)
            return
        try:
            command = car.face.command_of(message)
        except CommandError as error:
            meant = type(message).__name__.removeprefix("Set")  # so the commands are called
            commanding.note_refusal(state, car.vehicle, meant, str(error))
            return
        if command is None:
            return
        if reason := self._why_unheard(car, client):
            commanding.note_refusal(state, car.vehicle, commanding.name_of(command), reason)
            if isinstance(command, RequestControl):
                self._send(car, command.component, RejectComponentControl(), client, message.header.sequence)
            return
        self._command(state, car, client, message, command)

    def _clear_errors(self, state: RunState, car: _Car, client: Client) -> None:
        """Have latched errors forgotten by one who has control: who is a stranger moves no car (XGV-10)."""
        if self._is_forged(car, client):
            reason = _forged(client)
        elif client.address not in car.vehicle.endpoint.component_controller.values():
            reason = f"{client.address} controls no component of the car"
        else:
            state.errors_to_clear.append(car.vehicle.vehicle_id)
            return
        commanding.note_refusal(state, car.vehicle, "ClearErrors", reason)

    def _command(
        self, state: RunState, car: _Car, client: Client, message: Message, command: StackMessage
    ) -> None:
        if isinstance(command, RequestControl):
            car.clients[client.address] = client
            car.requests.append(_Request(client, command, message))
        elif isinstance(command, ReleaseControl):
            car.gives_back[client.address, command.component] = command
        commanding.take_in(state, car.vehicle, client.address, command)
        if car.vehicle.on_the_way:
            return  # nothing has acted yet; what has by then is answered at the end of an exchange
        car.under_way.count()
        self._answer(car)

    def _why_unheard(self, car: _Car, client: Client) -> str:
        """Return why a client may not command a car now, empty if he may; then he does."""
        if self._is_forged(car, client):
            return _forged(client)
        if not car.under_way.take(client.address):
            return f"too many messages of {client.address} are under way"
        return ""

    def _is_forged(self, car: _Car, client: Client) -> bool:
        """Return whether somebody speaks as one who has control, or asks for it, but from elsewhere (XGV-65).

        As the stack of this process nobody speaks from outside, whether it has control or not.
        """
        known, vehicle = car.clients.get(client.address), car.vehicle
        if known is not None:
            return known.transport != client.transport
        is_stack = isinstance(vehicle.link, InProcessLink) and client.address == stack_address(vehicle.slot)
        return is_stack or client.address in vehicle.endpoint.component_controller.values()

    def _answer(self, car: _Car) -> None:
        """Confirm or reject requests that have arrived, and tell who has lost control."""
        now = car.vehicle.endpoint.component_controller
        under_way = {id(message) for _, _, message in car.vehicle.on_the_way}
        arrived = [each for each in car.requests if id(each.command) not in under_way]
        car.requests = [each for each in car.requests if id(each.command) in under_way]
        for request in arrived:
            granted = now.get(request.command.component) == request.client.address
            answer = (
                ConfirmComponentControl(ControlResponse.ACCEPTED) if granted else RejectComponentControl()
            )
            sequence = request.message.header.sequence
            self._send(car, request.command.component, answer, request.client, sequence)
        for component, before in car.holders.items():
            if before is None or now[component] == before or before not in car.clients:
                continue
            if (before, component) not in car.gives_back:
                self._send(car, component, RejectComponentControl(), car.clients[before])
        car.holders = now
        asking = {request.client.address for request in car.requests}
        car.gives_back = {key: each for key, each in car.gives_back.items() if id(each) in under_way}
        for address in [each for each in car.clients if each not in now.values() and each not in asking]:
            del car.clients[address]

    def _send(
        self, car: _Car, component: ComponentId, message: Message, client: Client, sequence: int = 0
    ) -> None:
        if car.face.node.is_silent:
            return
        own = car.face.node.description.address(component)
        self.network.send(message.to(client.address, source=own, sequence=sequence), client, car.port)

    def _note_traffic(self, state: RunState, car: _Car, now_s: float) -> None:
        """Let the endpoint know that who controls it is not silent: anything from where he is counts."""
        if car.face.node.is_silent:
            return
        for address, client in car.clients.items():
            if self.network.heard_s(client.transport, car.port) >= now_s:
                car.vehicle.endpoint.heard(address, state.now_s)
                state.alarms.touch(car.vehicle)


def _forged(client: Client) -> str:
    return f"{client.address} speaks from elsewhere than {client.transport}"
