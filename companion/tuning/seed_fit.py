"""Gains of the seed's law for a fitted file: the fastest on the grid that keep their margins over the whole confidence region."""

from __future__ import annotations

import cmath
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.steer import SteeringConfig
from ..core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ..core.steer.pid import PidGains
from ..core.steer.yaw_loop import DELAY_S, LoopJudge, LoopMargins
from .fit import Fit
from .fitted import corners
from .margins import SPEED_GAINS, SPEEDS_MPS, as_toml, grid, seed_share
from .plants import reachable, share_plant

Array = Any

_DIFFERENCE_S: Final = 0.025
"""The law's derivative is a difference over one tick of 0.05 s, which looks half of it back; here the whole loop does."""
_STILL: Final = 1e-6
"""Poles at most so far to the right, 1/s, are the heading's own at the origin."""


class ShareResponse:
    """The seed's heading output -> yaw rate of one vessel at one speed, as ``LoopJudge`` wants it."""

    def __init__(self, vessel: VesselConfig, speed_mps: float, share: float) -> None:
        plant = share_plant(vessel, speed_mps, share)
        self._a, self._b, self._c = (np.asarray(part, dtype=float) for part in (plant.A, plant.B, plant.C))

    @property
    def unstable_poles(self) -> int:
        """How many poles lie in the right half plane."""
        return int(np.sum(np.linalg.eigvals(self._a).real > _STILL))

    def response(self, omega: float, delay_s: float) -> complex:
        """Return yaw rate over output at a frequency in rad/s."""
        s = complex(0.0, omega)
        psi = self._c @ np.linalg.solve(s * np.eye(len(self._a)) - self._a, self._b)
        return complex(psi[0, 0]) * s * cmath.exp(-s * delay_s)


@dataclass(frozen=True, slots=True)
class SeedGains:
    """Gains of the seed's heading loop for a fitted file, and what they leave at each speed."""

    heading: PidGains
    speeds: tuple[float, ...]
    """Speeds through the water, m/s, up to the greatest at which any gains hold everywhere."""
    best: tuple[LoopMargins, ...]
    """With the fitted file."""
    worst: tuple[LoopMargins, ...]
    """At the worst corner of the confidence region."""
    whole: bool
    """They hold at all speeds that were looked at."""

    @property
    def words(self) -> str:
        """Say them, with what they leave at the worst corner and speed."""
        gains, gain_db, phase_deg = (
            self.heading,
            min(m.gain_db for m in self.worst),
            min(m.phase_deg for m in self.worst),
        )
        upto = "" if self.whole else f", up to {self.speeds[-1]:.1f} m/s only"
        return f"kp {gains.kp:g}, ki {gains.ki:g}, kd {gains.kd:g}: {gain_db:.1f} dB and {phase_deg:.0f} deg at the worst corner{upto}"

    @property
    def toml(self) -> str:
        """The tables of a configuration file that set them."""
        return as_toml(self.heading, SPEED_GAINS, f"seed law, fitted file: {self.words}")


def seed_gains_for(fit: Fit, vessel: VesselConfig, steering: SteeringConfig) -> SeedGains | None:
    """Return the gains with the most proportional, then derivative gain that hold at every corner; None where none do.

    Where none do at all speeds, those for the greatest speed up to which some do.
    """
    speeds, boats = reachable(vessel, SPEEDS_MPS), (vessel, *corners(fit))
    late_s = DELAY_S + steering.model.heading_late_s + _DIFFERENCE_S
    judges = [
        [LoopJudge(ShareResponse(boat, speed, seed_share(steering.seed, boat, speed)), late_s) for boat in boats]
        for speed in speeds
    ]
    for count in range(len(speeds), 0, -1):
        for gains in grid():
            if all(map(_kept, _margins(judges[:count], gains))):
                return _told(gains, speeds[:count], judges[:count], whole=count == len(speeds))
    return None


def _margins(judges: list[list[LoopJudge]], gains: PidGains) -> Iterator[LoopMargins]:
    """The fastest first: there most gains fail."""
    for row in reversed(judges):
        for judge in row:
            yield judge.margins(gains.kp, gains.ki, gains.kd)


def _kept(margins: LoopMargins) -> bool:
    return margins.gain_db >= GAIN_BAR_DB and margins.phase_deg >= PHASE_BAR_DEG


def _told(gains: PidGains, speeds: tuple[float, ...], judges: list[list[LoopJudge]], *, whole: bool) -> SeedGains:
    found = [[judge.margins(gains.kp, gains.ki, gains.kd) for judge in row] for row in judges]
    worst = tuple(LoopMargins(min(m.gain_db for m in row), min(m.phase_deg for m in row)) for row in found)
    return SeedGains(gains, speeds, tuple(row[0] for row in found), worst, whole)
