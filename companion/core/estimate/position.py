"""Position and ground velocity: fixes moved to the reference point, gated, filtered, and predicted to the tick."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.geodesy import LocalFrame, metres_per_radian
from mavlink_bridge.language.messages import GpsFix, Severity
from mavlink_bridge.language.units import wrap_pi

from ..hull.geometry import Arm
from .antenna import NO_ARM, Attitude, Pair, at_centre, lever
from .clock import ClockAligner
from .config import POSITION_SIGMA_M, EstimatorConfig
from .doubts.agreement import FrozenWatch, PlaceAgainstSpeed
from .doubts.late_speed import LateSpeed
from .doubts.witness import SeenFix
from .filter import PairCovariance
from .told import ComesAndGoes

_OUTLIER_SIGMA: Final = 5.0
"""One good fix in two million is refused, if its errors are Gaussian."""
_OUTLIERS_MAX: Final = 3
"""After so many in a row it is the estimate that is wrong."""
_OUTLIERS_OF_SLOW: Final = 2
"""So many are enough where nothing else came for the time after which a position is none: a slow receiver would be given up first."""
_PREDICT_MAX_S: Final = 3.0
"""Dead reckoning without fixes is drift after longer than this."""
_NEWTON_STEPS: Final = 4
"""Each leaves a thousandth of the error: three make a micrometre of 500 m, and one sees it."""
_NEAR_M: Final = 500.0
"""What starts farther off is reckoned the long way: the steps are no longer so good there."""
_CLOSE_M: Final = 1e-4
"""A tenth of a millimetre, a hundredth of the best fix's noise."""


def near_local(frame: LocalFrame, lat_rad: float, lon_rad: float, north_m: float, east_m: float) -> tuple[float, float]:
    """``frame.to_local`` for a point whose place is known to some hundred metres: the same to micrometres (1 mm beside a pole),
    six times faster.

    Newton's method on the inverse map with the radii of curvature at the point; each step leaves about 1e-3 of the error.
    """
    meridian_m, parallel_m = metres_per_radian(lat_rad)
    for _ in range(_NEWTON_STEPS):
        lat, lon = frame.to_geodetic(north_m, east_m)
        step_n, step_e = (lat_rad - lat) * meridian_m, (lon_rad - lon) * parallel_m
        size_m = abs(step_n) + abs(step_e)
        if not size_m < _NEAR_M:
            return frame.to_local(lat_rad, lon_rad)
        north_m, east_m = north_m + step_n, east_m + step_e
        if size_m < _CLOSE_M:
            return north_m, east_m
    return frame.to_local(lat_rad, lon_rad)


Motion = tuple[float, float, float, float]
"""Predicted position (north and east of the origin, m) and ground velocity (north and east, m/s)."""


class PositionTrack:
    """The vessel's reference point over ground."""

    def __init__(self, config: EstimatorConfig, texts: list[tuple[Severity, str]]) -> None:
        self.configure(config)
        self.origin: LocalFrame | None = None
        self.accepted_us: int | None = None
        """Time of validity of the last fix that was believed."""
        self.told: SeenFix | None = None
        """What the newest fix told that was believed, until its velocity is taken."""
        self.frozen = False
        self.drift_n_mps = 0.0
        self.drift_e_mps = 0.0
        self._texts = texts
        self._aligner = ClockAligner()
        self._watch = FrozenWatch()
        self._agreement = PlaceAgainstSpeed()
        self._speed = LateSpeed()
        self._cov = PairCovariance(0.0, 0.0, 0.0)
        self._north_m = self._east_m = self._vn = self._ve = 0.0
        self._psi_rad: float | None = None
        self._received_us = 0
        self._interval_s = 0.2
        self._usable = False
        self._outliers = 0
        self._refused_since_us: int | None = None
        self._jump = ComesAndGoes()
        self._refused_run_us = 0
        self._refused_at = self._refused_from = (0.0, 0.0)
        self._denied = False
        """That the new place is not accepted is told."""
        self.contradicted_by: Callable[[GpsFix], str] = lambda fix: ""
        """Name of another receiver that is against a fix; empty when none is."""
        self.leapt_m = (0.0, 0.0)
        """By how much what is believed has leapt in all, north and east: no vessel moved so."""
        self._frozen_out = False

    def configure(self, config: EstimatorConfig) -> None:
        """Take new settings; the state is kept."""
        self.config = config
        self._timeout_s, self._hold_s = config.position_timeout_s, config.position_hold_s
        self._jump_m, self._speed_max_mps = config.position_jump_m, config.speed_max_mps
        self._warn_s, self._invalid_s = config.frozen_warn_s, config.frozen_invalid_s
        self._velocity_variance = config.velocity_sigma_mps * config.velocity_sigma_mps

    def age_s(self, now_us: int) -> float | None:
        return None if self.accepted_us is None else (now_us - self.accepted_us) * 1e-6

    def valid(self, now_us: int) -> bool:
        """True while the last believed fix is young enough, the receiver has a fix, and nothing is frozen."""
        if self.accepted_us is None or not self._usable or self._frozen_out:
            return False
        age_s = (now_us - self.accepted_us) * 1e-6
        if self._refused_since_us is not None:
            return age_s <= self._hold_s
        if self._outliers:  # one that is a little off is not silent: it is followed before long
            age_s = (now_us - self._received_us) * 1e-6
        return self.is_young(age_s)

    @property
    def why_lost(self) -> str:
        """What a receiver is given up for, in words, where its position is not valid."""
        if not self._usable:
            return "has no fix"
        if self._frozen_out:
            return "repeats one position"
        return "silent" if self._refused_since_us is None else "jumped"

    @property
    def is_known_wrong(self) -> bool:
        """Whether the receiver itself is in the wrong: where another one is against it, that speaks for the other."""
        return self._usable and (self._frozen_out or self._refused_since_us is not None)

    @property
    def is_frozen_out(self) -> bool:
        """Whether the receiver has repeated one position for too long."""
        return self._frozen_out

    def expects(self, fix: GpsFix) -> bool:
        """Whether the vessel may be where a fix says, from where she was believed to be before the receiver was in the wrong."""
        if self.origin is None or fix.lat_rad is None or fix.lon_rad is None:
            return False
        north_m, east_m = near_local(self.origin, fix.lat_rad, fix.lon_rad, self._north_m, self._east_m)
        since_s = self._invalid_s if self._frozen_out else self._hold_s
        gate_m = self._jump_m + self._speed_max_mps * since_s
        return math.hypot(north_m - self._north_m, east_m - self._east_m) <= gate_m

    def is_young(self, age_s: float) -> bool:
        """Whether a fix of this age still tells what the receiver says now; a slow receiver gets three of its periods."""
        return age_s <= self._timeout_s or age_s <= min(3.0 * self._interval_s + 0.2, self.config.slow_receiver_s)

    def aligned_us(self, fix: GpsFix) -> int:
        """Time of validity of a fix by its UTC; call once per fix."""
        return self._aligner.align(fix.t_us, fix.utc_us)

    def update(
        self, fix: GpsFix, t_us: int, heading: Attitude, moving: bool, antenna: Arm, *, anew: float | None = None
    ) -> tuple[Pair, Pair] | None:
        """Take a fix that was valid at ``t_us``, with the attitude of that moment, of the antenna at the end of an arm.

        ``anew``: of another receiver than before, with its period in s, 0 while that is not known. Return the antenna's velocity, m/s,
        and where it is from the reference point, m; None when no velocity is told.
        """
        self._usable = self.is_acceptable(fix)
        if not self._usable:
            return None
        assert fix.lat_rad is not None
        assert fix.lon_rad is not None
        if self.origin is None:
            self.origin = LocalFrame(fix.lat_rad, fix.lon_rad)
        north_m, east_m = near_local(self.origin, fix.lat_rad, fix.lon_rad, self._north_m, self._east_m)
        velocity = antenna_mps = _velocity(fix)
        ahead_m = (0.0, 0.0)
        if antenna != NO_ARM and heading.psi_rad is not None:
            ahead_m = lever(antenna, heading, heading.psi_rad)
            north_m, east_m = north_m - ahead_m[0], east_m - ahead_m[1]
            if antenna_mps is not None:
                velocity = at_centre(antenna_mps, ahead_m, heading.r_radps)
        told = None if antenna_mps is None else (antenna_mps, ahead_m)
        self._judge_frozen(fix, (north_m, east_m), velocity, moving=moving, anew=anew is not None)
        since_us = t_us - self._received_us
        self._received_us = t_us
        if self.accepted_us is None or anew is not None:
            self._interval_s = anew or self._interval_s
            self._speed.begin()
            if self.accepted_us is not None and 0 <= t_us - self.accepted_us < _PREDICT_MAX_S * 1e6:
                self._advance(t_us, heading)
                self._leap((north_m, east_m), (self._north_m, self._east_m))
            self._start(fix, t_us, (north_m, east_m), velocity, heading)
            self._note(fix, t_us, (north_m, east_m), velocity)
            return told
        since_s = since_us * 1e-6
        if not 0.02 <= since_s <= 2.0:
            since_s = 0.02 if since_s < 0.02 else 2.0
        self._interval_s += 0.2 * (since_s - self._interval_s)
        self._advance(t_us, heading)
        if self._believable(fix, t_us, since_us, at=(north_m, east_m), velocity=velocity, heading=heading):
            self._correct(fix, t_us, (north_m, east_m), velocity)
            self._note(fix, t_us, (north_m, east_m), velocity)
        return told

    def _note(self, fix: GpsFix, t_us: int, at: Pair, velocity: Pair | None) -> None:
        leapt_n, leapt_e = self.leapt_m
        self.told = told = SeenFix(t_us, (at[0] - leapt_n, at[1] - leapt_e), POSITION_SIGMA_M[fix.fix_type], velocity)
        text = self._speed.step(t_us, at, velocity)
        if text:
            self._texts.append((Severity.WARNING, text))
        if self._speed.lag_s:
            self.told = told = replace(told, mps=None)
        text = self._agreement.step(told)
        if text:
            self._texts.append((Severity.WARNING if self._agreement.is_apart else Severity.INFO, text))

    def take_velocity(self) -> tuple[float, float] | tuple[None, None]:
        """Return, once, what the newest believed fix told of the ground velocity at the reference point, north and east, m/s."""
        told, self.told = self.told, None
        return (None, None) if told is None or told.mps is None else told.mps

    def is_acceptable(self, fix: GpsFix) -> bool:
        """Whether it is a kind of fix that is sailed on."""
        return (
            fix.has_position
            and (not fix.dead_reckoning or self.config.accept_dead_reckoning)
            and (not fix.simulated or self.config.accept_simulated)
        )

    def _judge_frozen(self, fix: GpsFix, at: Pair, velocity: Pair | None, *, moving: bool, anew: bool) -> None:
        leads_mps = None if self._speed.lag_s else velocity  # one that lags leads on where the boat has stopped
        same_s = self._watch.same_for_s(fix, at, leads_mps, moving=moving, told=self.frozen and not anew)
        frozen = same_s > self._warn_s
        if frozen != self.frozen:
            self.frozen = frozen
            text = self._watch.text if frozen else self._watch.back
            if frozen or not anew:  # of the one before nothing is known any more
                self._texts.append((Severity.WARNING if frozen else Severity.INFO, text))
        self._frozen_out = same_s > self._invalid_s

    def _start(
        self,
        fix: GpsFix,
        t_us: int,
        at: tuple[float, float],
        velocity: tuple[float, float] | None,
        heading: Attitude,
    ) -> None:
        sigma = POSITION_SIGMA_M[fix.fix_type]
        speed_sigma = self.config.velocity_sigma_mps if velocity else self.config.speed_max_mps
        self._cov = PairCovariance(self.config.acceleration_psd, sigma * sigma, speed_sigma * speed_sigma)
        self._north_m, self._east_m = at
        self._vn, self._ve = velocity or (0.0, 0.0)
        self._psi_rad = heading.psi_rad
        self.accepted_us = self._filter_us = t_us
        self._outliers = 0
        self._refused_since_us = None

    _filter_us: int = 0

    def predict(self, now_us: int, psi_rad: float | None, r_radps: float) -> Motion:
        """Position and velocity now: the velocity through the water turns with the hull, the drift does not."""
        dt_s = (now_us - self._filter_us) * 1e-6
        if not 0.0 <= dt_s <= _PREDICT_MAX_S:
            dt_s = 0.0 if dt_s < 0.0 else _PREDICT_MAX_S
        turned = r_radps * dt_s
        if psi_rad is not None and self._psi_rad is not None:
            turned = wrap_pi(psi_rad - self._psi_rad)
        drift_n, drift_e = self.drift_n_mps, self.drift_e_mps
        water_n, water_e = self._vn - drift_n, self._ve - drift_e
        # Along an arc the displacement is the mean velocity, half turned, times the chord's share.
        half = 0.5 * turned
        sine, cosine = math.sin(half), math.cos(half)
        chord = sine / half if half >= 1e-9 or half <= -1e-9 else 1.0
        mean_n, mean_e = water_n * cosine - water_e * sine, water_n * sine + water_e * cosine
        sine, cosine = math.sin(turned), math.cos(turned)
        return (
            self._north_m + dt_s * (chord * mean_n + drift_n),
            self._east_m + dt_s * (chord * mean_e + drift_e),
            water_n * cosine - water_e * sine + drift_n,
            water_n * sine + water_e * cosine + drift_e,
        )

    def forget_heading(self) -> None:
        """The heading that the velocity was told with was wrong: that it is another now is no turn."""
        self._psi_rad = None

    def _advance(self, t_us: int, heading: Attitude) -> None:
        dt_s = (t_us - self._filter_us) * 1e-6
        if dt_s <= 0.0:
            return
        self._north_m, self._east_m, self._vn, self._ve = self.predict(t_us, heading.psi_rad, heading.r_radps)
        self._cov.predict(dt_s)
        self._psi_rad = heading.psi_rad
        self._filter_us = t_us

    def _believable(
        self,
        fix: GpsFix,
        t_us: int,
        since_us: int,
        at: tuple[float, float],
        velocity: tuple[float, float] | None,
        heading: Attitude,
    ) -> bool:
        off_m = math.hypot(at[0] - self._north_m, at[1] - self._east_m)
        gate_m = self._jump_m + self._speed_max_mps * (since_us if since_us > 0 else 0) * 1e-6
        if off_m > gate_m:
            self._refuse(fix, t_us, at, off_m=off_m, gate_m=gate_m, velocity=velocity, heading=heading)
            return False
        if self._refused_since_us is not None:
            self._refused_since_us = None
            if self._jump.ends():
                self._texts.append((Severity.INFO, "Position is plausible again"))
        sigma = POSITION_SIGMA_M[fix.fix_type]
        limit_m = _OUTLIER_SIGMA * math.sqrt(self._cov.value_value + sigma * sigma)
        is_off = off_m > limit_m and (velocity is None or self._off_by_both_m(t_us, at, velocity) > limit_m)
        self._outliers = self._outliers + 1 if is_off else 0
        if self._outliers == 0:
            return True
        after_gap = since_us > max(self._timeout_s, 2.5 * self._interval_s) * 1e6
        assert self.accepted_us is not None
        stays = self._outliers >= _OUTLIERS_OF_SLOW and t_us - self.accepted_us > self._timeout_s * 1e6
        if self._outliers > _OUTLIERS_MAX or stays or after_gap:
            if not after_gap:
                self._leap(at, (self._north_m, self._east_m))
            self._start(fix, t_us, at, velocity, heading)
        return self._outliers == 0

    def _off_by_both_m(self, t_us: int, at: tuple[float, float], velocity: tuple[float, float]) -> float:
        """How far a fix lies from where the mean of the velocity before and its own leads.

        A receiver that tells once a second sees a boat stop from one fix to the next: the velocity before leads metres too far.
        """
        assert self.accepted_us is not None
        half_s = 0.5e-6 * (t_us - self.accepted_us)
        off_n = at[0] - self._north_m - half_s * (velocity[0] - self._vn)
        return math.hypot(off_n, at[1] - self._east_m - half_s * (velocity[1] - self._ve))

    def _refuse(
        self,
        fix: GpsFix,
        t_us: int,
        at: tuple[float, float],
        off_m: float,
        gate_m: float,
        velocity: tuple[float, float] | None,
        heading: Attitude,
    ) -> None:
        if self._refused_since_us is None:
            self._refused_since_us = self._refused_run_us = t_us
            self._refused_from = (self._north_m, self._east_m)
            self._denied = False
            if self._jump.begins(t_us):
                self._texts.append((Severity.WARNING, f"Position jumped by {off_m:.0f} m: holding"))
        elif math.hypot(at[0] - self._refused_at[0], at[1] - self._refused_at[1]) > gate_m:
            self._refused_run_us = t_us
        self._refused_at = at
        if t_us - self._refused_run_us < self.config.reaccept_s * 1e6:
            return
        against = self.contradicted_by(fix)
        if against:
            if not self._denied:
                self._texts.append(
                    (Severity.WARNING, f"Position {off_m:.0f} m away not accepted: {against} contradicts it")
                )
            self._denied = True
        else:
            self._leap(at, self._refused_from)
            self._start(fix, t_us, at, velocity, heading)
            text = f"Position {off_m:.0f} m away accepted after {self.config.reaccept_s:.0f} s"
            self._texts.append((Severity.WARNING, text))

    def _leap(self, at: Pair, before: Pair) -> None:
        self.leapt_m = (self.leapt_m[0] + at[0] - before[0], self.leapt_m[1] + at[1] - before[1])

    def _correct(self, fix: GpsFix, t_us: int, at: tuple[float, float], velocity: tuple[float, float] | None) -> None:
        sigma = POSITION_SIGMA_M[fix.fix_type]
        vn, ve = self._vn, self._ve
        off_n, off_e = at[0] - self._north_m, at[1] - self._east_m
        value_gain, rate_gain = self._cov.measure_value(sigma * sigma)
        north_m, east_m = self._north_m + value_gain * off_n, self._east_m + value_gain * off_e
        vn, ve = vn + rate_gain * off_n, ve + rate_gain * off_e
        if velocity is not None:
            seen_n, seen_e = self._speed.seen(t_us, (vn, ve), velocity)
            off_n, off_e = velocity[0] - seen_n, velocity[1] - seen_e
            variance = self._speed.variance(self._velocity_variance, self.config.acceleration_psd, self._interval_s)
            value_gain, rate_gain = self._cov.measure_rate(variance)
            north_m, east_m = north_m + value_gain * off_n, east_m + value_gain * off_e
            vn, ve = vn + rate_gain * off_n, ve + rate_gain * off_e
        self._north_m, self._east_m, self._vn, self._ve = north_m, east_m, vn, ve
        self.accepted_us = t_us


def _velocity(fix: GpsFix) -> tuple[float, float] | None:
    """Ground velocity of a fix, north and east; a receiver at rest often gives no course."""
    if fix.sog_mps is None:
        return None
    if fix.cog_rad is None:
        return (0.0, 0.0) if fix.sog_mps < 0.1 else None
    return fix.sog_mps * math.cos(fix.cog_rad), fix.sog_mps * math.sin(fix.cog_rad)
