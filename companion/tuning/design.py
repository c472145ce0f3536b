"""Gains for the seed's law, chosen by margins: the fastest on a grid that keeps them at every speed the vessel can sail."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

from ..core.hull import VesselConfig
from ..core.steer import SteeringConfig
from ..core.steer.pid import PidGains
from ..core.steer.yaw_loop import DELAY_S
from .margins import SPEEDS_MPS, each_margin

_PROPORTIONAL = (0.3, 0.45, 0.6, 0.9, 1.2, 1.5, 1.8, 2.2, 2.7)
_DERIVATIVE = (0.0, 0.1, 0.2, 0.4, 0.6)
_HARDEST_FIRST = tuple(reversed(SPEEDS_MPS))
_INTEGRAL = 0.005 / 1.8
"""Integral gain over the proportional one: more of it and the clamped integral overshoots for half a minute."""
SPEED_GAINS: Final = PidGains(kp=0.6, ki=0.15)
"""The study's speed gains for the seed's law; they are not critical."""


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
