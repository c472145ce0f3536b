"""Our hull behind ArduPilot's "JSON" physics interface, so that ArduRover's own SITL binary can drive it.

ArduPilot sends servo pulses in a small binary packet over UDP (port 9002) and waits for the vehicle's state as one line of
JSON; simulated time advances by one frame per packet, in lock-step. Start ``python -m sitl.plant.json_physics --vessel otter
--current 0.5``, then ``sim_vehicle.py -v Rover -f JSON:127.0.0.1``. Channels: 1 port thruster, 3 starboard thruster
(SERVO1_FUNCTION 73, SERVO3_FUNCTION 74), 2 port rudder, 4 starboard rudder (SERVO2_FUNCTION and SERVO4_FUNCTION 26).
Interface: ArduPilot libraries/SITL/examples/JSON/readme.md (names and layout only).
"""

from __future__ import annotations

import argparse
import json
import math
import random
import socket
import struct
import sys

from companion.core.hull import VesselConfig
from companion.settings import load_vessel

from .hull import SimVessel
from .water import Water, WaterConfig

PORT = 9002
_LAYOUTS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""Packet layout by its magic number: magic, frame rate in Hz, frame count, pulses in µs."""
_GRAVITY = 9.80665
_LONGEST_STEP_S = 0.02
_SLOWEST_HZ, _FASTEST_HZ = 20, 5000


class JsonPhysics:
    """One vessel in its water, stepped by servo packets. Packets of the wrong shape are dropped."""

    def __init__(self, vessel: VesselConfig, water: WaterConfig, seed: int = 0) -> None:
        self._config, self._water_config, self._seed = vessel, water, seed
        self._start()

    def _start(self) -> None:
        self.vessel = SimVessel(self._config)
        self._water = Water(self._water_config, random.Random(f"{self._seed}/water"))
        self.t_s = 0.0
        self._frame: int | None = None
        self._accel = (0.0, 0.0)

    def receive(self, packet: bytes) -> bytes | None:
        """Take one servo packet; return the reply, None when it is not one.

        A repeated frame is answered again without a step; a count that starts anew is a new run.
        """
        if len(packet) < 2:
            return None
        layout = _LAYOUTS.get(int.from_bytes(packet[:2], "little"))
        if layout is None or layout.size != len(packet):
            return None
        _, rate_hz, frame, *pulses_us = layout.unpack(packet)
        if self._frame is not None and frame < self._frame:
            self._start()
        if frame != self._frame:
            self._frame = frame
            self._advance(1.0 / min(max(rate_hz, _SLOWEST_HZ), _FASTEST_HZ), pulses_us)
        return self._reply()

    def _advance(self, dt_s: float, pulses_us: list[int]) -> None:
        hull = self.vessel
        before = hull.vn_mps, hull.ve_mps
        rudder_max = self._config.rudder.max_rad
        port, rudder_port, starboard, rudder_starboard = (_share(pulse) for pulse in pulses_us[:4])
        steps = math.ceil(dt_s / _LONGEST_STEP_S)
        for _ in range(steps):
            self._water.step(dt_s / steps)
            hull.step(
                dt_s / steps,
                port,
                starboard,
                rudder_port_rad=rudder_port * rudder_max,
                rudder_starboard_rad=rudder_starboard * rudder_max,
                water=self._water,
            )
        self.t_s += dt_s
        north, east = (hull.vn_mps - before[0]) / dt_s, (hull.ve_mps - before[1]) / dt_s
        cos, sin = math.cos(hull.psi_rad), math.sin(hull.psi_rad)
        self._accel = north * cos + east * sin, east * cos - north * sin

    def _reply(self) -> bytes:
        """The state; attitude is level, since the interface's accelerations are (waves act as a yaw moment)."""
        hull = self.vessel
        state = {
            "timestamp": self.t_s,
            "imu": {"gyro": [0.0, 0.0, hull.r_radps], "accel_body": [*self._accel, -_GRAVITY]},
            "position": [hull.north_m, hull.east_m, 0.0],
            "attitude": [0.0, 0.0, hull.psi_rad],
            "velocity": [hull.vn_mps, hull.ve_mps, 0.0],
        }
        return b"\n" + json.dumps(state, separators=(",", ":")).encode() + b"\n"


def _share(pulse_us: int) -> float:
    """-1...1 of a pulse; 0 µs is an output that is off."""
    return 0.0 if pulse_us == 0 else max(-1.0, min(1.0, (pulse_us - 1500) / 500.0))


def answer(link: socket.socket, physics: JsonPhysics) -> None:
    """Wait for one packet and answer its sender."""
    packet, sender = link.recvfrom(1024)
    reply = physics.receive(packet)
    if reply is not None:
        link.sendto(reply, sender)


def main(argv: list[str] | None = None) -> int:
    """Serve until interrupted."""
    parser = argparse.ArgumentParser(prog="python -m sitl.plant.json_physics", description=__doc__)
    parser.add_argument("--vessel", default="otter", help="a shipped vessel or a path")
    parser.add_argument("--port", type=int, default=PORT)
    parser.add_argument("--current", type=float, default=0.0, metavar="MPS")
    parser.add_argument("--current-to", type=float, default=90.0, metavar="DEG")
    parser.add_argument("--wind", type=float, default=0.0, metavar="MPS")
    parser.add_argument("--wind-from", type=float, default=270.0, metavar="DEG")
    parser.add_argument("--waves", type=float, default=0.0, metavar="M", help="significant height")
    parser.add_argument("--start", type=float, default=25.0, metavar="S", help="still water before this time")
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(argv)
    water = WaterConfig(
        current_mps=chosen.current,
        current_to_deg=chosen.current_to,
        wind_mps=chosen.wind,
        wind_from_deg=chosen.wind_from,
        wave_height_m=chosen.waves,
        start_s=chosen.start,
    )
    physics = JsonPhysics(load_vessel(chosen.vessel), water, chosen.seed)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", chosen.port))
        sys.stderr.write(f"{chosen.vessel} answers servo packets on UDP {chosen.port}\n")
        try:
            while True:
                answer(link, physics)
        except KeyboardInterrupt:
            return 0


if __name__ == "__main__":
    sys.exit(main())
