"""What propellers and rudders do at the moment, modelled from the commands that went out: their lags and the dead band."""

from __future__ import annotations

from mavlink_bridge.language.messages import ActuatorOutput

from .vessel_file import VesselConfig, full_ahead_n, full_astern_n

_LINK_S = 0.02
"""Between a tick and the servo's start."""


class ActuatorModel:
    """Follows the commands of one vessel; nothing sent is neutral."""

    def __init__(self, vessel: VesselConfig) -> None:
        thruster = vessel.thruster
        self._ahead_n = full_ahead_n(vessel)
        self._astern_n = full_astern_n(vessel)
        self._single = thruster.count == 1
        self._dead_band = thruster.dead_band
        self._lag_s = thruster.lag_s
        self._rudder_lag_s = vessel.rudder.lag_s + _LINK_S
        self.clear()

    def clear(self) -> None:
        """Everything stands still."""
        self._port_revs = self._starboard_revs = 0.0
        self.port_n = self.starboard_n = 0.0
        """Thrust, N."""
        self.rudder_rad = 0.0

    def step(self, dt_s: float, sent: ActuatorOutput | None) -> None:
        """Advance by one tick with what was sent during it."""
        port = starboard = rudder_rad = 0.0
        if sent is not None:
            port, rudder_rad = sent.thruster_port, sent.rudder_port_rad
            starboard = port if self._single else sent.thruster_starboard
        share = dt_s / self._lag_s if dt_s < self._lag_s else 1.0
        band, revs = self._dead_band, self._port_revs
        self._port_revs = revs = revs + ((0.0 if -band < port < band else port) - revs) * share
        self.port_n = (self._ahead_n if revs > 0.0 else self._astern_n) * revs * abs(revs)
        revs = self._starboard_revs
        self._starboard_revs = revs = revs + ((0.0 if -band < starboard < band else starboard) - revs) * share
        self.starboard_n = (self._ahead_n if revs > 0.0 else self._astern_n) * revs * abs(revs)
        share = dt_s / self._rudder_lag_s if dt_s < self._rudder_lag_s else 1.0
        self.rudder_rad += (rudder_rad - self.rudder_rad) * share
