"""Drives one car of a running simulation from a process of its own, over JAUS.

In one terminal:  xgv-cosim run hello --jaus 127.0.0.1:3794 --set bind.0.stack=external
In another:       python examples/jaus_client.py

It asks for the Motion Profile Driver, resumes both drivers, and repeats a motion profile ten times a second;
what the car reports of its modes and its speed is printed once a second. Nothing here knows that the car is
simulated.
"""

from __future__ import annotations

import argparse
import select
import time

from jaus import ComponentId, Controller, JausAddress
from jaus.messages.core import ReleaseComponentControl, RequestComponentControl, Resume
from jaus.messages.platform import ReportVelocityState
from jaus.messages.torc import Motion, ReportVehicleMode, SetMotionProfile
from jaus.port import MessageReceived
from jaus.transports import UdpTransport
from jaus.vehicle_mode import safety_mode_of

AUTHORITY = 6
PERIOD_S = 0.1


def main() -> None:
    """Drive until the time is over, or nobody answers any more."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--host", default="127.0.0.1", help="where the simulation listens")
    parser.add_argument("--port", type=int, default=3794)
    parser.add_argument("--subsystem", type=int, default=1, help="which car, as the run prints it")
    parser.add_argument("--speed", type=float, default=8.0, help="m/s")
    parser.add_argument("--seconds", type=float, default=20.0)
    options = parser.parse_args()

    manager, primitive, profile, sensor = (
        JausAddress(options.subsystem, 1, component, 1)
        for component in (
            ComponentId.NODE_MANAGER,
            ComponentId.PRIMITIVE_DRIVER,
            ComponentId.MOTION_PROFILE_DRIVER,
            ComponentId.VELOCITY_STATE_SENSOR,
        )
    )
    motion = Motion(
        options.speed,
        max_acceleration_mps2=2.0,
        atan_curvature_rad=0.0,
        max_curvature_rate_per_m_s=0.1,
        duration_ms=400,
    )
    client = Controller(JausAddress(100, 2, 40, 1), (options.host, options.port), name="example client")
    with UdpTransport() as transport:
        began_s = time.monotonic()
        now_s, next_s, printed_s, heard_s = 0.0, 0.0, -1.0, 0.0
        mode: ReportVehicleMode | None = None
        client.subscribe(ReportVehicleMode, manager, 5.0, now_s)
        client.subscribe(ReportVelocityState, sensor, 10.0, now_s)
        while now_s < options.seconds and now_s - heard_s < 5.0:
            if now_s >= next_s:  # what is in force already is only confirmed again
                next_s += PERIOD_S
                client.command(RequestComponentControl(AUTHORITY), profile, now_s)
                client.command(Resume(), primitive, now_s)
                client.command(Resume(), profile, now_s)
                client.command(SetMotionProfile(motions=(motion,)), profile, now_s)
            transport.send(client.datagrams_to_send(now_s))
            select.select([transport], [], [], max(0.0, next_s - now_s))
            now_s = time.monotonic() - began_s
            for datagram, source in transport.receive():
                client.receive_datagram(datagram, source, now_s)
            while (event := client.next_event()) is not None:
                if not isinstance(event, MessageReceived):
                    continue
                heard_s = now_s
                if isinstance(event.message, ReportVehicleMode):
                    mode = event.message
                elif isinstance(event.message, ReportVelocityState) and now_s - printed_s >= 1.0:
                    printed_s = now_s
                    words = "" if mode is None else safety_mode_of(mode.safety_mode).name.lower()
                    print(f"{now_s:5.1f} s  {event.message.velocity_x_mps:6.2f} m/s  {words}")
        client.command(ReleaseComponentControl(), profile, now_s)
        transport.send(client.datagrams_to_send(now_s))


if __name__ == "__main__":
    main()
