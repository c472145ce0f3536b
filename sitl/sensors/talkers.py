"""The simulated GNSS compass and echo sounder: truth in, the bytes that real ones would send out.

Positions are sampled at the fix rate and sent after the latency; heading and rate are fresh when sent. Errors are white
noise plus slow first-order Gauss-Markov processes of the chosen class; faults can be set at any moment.
"""

from __future__ import annotations

import math
import random
from collections import deque
from typing import Final

from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.value import value

from ..plant import Truth
from ..plant.truth import utc_us
from . import nmea_writer as write
from .config import CLASSES, SensorFaults, SimulatedSensors

__all__ = ["SensorFaults", "SensorSuite", "SimulatedSensors"]

_WEEK_US: Final = 7 * 86_400 * 1_000_000
_TICK_US: Final = 50_000
_BACKLOG_MAX: Final = 10
_QUALITY_DEAD_RECKONING: Final = 6
_NONE: Final = range(0)
_HEADINGS: Final = ("HDT", "THS", "HDG", "HDM")


class GaussMarkov:
    """First-order Gauss-Markov process, stationary from the start: sigma, and correlation exp(-dt / tau)."""

    def __init__(self, sigma: float, tau_s: float, rng: random.Random) -> None:
        self._sigma = sigma
        self._tau_s = tau_s
        self._rng = rng
        self._last_us: int | None = None
        self._span_us = 0
        self._keep = self._spread = 0.0
        """Shares over ``_span_us``: nearly always the same."""
        self.value = sigma * rng.gauss(0.0, 1.0) if sigma > 0.0 else 0.0

    def at(self, now_us: int) -> float:
        """Advance to ``now_us`` and return the value."""
        if self._sigma > 0.0 and self._last_us is not None and now_us > self._last_us:
            if now_us - self._last_us != self._span_us:
                self._span_us = now_us - self._last_us
                self._keep = math.exp(-self._span_us * 1e-6 / self._tau_s)
                self._spread = self._sigma * math.sqrt(1.0 - self._keep * self._keep)
            self.value = self._keep * self.value + self._spread * self._rng.gauss(0.0, 1.0)
        self._last_us = now_us
        return self.value


class Due:
    """A steady rate: when the next sample is due."""

    def __init__(self, hz: float, offset_us: int = 0) -> None:
        self._period_us = 1e6 / hz if hz > 0.0 else 0.0
        self._count = 0
        self._offset_us = offset_us
        self._not_before_us = 0.0 if self._period_us else math.inf
        """Before this nothing can be due: a look at it is all that most steps cost."""
        self.came = False
        """What ``look`` found."""

    def look(self, now_us: int) -> None:
        """See whether a sample has come up to ``now_us``."""
        self.came = now_us >= self._not_before_us and bool(self.moments(now_us))

    def moments(self, now_us: int) -> range:
        """The numbers of the samples that have come up to ``now_us``, oldest first; after a long gap only the newest."""
        if now_us < self._not_before_us:
            return _NONE
        latest = math.floor((now_us - self._offset_us) / self._period_us)
        if latest < self._count:
            return _NONE
        first = self._count if latest - self._count < _BACKLOG_MAX else latest
        self._count = latest + 1
        self._not_before_us = self._count * self._period_us + self._offset_us - 1.0
        return range(first, latest + 1)

    def time_us(self, number: int) -> int:
        """When a sample is to be taken."""
        return round(number * self._period_us) + self._offset_us


@value
class _Sample:
    """A position as the receiver sees it."""

    t_us: int
    lat_rad: float
    lon_rad: float
    height_m: float
    vn_mps: float
    ve_mps: float


class SensorSuite:
    """One vessel's GNSS compass and sounder. ``step`` in time order; ``faults`` may be changed in between."""

    def __init__(self, config: SimulatedSensors, rng: random.Random, hull: HullGeometry = HullGeometry()) -> None:  # noqa: B008 - frozen
        """``hull``: where antenna and transducer of the first sensor link really are."""
        self.config = config
        self.faults = SensorFaults()
        self._rng = rng
        self._figures = CLASSES[config.grade]
        self._slow_n = GaussMarkov(self._figures.position_slow_m, config.position_tau_s, rng)
        self._slow_e = GaussMarkov(self._figures.position_slow_m, config.position_tau_s, rng)
        self._slow_psi = GaussMarkov(math.radians(self._figures.heading_slow_deg), config.heading_tau_s, rng)
        # Sampled so that the latency is exact in lock-step with the usual tick, instead of rounded up to the next one.
        self._fix_due = Due(config.fix_hz, -round(config.fix_latency_s * 1e6) % _TICK_US)
        dues = {hz: Due(hz) for hz in (config.heading_hz, config.rate_hz, config.depth_hz)}
        self._dues = tuple(dues.values())
        """Equal rates are one: what comes ten times a second comes together."""
        self._heading_due, self._rate_due = dues[config.heading_hz], dues[config.rate_hz]
        self._depth_due = dues[config.depth_hz]
        names = [name.strip() for name in config.sentences.split(",") if name.strip()]
        self._epoch = [(name[:-3] or config.talker, name[-3:]) for name in names]
        self._waiting: deque[_Sample] = deque()
        self._held: _Sample | None = None
        self._held_psi = self._held_rate = 0.0
        self._held_depth: float | None = None
        self._stuck_epoch: list[bytes] | None = None
        self._latency_us = round(config.fix_latency_s * 1e6)
        self._heading_sigma = math.radians(self._figures.heading_white_deg)
        self._cone_rad = math.radians(0.5 * config.sounder_cone_deg)
        # What every reading needs, taken out of the model once: it guards each look at a field.
        self._talker, self._heading_kind, self._attitude = (
            config.talker,
            config.heading_sentence,
            config.attitude_sentence,
        )
        forward_m, starboard_m, down_m = hull.antenna_of(0)
        self._antenna_m = (forward_m, starboard_m, -down_m)
        self._mount_deg = config.heading_mount_deg
        self._transducer_m, self._range_m = hull.transducer_of(0), config.sounder_range_m
        self._sounder = (
            config.sounder_sigma_m,
            config.sounder_sigma_share,
            config.sounder_dropout,
            config.sounder_outlier,
            config.sounder_blanking_m,
        )
        self._variation = None if config.variation_deg is None else math.radians(config.variation_deg)

    def step(self, now_us: int, truth: Truth) -> list[bytes]:
        """Return the sentences that leave the sensors now, in order, each with its line end (unless a fault cuts it)."""
        sent: list[bytes] = []
        for number in self._fix_due.moments(now_us):
            self._waiting.append(self._sample(self._fix_due.time_us(number), truth))
        for due in self._dues:
            due.look(now_us)
        if self._rate_due.came and not self.faults.rate_silent:
            sent.append(write.rot(self._talker, self._rate(truth)))
        if self._heading_due.came:
            self._send_headings(sent, now_us, truth)
        while self._waiting and now_us - self._waiting[0].t_us >= self._latency_us:
            sent += self._send_epoch(self._waiting.popleft(), now_us, truth)
        if self._depth_due.came and not self.faults.depth_silent:
            sent.append(self._depth(truth))
        return self._spoil(sent) if sent else sent

    def _gauss(self, sigma: float) -> float:
        return self._rng.gauss(0.0, sigma) if sigma > 0.0 else 0.0

    def _sample(self, t_us: int, truth: Truth) -> _Sample:
        """Position and velocity of the antenna at ``t_us``, at most one step before the truth's time."""
        figures, faults = self._figures, self.faults
        back_s = (t_us - truth.t_us) * 1e-6
        arm_n, arm_e, arm_up = self._arm(truth)
        north = arm_n + truth.vn_mps * back_s + self._slow_n.at(t_us) + self._gauss(figures.position_white_m)
        east = arm_e + truth.ve_mps * back_s + self._slow_e.at(t_us) + self._gauss(figures.position_white_m)
        lat_rad, lon_rad = _shift(truth.lat_rad, truth.lon_rad, north + faults.jump_north_m, east + faults.jump_east_m)
        sample = _Sample(
            t_us=t_us,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            height_m=truth.heave_m + arm_up + 1.5 * self._gauss(figures.position_white_m),
            vn_mps=truth.vn_mps - truth.r_radps * arm_e + self._gauss(figures.velocity_white_mps),
            ve_mps=truth.ve_mps + truth.r_radps * arm_n + self._gauss(figures.velocity_white_mps),
        )
        if faults.frozen and self._held is not None:
            held = self._held
            return _Sample(
                t_us=t_us,
                lat_rad=held.lat_rad,
                lon_rad=held.lon_rad,
                height_m=held.height_m,
                vn_mps=held.vn_mps,
                ve_mps=held.ve_mps,
            )
        self._held = sample
        return sample

    def _arm(self, truth: Truth) -> tuple[float, float, float]:
        x, y, up = self._antenna_m
        if not (x or y or up):
            return 0.0, 0.0, 0.0
        sin_phi, cos_phi = math.sin(truth.roll_rad), math.cos(truth.roll_rad)
        sin_theta, cos_theta = math.sin(truth.pitch_rad), math.cos(truth.pitch_rad)
        sine, cosine = math.sin(truth.psi_rad), math.cos(truth.psi_rad)
        level_x = x * cos_theta + (y * sin_phi - up * cos_phi) * sin_theta
        level_y = y * cos_phi + up * sin_phi
        height = x * sin_theta - (y * sin_phi - up * cos_phi) * cos_theta
        return level_x * cosine - level_y * sine, level_x * sine + level_y * cosine, height

    def _rate(self, truth: Truth) -> float:
        if not self.faults.rate_frozen:
            self._held_rate = truth.r_radps + self._gauss(self._figures.rate_white_radps)
        return self._held_rate

    def _heading(self, now_us: int, truth: Truth) -> float:
        if not self.faults.heading_frozen:
            self._held_psi = self._measured_heading(now_us, truth)
        return self._held_psi

    def _measured_heading(self, now_us: int, truth: Truth) -> float:
        bias = math.radians(self.faults.heading_bias_deg - self._mount_deg)
        white = self._gauss(self._heading_sigma)
        return truth.psi_rad + bias + self._slow_psi.at(now_us) + white

    def _send_headings(self, sent: list[bytes], now_us: int, truth: Truth) -> None:
        if self.faults.heading_silent:
            return
        psi_rad = self._heading(now_us, truth)
        sent.append(write.heading(self._talker, self._heading_kind, psi_rad, self._variation))
        if self._attitude:
            hhmmss = write.time_fields(utc_us(now_us))[0]
            white = math.radians(0.2) if self.config.grade != "ideal" else 0.0
            roll, pitch = truth.roll_rad + self._gauss(white), truth.pitch_rad + self._gauss(white)
            sent.append(write.attitude(self._attitude, hhmmss, psi_rad, roll, pitch))

    def _send_epoch(self, sample: _Sample, now_us: int, truth: Truth) -> list[bytes]:
        faults = self.faults
        if faults.gnss_silent:
            return []
        if faults.stuck and self._stuck_epoch is not None:
            return self._stuck_epoch
        time = write.time_fields(utc_us(sample.t_us) - faults.weeks_off * _WEEK_US)
        if faults.utc_blank:
            time = ("", "", "", "", "")
        fix = write.NO_FIX if faults.no_fix else _fix_text(sample)
        sent: list[bytes] = []
        for talker, kind in self._epoch:
            if kind not in _HEADINGS:
                sent.append(self._fix_sentence(talker, kind, fix, sample.height_m, time))
            elif not faults.heading_silent:
                sent.append(write.heading(talker, kind, self._heading(now_us, truth), self._variation))
        self._stuck_epoch = sent
        return sent

    def _fix_sentence(
        self, talker: str, kind: str, fix: write.FixSentences, height_m: float, time: tuple[str, str, str, str, str]
    ) -> bytes:
        figures = self._figures
        quality, mode = figures.quality, figures.mode
        if self.faults.dead_reckoning:
            quality, mode = _QUALITY_DEAD_RECKONING, "E"
        if kind == "ZDA":
            return write.zda(talker, time)
        if kind == "GGA":
            satellites, hdop, geoid_m = figures.satellites, figures.hdop, self.config.geoid_m
            return write.gga(
                talker,
                time[0],
                fix,
                quality=quality,
                satellites=satellites,
                hdop=hdop,
                height_msl_m=height_m,
                geoid_m=geoid_m,
            )
        if kind == "RMC":
            return write.rmc(talker, time, fix, self._variation, mode)
        if kind == "VTG":
            return write.vtg(talker, fix, mode)
        if kind == "GST":
            sigma = math.hypot(figures.position_white_m, figures.position_slow_m) * math.sqrt(2.0)
            return write.gst(talker, time[0], sigma, 1.5 * sigma)
        raise ValueError(f"the simulated receiver sends no {talker}{kind}")

    def _depth(self, truth: Truth) -> bytes:
        if not self.faults.depth_frozen:
            self._held_depth = self._range_m if self.faults.depth_says_range else self._echo(truth)
        return write.depth("SD", self.config.depth_sentence, self._held_depth, self._transducer_m, self._range_m)

    def _echo(self, truth: Truth) -> float | None:
        """Distance from the transducer to the bottom straight below, as long as that lies inside the cone.

        Up a slope a real beam hears what is shallower at its edge: 4 % of the water on 1:3. The guard is tried with the later warning.
        """
        if truth.depth_m is None or self.faults.depth_no_bottom:
            return None
        sigma_m, sigma_share, dropout, outlier, blanking_m = self._sounder
        distance_m = truth.depth_m - self._transducer_m + truth.heave_m
        if truth.roll_rad or truth.pitch_rad:
            upright = math.cos(truth.roll_rad) * math.cos(truth.pitch_rad)
            if math.acos(min(1.0, upright)) > self._cone_rad:
                distance_m /= max(upright, 0.2)
        if self._figures.depth_white:
            distance_m += self._gauss(max(sigma_m, sigma_share * abs(distance_m)))
            if self._rng.random() < dropout:
                return None
            if self._rng.random() < outlier:
                distance_m *= self._rng.choice((0.3, 0.5, 2.0))
        distance_m += self.faults.depth_bias_m
        if distance_m < self.faults.depth_echoes_below_m:
            distance_m = 2.0 * distance_m + self._transducer_m
        return distance_m if blanking_m <= distance_m <= self._range_m else None

    def _spoil(self, sent: list[bytes]) -> list[bytes]:
        faults, rng = self.faults, self._rng
        if faults.loss_share > 0.0:
            sent = [line for line in sent if rng.random() >= faults.loss_share]
        if faults.cut_share > 0.0:
            sent = [line[: rng.randrange(1, len(line))] if rng.random() < faults.cut_share else line for line in sent]
        if faults.flip_share > 0.0:
            sent = [_flip(line, rng) if rng.random() < faults.flip_share else line for line in sent]
        if faults.no_line_end:
            sent = [line.rstrip(b"\r\n") for line in sent]
        return sent * faults.flood if faults.flood != 1 else sent


def _fix_text(sample: _Sample) -> write.FixSentences:
    sog_mps = math.hypot(sample.vn_mps, sample.ve_mps)
    at_rest = sog_mps < 0.02  # receivers blank the course then
    cog_rad = None if at_rest else math.atan2(sample.ve_mps, sample.vn_mps)
    return write.fix_text(sample.lat_rad, sample.lon_rad, sog_mps, cog_rad)


def _flip(line: bytes, rng: random.Random) -> bytes:
    spoiled = bytearray(line)
    spoiled[rng.randrange(len(spoiled))] ^= 1 << rng.randrange(8)
    return bytes(spoiled)


def _shift(lat_rad: float, lon_rad: float, north_m: float, east_m: float) -> tuple[float, float]:
    """A point some metres away, by the radii of curvature of WGS-84: exact to 1e-6 of the distance within 1 km."""
    per_lat, per_lon = metres_per_radian(lat_rad)
    return lat_rad + north_m / per_lat, lon_rad + east_m / per_lon
