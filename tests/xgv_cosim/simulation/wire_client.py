"""A client of simulated cars on a loopback network, and simulations that it can reach."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from jaus.address import ComponentId, JausAddress
from jaus.codec import Decoded, encode
from jaus.header import Acknowledgement
from jaus.messages.core import RequestComponentControl, Resume
from jaus.messages.torc import Motion, SetMotionProfile
from jaus.packet import Framing, decode_packet, pack_datagrams, unpack_datagram
from jaus.transports import LoopbackNetwork
from tests.xgv_cosim.simulation.bare_world import Car, simulation
from xgv_cosim.links.jaus_network import JausNetwork

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jaus.messages import Message
    from xgv_cosim.injection import Injection
    from xgv_cosim.simulation import Simulation
    from xgv_cosim.vehicles.xgv.settings import XgvSettings

M = TypeVar("M")
NM, PD, MPD, VSS, SD, EM = (
    ComponentId.NODE_MANAGER,
    ComponentId.PRIMITIVE_DRIVER,
    ComponentId.MOTION_PROFILE_DRIVER,
    ComponentId.VELOCITY_STATE_SENSOR,
    ComponentId.SIGNALS_DRIVER,
    ComponentId.ERROR_MANAGER,
)
OWN, OTHER = JausAddress(100, 2, 40, 1), JausAddress(101, 2, 40, 1)
CARS = ("cars", 0)
"""Where the first port of the network is."""


def motion(
    speed_mps: float = 5.0, duration_ms: int = 400, atan_curvature_rad: float = 0.0
) -> SetMotionProfile:
    return SetMotionProfile(motions=(Motion(speed_mps, 2.0, atan_curvature_rad, 0.1, duration_ms),))


def reachable(
    cars: Mapping[str, Car],
    injections: Sequence[Injection] = (),
    settings: XgvSettings | None = None,
    *,
    with_stacks: bool = False,
    lockstep: bool = True,
    **parameters: float,
) -> tuple[Simulation, LoopbackNetwork]:
    """Return a simulation whose cars are on a loopback network; nobody else drives them, unless asked."""
    run, loopback = simulation(cars, injections, settings, **parameters), LoopbackNetwork()
    run.connect(JausNetwork(lambda number: loopback.open(("cars", number))), lockstep=lockstep)
    if not with_stacks:
        for name in run.vehicle_ids:
            run.state.vehicles.connect(name, None)
    return run, loopback


class WireClient:
    """Speaks to cars behind the first port and remembers what they have said."""

    def __init__(
        self,
        loopback: LoopbackNetwork,
        place: str = "client",
        address: JausAddress = OWN,
        car: tuple[str, int] = CARS,
    ) -> None:
        self._car = car
        self.transport = loopback.open(place)  # type: ignore[arg-type]
        self.address = address
        self.heard: list[Decoded] = []

    def say(
        self, message: Message, component: ComponentId, subsystem: int = 1, *, wants_ack: bool = False
    ) -> None:
        """Send a message to a component of a car."""
        wanted = Acknowledgement.REQUESTED if wants_ack else Acknowledgement.NONE
        to = JausAddress(subsystem, 1, component, 1)
        packet = encode(message.to(to, source=self.address, sequence=7, acknowledgement=wanted))
        self.transport.send((each, self._car) for each in pack_datagrams(Framing.JUDP1, [packet]))

    def take_control(self, subsystem: int = 1) -> None:
        """Do what public clients do before they drive."""
        self.say(RequestComponentControl(6), MPD, subsystem)
        self.say(Resume(), PD, subsystem)
        self.say(Resume(), MPD, subsystem)

    def listen(self, kind: type[M]) -> list[M]:
        """Return the messages of a kind that have come since the last call; the others are kept."""
        for datagram, _ in self.transport.receive():
            framing, packets = unpack_datagram(datagram)
            self.heard += [decode_packet(framing, packet) for packet in packets]
        found = [message for message in self.heard if isinstance(message, kind)]
        self.heard = [message for message in self.heard if not isinstance(message, kind)]
        return found
