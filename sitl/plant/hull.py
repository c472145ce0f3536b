"""The simulated hull: actuators, forces and motion of one vessel in the water, stepped at 50 to 100 Hz.

Semi-implicit Euler on the force model that the controllers and the tuning tool share; thrusters with lag and dead
band, servos with lag and rate limit; faults that a test can switch on.
"""

from __future__ import annotations

import math
from math import cos, sin

from companion.core.hull import ForceModel, VesselConfig
from companion.core.hull.thrust import ThrustLaw
from mavlink_bridge.language.units import wrap_pi

from .water import STILL, Conditions


class SimVessel:
    """Truth. ``u_mps, v_mps, r_radps`` are through the water (m/s, rad/s, body axes), ``vn_mps, ve_mps`` over ground."""

    def __init__(self, config: VesselConfig) -> None:
        self.config = config
        self.model = ForceModel(config)
        self.north_m = self.east_m = self.psi_rad = 0.0
        self.u_mps = self.v_mps = self.r_radps = 0.0
        self.vn_mps = self.ve_mps = 0.0
        self.roll_rad = self.pitch_rad = self.heave_m = 0.0
        """Radians, radians, metres up."""
        self.revs = [0.0, 0.0]
        """Share of full revolutions, port and starboard."""
        self.thrust_n = [0.0, 0.0]
        self.rudder_rad = [0.0, 0.0]
        self.thruster_health = [1.0, 1.0]
        """Fault: share of its thrust that a thruster gives."""
        self.rudder_stuck_rad: list[float | None] = [None, None]
        """Fault: a rudder that stands at an angle."""
        self._law = law = ThrustLaw(config)
        self._ahead_n, self._astern_n, self._plain = (
            law.ahead_n,
            law.astern_n,
            law.plain and law.sides[0] == law.sides[1],
        )
        thruster, rudder = config.thruster, config.rudder
        self._dead_band, self._thruster_lag_s = thruster.dead_band, thruster.lag_s
        self._one_thruster, self._one_rudder = thruster.count == 1, rudder.count == 1
        self._rudder_max, self._rudder_lag_s = rudder.max_rad, rudder.lag_s
        self._rudder_rate = math.radians(rudder.rate_dps)
        self._rudder_offset = rudder.offset_rad if rudder.count else 0.0

    def place(self, *, north_m: float = 0.0, east_m: float = 0.0, psi_rad: float = 0.0, surge_mps: float = 0.0) -> None:
        """Put the hull somewhere, with way on through still water."""
        self.north_m, self.east_m, self.psi_rad, self.u_mps = north_m, east_m, psi_rad, surge_mps
        self.v_mps = self.r_radps = 0.0
        self.vn_mps, self.ve_mps = self.ground_velocity(STILL)

    def ground_velocity(self, water: Conditions) -> tuple[float, float]:
        """Return (north, east) over ground, m/s, in this water."""
        cosine, sine = cos(self.psi_rad), sin(self.psi_rad)
        u, v = self.u_mps, self.v_mps
        return cosine * u - sine * v + water.current_n_mps, sine * u + cosine * v + water.current_e_mps

    @property
    def surge_over_ground_mps(self) -> float:
        return math.cos(self.psi_rad) * self.vn_mps + math.sin(self.psi_rad) * self.ve_mps

    def step(
        self,
        dt_s: float,
        thruster_port: float,
        thruster_starboard: float,
        rudder_port_rad: float,
        rudder_starboard_rad: float,
        water: Conditions = STILL,
    ) -> None:
        """Advance by ``dt_s`` (0.005-0.02 s) with commands -1...1 and radians."""
        if self._one_thruster:
            thruster_starboard = thruster_port
        if self._one_rudder:
            rudder_starboard_rad = rudder_port_rad
        if self._plain:
            self._turn_propellers(dt_s, thruster_port, thruster_starboard)
        else:
            self._turn_by_law(dt_s, thruster_port, thruster_starboard)
        offset = self._rudder_offset
        self._turn_rudders(dt_s, rudder_port_rad + offset, rudder_starboard_rad + offset)
        self._sail(dt_s, water)

    def _sail(self, dt_s: float, water: Conditions) -> None:
        """Move the hull by what acts on it: actuators, wind, waves, current."""
        psi_rad = self.psi_rad
        cosine, sine = cos(psi_rad), sin(psi_rad)
        surge_n, sway_n, yaw_nm = self.weather(water, cosine, sine)
        u_mps, v_mps, r_radps = self.u_mps, self.v_mps, self.r_radps
        port_n, starboard_n = self.thrust_n
        port_rad, starboard_rad = self.rudder_rad
        du, dv, dr = self.model.rates(
            u_mps,
            v_mps,
            r_radps,
            thrust_port_n=port_n,
            thrust_starboard_n=starboard_n,
            rudder_port_rad=port_rad,
            rudder_starboard_rad=starboard_rad,
            surge_n=surge_n,
            sway_n=sway_n,
            yaw_nm=yaw_nm,
        )
        self.u_mps = u_mps = u_mps + du * dt_s
        self.v_mps = v_mps = v_mps + dv * dt_s
        self.r_radps = r_radps = r_radps + dr * dt_s
        self.vn_mps = vn_mps = cosine * u_mps - sine * v_mps + water.current_n_mps
        self.ve_mps = ve_mps = sine * u_mps + cosine * v_mps + water.current_e_mps
        self.north_m += vn_mps * dt_s
        self.east_m += ve_mps * dt_s
        self.psi_rad = wrap_pi(psi_rad + r_radps * dt_s)

    def weather(self, water: Conditions, cosine: float, sine: float) -> tuple[float, float, float]:
        """Return surge (N), sway (N) and yaw (Nm) of wind and waves on a hull whose heading has this cosine and sine."""
        surge_n = sway_n = yaw_nm = 0.0
        if water.wind_n_mps or water.wind_e_mps:
            north, east = water.wind_n_mps - self.vn_mps, water.wind_e_mps - self.ve_mps
            surge_n, sway_n, yaw_nm = self.model.wind(cosine * north + sine * east, cosine * east - sine * north)
        if water.wave_height_m > 0.0:
            yaw_nm += self._waves(water)
        elif self.roll_rad or self.pitch_rad or self.heave_m:
            self.roll_rad = self.pitch_rad = self.heave_m = 0.0  # the waves have just gone
        return surge_n, sway_n, yaw_nm

    def _turn_propellers(self, dt_s: float, port: float, starboard: float) -> None:
        share = dt_s / self._thruster_lag_s
        if share > 1.0:
            share = 1.0
        revs, thrust_n, health, dead_band = self.revs, self.thrust_n, self.thruster_health, self._dead_band
        alike = port == starboard and revs[0] == revs[1] and health[0] == health[1]
        side = 0
        for command in (port, starboard):
            if command >= dead_band:
                if command > 1.0:
                    command = 1.0
            elif command > -dead_band:
                command = 0.0
            elif command < -1.0:
                command = -1.0
            turns = revs[side]
            turns += (command - turns) * share
            full_n = self._ahead_n * turns * turns if turns >= 0.0 else self._astern_n * turns * -turns
            revs[side], thrust_n[side] = turns, full_n * health[side]
            if alike:
                revs[1], thrust_n[1] = revs[0], thrust_n[0]
                return
            side = 1

    def _turn_by_law(self, dt_s: float, port: float, starboard: float) -> None:
        """The same for propellers whose thrust is not the square of the command, alike on both sides, at any speed."""
        share, law = min(1.0, dt_s / self._thruster_lag_s), self._law
        for side, command in ((0, port), (1, starboard)):
            self.revs[side] += (law.revs(max(-1.0, min(1.0, command))) - self.revs[side]) * share
            self.thrust_n[side] = law.thrust_n(side, self.revs[side], self.u_mps) * self.thruster_health[side]

    def _turn_rudders(self, dt_s: float, port_rad: float, starboard_rad: float) -> None:
        share = 1.0 if self._rudder_lag_s <= dt_s else dt_s / self._rudder_lag_s
        most, limit, angles, stuck = self._rudder_rate * dt_s, self._rudder_max, self.rudder_rad, self.rudder_stuck_rad
        alike = port_rad == starboard_rad and angles[0] == angles[1] and stuck[0] is stuck[1] is None
        side = 0
        for wanted in (port_rad, starboard_rad):
            if wanted > limit:
                wanted = limit
            elif wanted < -limit:
                wanted = -limit
            move = (wanted - angles[side]) * share
            if move > most:
                move = most
            elif move < -most:
                move = -most
            held = stuck[side]
            angles[side] = angles[side] + move if held is None else held
            if alike:
                angles[1] = angles[0]
                return
            side = 1

    def _waves(self, water: Conditions) -> float:
        """Attitude and heave follow the waves at once (the hull is stiffer than they are slow); return the yaw moment."""
        sea, height = self.config.seakeeping, water.wave_height_m
        self.roll_rad = math.radians(sea.roll_deg_per_m) * height * water.wave
        self.pitch_rad = math.radians(sea.pitch_deg_per_m) * height * water.wave_quadrature
        self.heave_m = sea.heave_m_per_m * height * water.wave_quadrature
        return sea.yaw_nm_per_m * height * water.wave
