"""Everything outside the vessel's computer: hull, water, bottom, sensors and actuator board, advanced in lock-step.

The plant talks bytes only: NMEA out, Arduino lines in and out. Who carries them (memory, TCP, pty) is the world's
business. One seeded generator per source, so that a change in one does not shift the others.
"""

from __future__ import annotations

import math
import random
from typing import Protocol

from companion.core.board import ActuatorConfig
from companion.core.board.arduino import PulseMap
from companion.core.guard.depth.grid import DepthGrid
from companion.core.hull import VesselConfig
from companion.core.hull.geometry import geometry_of
from mavlink_bridge.language.geodesy import LocalFrame

from ..board.avr import make_board
from ..plant import MovedVessel, SimVessel, Truth, Water
from ..plant.bottom import make_bottom
from ..sensors import SensorSuite
from .settings import WorldConfig


class Board(Protocol):
    """An actuator board: the Python twin or the real firmware on a simulated chip."""

    @property
    def pulses_us(self) -> tuple[float, float, float, float]: ...
    def receive(self, data: bytes, now_us: int) -> None: ...
    def step(self, now_us: int) -> bytes: ...


class Plant:
    """The simulated vessel and its surroundings."""

    def __init__(
        self,
        config: WorldConfig,
        vessel: VesselConfig,
        actuators: ActuatorConfig,
        seed: int,
        board: Board | None = None,
        sensor: str = "",
        chart: DepthGrid | None = None,
    ) -> None:
        """``sensor``: the sensor link whose place on the hull the talkers have."""
        self._step_us = config.step_us
        self.frame = LocalFrame(*config.start_rad)
        self.board: Board = board or make_board(config.arduino)
        self.bottom = make_bottom(config.bottom, self.frame, chart)
        self.water = Water(config.water, _generator(seed, "water"))
        self.vessel = MovedVessel(vessel, config.moved) if config.moved else SimVessel(vessel)
        if not config.moved:
            self.vessel.place(north_m=0.0, east_m=0.0, psi_rad=math.radians(config.heading_deg))
        self.sensors = SensorSuite(config.sensors, _generator(seed, "sensors"), geometry_of(vessel, [sensor]))
        self._map = PulseMap(actuators, vessel.rudder.max_rad)
        self._pulses_us = self.board.pulses_us
        self._demand = self._map.demand(self._pulses_us)
        self.now_us = 0
        """How far the plant has come."""
        self.truth = self._measure(0)

    def step(self, now_us: int) -> tuple[list[bytes], bytes]:
        """Advance to ``now_us``; return (NMEA sentences due, bytes from the actuator board)."""
        said, at_us, step_us = b"", self.now_us, self._step_us
        board, water, vessel = self.board, self.water, self.vessel
        port, starboard, port_rad, starboard_rad = self._demand
        while at_us < now_us:
            span_us = step_us if at_us + step_us < now_us else now_us - at_us
            at_us += span_us
            dt_s = span_us * 1e-6
            water.step(dt_s)
            said += board.step(at_us)
            if board.pulses_us is not self._pulses_us:
                self._pulses_us = board.pulses_us
                port, starboard, port_rad, starboard_rad = self._demand = self._map.demand(self._pulses_us)
            vessel.step(
                dt_s,
                port,
                starboard,
                rudder_port_rad=port_rad,
                rudder_starboard_rad=starboard_rad,
                water=water,
            )
        self.now_us = at_us
        self.truth = truth = self._measure(now_us)
        return self.sensors.step(now_us, truth), said

    def _measure(self, now_us: int) -> Truth:
        hull = self.vessel
        north_m, east_m = hull.north_m, hull.east_m
        lat_rad, lon_rad = self.frame.to_geodetic(north_m, east_m)
        vn_mps, ve_mps = hull.ground_velocity(self.water)
        return Truth(
            t_us=now_us,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            north_m=north_m,
            east_m=east_m,
            psi_rad=hull.psi_rad,
            u_mps=hull.u_mps,
            v_mps=hull.v_mps,
            r_radps=hull.r_radps,
            vn_mps=vn_mps,
            ve_mps=ve_mps,
            roll_rad=hull.roll_rad,
            pitch_rad=hull.pitch_rad,
            heave_m=hull.heave_m,
            depth_m=self.bottom.depth_at(north_m, east_m),
        )


def _generator(seed: int, source: str) -> random.Random:
    return random.Random(f"{seed}/{source}")
