"""What propellers and rudders do at the moment, modelled from the commands that went out: their lags and the dead band."""

from __future__ import annotations

from mavlink_bridge.language.messages import ActuatorOutput
from mavlink_bridge.language.units import clamp

from .left import WHOLE
from .thrust import ThrustLaw
from .vessel_file import VesselConfig

_LINK_S = 0.02
"""Between a tick and the servo's start: the frame's way over the line, and the board's wait for the next servo pulse, of 20 ms at most."""


class ActuatorModel:
    """Follows the commands of one vessel; nothing sent is neutral."""

    def __init__(self, vessel: VesselConfig) -> None:
        thruster = vessel.thruster
        self._law = law = ThrustLaw(vessel)
        self._ahead_n, self._astern_n, self._plain = (
            law.ahead_n,
            law.astern_n,
            law.plain and law.sides[0] == law.sides[1],
        )
        self._single = thruster.count == 1
        self._dead_band = thruster.dead_band
        self._lag_s = thruster.lag_s
        self._rudder_lag_s = vessel.rudder.lag_s + _LINK_S
        self._felt_radps = vessel.rudder.felt_radps
        self._offset_rad = vessel.rudder.offset_rad if vessel.rudder.count else 0.0
        self._max_rad = vessel.rudder.max_rad
        self.shares = WHOLE
        """What each thruster gives of it."""
        self.clear()

    def clear(self) -> None:
        """Everything stands still."""
        self._port_revs = self._starboard_revs = 0.0
        self.port_n = self.starboard_n = 0.0
        """Thrust, N."""
        self.rudder_rad = 0.0

    def step(self, dt_s: float, sent: ActuatorOutput | None, surge_mps: float = 0.0) -> None:
        """Advance by one tick with what was sent during it, at a speed through the water."""
        port = starboard = rudder_rad = 0.0
        if sent is not None:
            port, rudder_rad = sent.thruster_port, sent.rudder_port_rad
            starboard = port if self._single else sent.thruster_starboard
        share = dt_s / self._lag_s if dt_s < self._lag_s else 1.0
        if not self._plain:
            self._turn(port, starboard, share, surge_mps)
        else:
            self._turn_plain(port, starboard, share)
        if self.shares is not WHOLE:
            self.port_n *= self.shares[0]
            self.starboard_n *= self.shares[1]
        share = dt_s / self._rudder_lag_s if dt_s < self._rudder_lag_s else 1.0
        told_rad = rudder_rad + self._offset_rad
        if self._offset_rad:
            told_rad = clamp(told_rad, -self._max_rad, self._max_rad)  # a servo told beyond its stop stands at it
        turned_rad = (told_rad - self.rudder_rad) * share
        if self._felt_radps is not None:
            most_rad = self._felt_radps * dt_s
            turned_rad = clamp(turned_rad, -most_rad, most_rad)
        self.rudder_rad += turned_rad

    def _turn(self, port: float, starboard: float, share: float, surge_mps: float) -> None:
        law = self._law
        self._port_revs += (law.revs(port) - self._port_revs) * share
        self._starboard_revs += (law.revs(starboard) - self._starboard_revs) * share
        self.port_n = law.thrust_n(0, self._port_revs, surge_mps)
        self.starboard_n = law.thrust_n(1, self._starboard_revs, surge_mps)

    def _turn_plain(self, port: float, starboard: float, share: float) -> None:
        """The same where thrust is the square of the command: every tick asks for it."""
        band, revs = self._dead_band, self._port_revs
        self._port_revs = revs = revs + ((0.0 if -band < port < band else port) - revs) * share
        self.port_n = (self._ahead_n if revs > 0.0 else self._astern_n) * revs * abs(revs)
        revs = self._starboard_revs
        self._starboard_revs = revs = revs + ((0.0 if -band < starboard < band else starboard) - revs) * share
        self.starboard_n = (self._ahead_n if revs > 0.0 else self._astern_n) * revs * abs(revs)
