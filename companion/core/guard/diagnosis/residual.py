"""From ticks to samples: what pushes and turns the hull beyond its model, and what each suspect would explain of it.

Both sides pass the same low-pass, so that no measured speed is differentiated. The drift that is taken off the ground speed,
and what the file is off by, follow the estimate only while nothing is suspected: it takes lost thrust for either within ten seconds.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from mavlink_bridge.language.value import value

from ...hull import ForceModel, VesselConfig
from ...hull.actuator_model import ActuatorModel
from .suspects import Acting, Suspect, effect, pushed

SAMPLE_S: Final = 0.5
"""A third of the low-pass."""
_TAU_S: Final = 1.5
"""Half a wave's period and more; a boat turned by a fault is far off its course after three of these."""
_DRIFT_TAU_S: Final = 12.0
"""As slow as the estimate itself, once more: what a fault adds to it in the second before it is suspected stays small."""
_LATE_S: Final = 0.25
"""Heading, turn rate and speed are so late against the thrust that makes them: a tenth of a second for the best receiver, half a second
for a compass that smooths. A helm that answers a late turn rate would else be read as a moment from nowhere, twice in each swing."""


class LateThrust:
    """What the actuators did when the motion happened that is seen now."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, tuple[float, float, float]]] = deque()
        self._age_s = 0.0
        """Of the oldest."""

    def step(self, dt_s: float, newest: tuple[float, float, float]) -> tuple[float, float, float]:
        """Take port (N), starboard (N) and rudders (rad) of this tick; return those of ``_LATE_S`` ago, or the oldest there are."""
        past = self._past
        self._age_s += dt_s if past else 0.0
        past.append((dt_s, newest))
        while len(past) > 1 and self._age_s > _LATE_S + 0.5 * dt_s:
            past.popleft()
            self._age_s -= past[0][0]
        return past[0][1]


@value
class Sample:
    """Surge (N) and yaw (Nm): what is unexplained, and what each suspect explains of it."""

    unexplained: tuple[float, float]
    effects: tuple[tuple[float, float], ...]
    thrust_n: float
    """Both sides together, whatever their sense: how much the model can be wrong by."""
    on_station: bool
    aside_nm: float = 0.0
    """What the modelled yaw moment is off by when the way aside through the water is: a hull without a fin is turned by it."""
    upset: bool = False
    """The water itself has just changed: what was known of the weather is gone."""
    file_off: float = 0.0
    """By this share of her speed the hull's file was off before anything was suspected."""


_STATION_MPS: Final = 0.5
"""Slower than this over ground the boat keeps a station."""
_STATION_TAU_S: Final = 5.0
"""Longer than a gust drives it off or a corner slows it."""


_ASIDE_MPS: Final = 0.04
"""The way aside through the water is known no better: the drift is a mean, and the receiver's velocity has its noise. On a hull that
turns away by itself such an error looked like thrusters changed over, five times in twelve hours of a gale."""
_JUMP_MPS: Final = 0.6
"""Sway over ground that changes by more within ``_JUMP_SAMPLES`` is an eddy: no thruster and no rudder sets a hull aside so quickly."""
_JUMP_SAMPLES: Final = 2
_SPIN_RADPS: Final = 0.3
"""Twice what steering turns a boat by: a hull that spins slips as quickly."""


class Residual:
    """One vessel; one call per tick, now and then a sample."""

    def __init__(self, vessel: VesselConfig, model: ForceModel, among: tuple[Suspect, ...]) -> None:
        self._hull, self._model, self._among = vessel.hull, model, among
        self._actuators = ActuatorModel(vessel)
        self.forget()

    def forget(self) -> None:
        """Begin anew: a time without position or heading, or another arming."""
        self._low: list[float] | None = None
        self._late = LateThrust()
        self._sum = [0.0] * 8
        self._sways: list[float] = []
        self._sum_s = self._seen_s = self._ground_mps = 0.0
        self._drift_mps = (0.0, 0.0)
        self._file_off = 0.0

    @property
    def before_mps(self) -> tuple[float, float]:
        """The drift, north and east, as it was before anything was suspected."""
        return self._drift_mps

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None, suspected: bool) -> Sample | None:
        """Take one tick and what was sent before it."""
        psi, u, v, r = state.compass_rad, state.u_mps, state.v_mps, state.r_radps
        if psi is None or u is None or v is None or r is None or not 0.0 < dt_s < SAMPLE_S:
            self.forget()
            return None
        self._seen_s += dt_s
        if not suspected:
            self._file_off += dt_s / _DRIFT_TAU_S * (abs(state.made_share) - self._file_off)
            self._follow_drift(dt_s, state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        (north, east), cos, sin = self._drift_mps, math.cos(psi), math.sin(psi)
        water_u, water_v = u - north * cos - east * sin, v + north * sin - east * cos
        actuators = self._actuators
        actuators.step(dt_s, sent, water_u)
        acts = self._late.step(dt_s, (actuators.port_n, actuators.starboard_n, actuators.rudder_rad))
        values = (water_u, water_v, r, *acts, u, v)
        self._sum = [total + dt_s * newest for total, newest in zip(self._sum, values, strict=True)]
        self._sum_s += dt_s
        if self._sum_s < SAMPLE_S - 0.5 * dt_s:
            return None
        step_s = self._sum_s
        mean_u, mean_v, mean_r, port_n, starboard_n, angle, ground, sway = [total / step_s for total in self._sum]
        self._sum, self._sum_s = [0.0] * 8, 0.0
        self._ground_mps += step_s / _STATION_TAU_S * (abs(ground) - self._ground_mps)
        acting = Acting(
            u_mps=mean_u, v_mps=mean_v, r_radps=mean_r, port_n=port_n, starboard_n=starboard_n, rudder_rad=angle
        )
        return self._sample(step_s, acting, upset=self._jumps(sway, mean_r))

    def _jumps(self, sway_mps: float, turn_radps: float) -> bool:
        """Whether the sway has jumped; then the drift is found anew."""
        past = self._sways = [*self._sways[-_JUMP_SAMPLES:], sway_mps]
        if abs(sway_mps - past[0]) < _JUMP_MPS or abs(turn_radps) > _SPIN_RADPS:
            return False
        self._seen_s = 0.0
        return True

    def _follow_drift(self, dt_s: float, north_mps: float, east_mps: float) -> None:
        share = dt_s / (self._seen_s if self._seen_s < _DRIFT_TAU_S else _DRIFT_TAU_S)
        north, east = self._drift_mps
        self._drift_mps = (north + share * (north_mps - north), east + share * (east_mps - east))

    def _forces(self, acting: Acting, aside_mps: float = 0.0) -> tuple[float, float]:
        """Surge force (N) and yaw moment (Nm) that the model makes of all this, with so much more way aside."""
        hull = self._hull
        du, dv, dr = self._model.rates(
            acting.u_mps,
            acting.v_mps + aside_mps,
            acting.r_radps,
            thrust_port_n=acting.port_n,
            thrust_starboard_n=acting.starboard_n,
            rudder_port_rad=acting.rudder_rad,
            rudder_starboard_rad=acting.rudder_rad,
        )
        return hull.m11_kg * du, hull.m23_kgm * dv + hull.m33_kgm2 * dr

    def _sample(self, step_s: float, acting: Acting, *, upset: bool) -> Sample | None:
        hull, model = self._hull, self._model
        u, v, r = acting.u_mps, acting.v_mps, acting.r_radps
        healthy = pushed(model, acting, acting.port_n, acting.starboard_n, acting.rudder_rad)
        momenta = (hull.m11_kg * u, hull.m23_kgm * v + hull.m33_kgm2 * r)
        forces = self._forces(acting)
        effects = [part for suspect in self._among for part in effect(model, suspect, acting, healthy)]
        values = [*momenta, *forces, *effects]
        low, share = self._low, step_s / _TAU_S
        if low is None:
            self._low = values
            return None
        self._low = low = [old + share * (newest - old) for old, newest in zip(low, values, strict=True)]
        unexplained = ((momenta[0] - low[0]) / _TAU_S - low[2], (momenta[1] - low[1]) / _TAU_S - low[3])
        pairs = tuple(zip(low[4::2], low[5::2], strict=True))
        thrust_n = abs(acting.port_n) + abs(acting.starboard_n)
        return Sample(
            unexplained,
            pairs,
            thrust_n,
            on_station=self._ground_mps < _STATION_MPS,
            aside_nm=abs(self._forces(acting, _ASIDE_MPS)[1] - forces[1]),
            upset=upset,
            file_off=self._file_off,
        )
