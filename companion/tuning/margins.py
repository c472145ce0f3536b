"""Gain and phase margins of the heading loops at a stated delay, over the speed range; and gains of the seed's law chosen by them.

The loop is cut at the actuation: law, delay, actuators with their lags, hull. Needs the ``design`` extra.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.language.units import knots_to_mps

from ..core.hull import VesselConfig
from ..core.steer import SteeringConfig
from ..core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ..core.steer.law import SeedConfig
from ..core.steer.model import ModelController
from ..core.steer.pid import PidGains
from ..core.steer.yaw_loop import DELAY_S
from .plants import moment_plant, reachable, share_plant

SPEEDS_MPS = (0.5, 1.0, 1.5, 2.0, 2.5)
_PADE_ORDER = 5
_PROPORTIONAL = (0.3, 0.45, 0.6, 0.9, 1.2, 1.5, 1.8, 2.2, 2.7)
_DERIVATIVE = (0.0, 0.1, 0.2, 0.4, 0.6)
_HARDEST_FIRST = tuple(reversed(SPEEDS_MPS))
_INTEGRAL = 0.005 / 1.8
"""Integral gain over the proportional one: more of it and the clamped integral overshoots for half a minute."""
SPEED_GAINS: Final = PidGains(kp=0.6, ki=0.15)
"""The study's speed gains for the seed's law; they are not critical."""


@dataclass(frozen=True, slots=True)
class Margins:
    """Robustness of one loop at one speed."""

    speed_mps: float
    gain_db: float
    """Least factor, up or down, that makes it unstable."""
    phase_deg: float
    peak: float
    """Greatest sensitivity Ms."""
    crossover_radps: float

    @property
    def holds(self) -> bool:
        return self.gain_db >= GAIN_BAR_DB and self.phase_deg >= PHASE_BAR_DEG


def loop_margins(loop: Any, speed_mps: float, delay_s: float) -> Margins:
    """Return the margins of a state-space loop with a delay in it; zero where the closed loop is unstable.

    The delay is exact in the frequency response, and a Padé fraction in the test for stability.
    """
    import control
    import numpy

    closed = control.feedback(control.ss(*_pade(delay_s)) * loop if delay_s > 0.0 else loop, 1)
    if max(pole.real for pole in closed.poles()) > 1e-6:
        return Margins(speed_mps, 0.0, 0.0, math.inf, 0.0)
    omega = numpy.logspace(-2, 2, 2000)
    answer = loop(1j * omega, squeeze=True) * numpy.exp(-1j * omega * delay_s)
    response = control.frd(answer, omega, smooth=True)
    gains, phases, stabilities, _, crossovers, _ = control.stability_margins(response, returnall=True)
    gain_db = min((abs(20.0 * math.log10(gain)) for gain in gains if gain > 0.0), default=math.inf)
    phase_deg = min((abs(float(phase)) for phase in phases), default=math.inf)
    peak = 1.0 / float(numpy.min(numpy.abs(1.0 + answer))) if not len(stabilities) else 1.0 / float(min(stabilities))
    return Margins(speed_mps, gain_db, phase_deg, peak, max((float(w) for w in crossovers), default=0.0))


def _pade(delay_s: float) -> tuple[Any, Any, Any, Any]:
    import control

    fraction = control.ss(control.tf(*control.pade(delay_s, _PADE_ORDER)))
    return fraction.A, fraction.B, fraction.C, fraction.D


def _in_weather(vessel: VesselConfig) -> VesselConfig:
    """The vessel with the lag that her rudders have in the swings of weather, which is what the law reckons with."""
    rudder = vessel.rudder
    if vessel.helm_lag_s == rudder.lag_s:
        return vessel
    return vessel.model_copy(update={"rudder": rudder.model_copy(update={"lag_s": vessel.helm_lag_s})})


def model_loop(config: SteeringConfig, vessel: VesselConfig, speed_mps: float) -> Any:
    """Return the heading loop of profile ``model``, in state space: PD on heading and measured rate, and the integral."""
    import control

    kp, ki, kd = ModelController(config, vessel).heading_gains(speed_mps)
    plant = moment_plant(_in_weather(vessel), speed_mps)
    return control.ss([[0.0]], [[1.0, 0.0]], [[ki]], [[kp, kd]]) * plant


def seed_share(seed: SeedConfig, vessel: VesselConfig, speed_mps: float) -> float:
    """Return the thrusters' share of the seed's heading output at a speed; none where they do not turn the hull."""
    if not vessel.thruster.turns:
        return 0.0
    fast = speed_mps > knots_to_mps(seed.high_speed_threshold_kn)
    return seed.high_speed_thruster_share if fast else seed.low_speed_thruster_share


def seed_loop(config: SteeringConfig, vessel: VesselConfig, speed_mps: float, gains: PidGains) -> Any:
    """Return the heading loop of profile ``seed`` at the share that holds at this speed."""
    import control

    # the derivative is a difference over one tick: a filter of half of it keeps the function proper
    fast_pole = 1.0 / 0.025
    law = control.ss(
        [[0.0, 0.0], [0.0, -fast_pole]],
        [[1.0], [1.0]],
        [[gains.ki, -gains.kd * fast_pole * fast_pole]],
        [[gains.kp + gains.kd * fast_pole]],
    )
    return law * share_plant(_in_weather(vessel), speed_mps, seed_share(config.seed, vessel, speed_mps))


def heading_margins(
    config: SteeringConfig,
    vessel: VesselConfig,
    profile: str,
    delay_s: float = DELAY_S,
    speeds: tuple[float, ...] = SPEEDS_MPS,
) -> list[Margins]:
    """Return the margins over the speeds that the vessel is sailed at. ``profile`` is 'model' or 'seed'."""
    return list(each_margin(config, vessel, profile, delay_s, speeds))


def each_margin(
    config: SteeringConfig, vessel: VesselConfig, profile: str, delay_s: float, speeds: tuple[float, ...]
) -> Iterator[Margins]:
    """Yield the margins speed by speed, so that a search can stop at the first that fails."""
    gains = config.seed.heading_gains
    fastest = ModelController(config, vessel).steady_mps if profile != "seed" else math.inf
    for speed in reachable(vessel, speeds):
        if speed > fastest:
            continue
        if profile != "seed":
            loop = model_loop(config, vessel, speed)
        elif gains is not None:
            loop = seed_loop(config, vessel, speed, gains)
        else:
            raise ValueError("profile 'seed' has no gains to check: set steering.seed.heading_gains")
        yield loop_margins(loop, speed, delay_s + config.model.heading_late_s)


def seed_gains(
    config: SteeringConfig,
    vessel: VesselConfig,
    delay_s: float = DELAY_S,
    *,
    told: Callable[[int, int], None] = lambda done, total: None,
) -> PidGains | None:
    """Return heading gains with the most proportional, then derivative gain that hold everywhere; None if none do.

    ``told``: is given how many have been tried, of how many.
    """
    for done, gains in enumerate(grid()):
        told(done, len(_PROPORTIONAL) * len(_DERIVATIVE))
        seed = config.seed.model_copy(update={"heading_gains": gains})
        trial = config.model_copy(update={"seed": seed})
        if all(margins.holds for margins in each_margin(trial, vessel, "seed", delay_s, _HARDEST_FIRST)):
            return gains
    return None


def grid() -> Iterator[PidGains]:
    """Yield the heading gains that are tried, the most proportional and then derivative first."""
    for kp in reversed(_PROPORTIONAL):
        for kd in reversed(_DERIVATIVE):
            yield PidGains(kp=kp, ki=round(kp * _INTEGRAL, 4), kd=kd)


def as_toml(heading: PidGains, speed: PidGains, note: str) -> str:
    """Return the tables of a configuration file that set these gains."""
    lines = [f"# {note}"]
    for table, gains in (("heading_gains", heading), ("speed_gains", speed)):
        lines += [f"[steering.seed.{table}]", *(f"{key} = {getattr(gains, key):g}" for key in ("kp", "ki", "kd")), ""]
    return "\n".join(lines)
