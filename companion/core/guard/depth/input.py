"""From echo-sounder readings to the altitude of the keel above the bottom: offsets, validity, jump gate, median, age.

The chain of vessel-control §5.3. Raw, gated and filtered values are all kept, so that a stop can be explained afterwards.
An altitude is under the keel: distance + transducer depth - keel depth, both of the hull file, positive down.
"""

from __future__ import annotations

import math
from operator import sub
from typing import Final

from pydantic import Field

from mavlink_bridge.language.messages import Distance, EstimatedState
from mavlink_bridge.language.value import value

from ...config import Config, param
from ...hull.geometry import HullGeometry
from .deep_jump import DeepJump
from .known import KnownBottom, Unknown, is_much_deeper
from .repeated import RepeatedDepth

_FAST_SPAN_US: Final = 1_000_000
"""A median may span a second and no more, whatever the sounder's rate: at 3 m/s that is a boat's length or two."""
_CONSISTENT: Final = 3
"""Two readings that agree may be one fish; three are the bottom."""
_FORGET_US: Final = 5_000_000
"""What was held back for want of agreement says nothing of the water this much later."""
_GAPS: Final = 4
"""Gaps between readings of which the middle is the sounder's period."""
_MEDIAN_MAX: Final = 9
"""Half of it is the delay: four readings, 0.4 s at 10 Hz."""
_FAR_SHARE: Final = 0.8
"""A reading from here to the end of the range may be the range itself, not the bottom."""
_END_SHARE: Final = 0.99
"""From here on it is the range itself: some sounders say it, or its nearest digit, when they hear no bottom."""
_SURE_US: Final = 5_000_000
"""So long must the bottom be heard nearer than the end of the range before it counts as found."""
_BACK_US: Final = 60_000_000
"""A depth that is read again so soon after a jump away from it is the bottom, and the jump was the echo of something above it."""
_BACK_SHARE: Final = 0.25
"""By so much of itself it may have changed meanwhile."""
_BREAK_US: Final = 2_500_000
"""A silence that starts this anew; a sounder of 1 Hz may miss one reading."""


class DepthInputConfig(Config):
    """Which readings to believe."""

    use_sentence_offset: bool = False
    """Take DPT's own offset instead of the hull file's `transducer_depth_m`; never both."""
    beam_half_angle_deg: float = Field(7.5, ge=0, le=45)
    """Half the sounder's cone; a tilt inside it costs nothing, since the shallowest return is reported."""
    range_min_m: float = param(0.3, "SNDR_MIN", "Nearest credible distance (blanking)", unit="m", ge=0, le=10)
    range_max_m: float = param(100.0, "SNDR_MAX", "Farthest credible distance", unit="m", ge=1, le=12000)
    quality_min: float = Field(0.05, ge=0, le=1)
    """Least signal quality, for sounders that report one."""
    jump_rate_mps: float = Field(2.0, gt=0, le=50)
    """Change of depth that is credible between samples beside the vessel's own motion, m/s."""
    jump_slope: float = Field(0.5, ge=0, le=5)
    """Steepest bottom that is credible (rise over run)."""
    sigma_m: float = Field(0.05, ge=0, le=5)
    """Noise of one reading, 1 sigma; 0.5 % of the distance when that is more."""
    median_samples: int = Field(5, ge=1, le=_MEDIAN_MAX)
    """Readings in the median for a fast sounder; one that gives fewer than this per second uses three. 1 = no filter."""
    stale_s: float = param(
        0.8,
        "SNDR_STALE",
        "Depth older than this is unknown (a slow sounder gets 2.5 of its periods)",
        unit="s",
        ge=0.1,
        le=30,
    )


@value
class Altitude:
    """One accepted reading, as altitude of the keel."""

    t_us: int
    value_m: float


def reading_sigma_m(least_m: float, value_m: float) -> float:
    """Noise of one reading (1 sigma), m: half a percent of it, ``least_m`` at least."""
    share_m = 0.005 * abs(value_m)
    return share_m if share_m > least_m else least_m


class DepthInput:
    """The chain. ``measure`` each reading, ``altitude_m(now)`` for the filtered value."""

    def __init__(self, config: DepthInputConfig, geometry: HullGeometry) -> None:
        self._geometry, self._keel_m = geometry, geometry.keel_m
        self.raw_m: float | None = None
        """The last reading as an altitude, believed or not."""
        self.gated: Altitude | None = None
        """The last reading that passed the gate."""
        self.rejected = 0
        """Readings refused for range, quality or a jump."""
        self._times_us: list[int] = []
        self._values_m: list[float] = []
        """The newest readings that passed, as many as the longest median takes."""
        self._held: list[Altitude] = []
        self._filtered_m: float | None = None
        self._middle_us = 0
        self._stale_us = 0
        self._reach = _Reach()
        self._scale = _Scale()
        self._near_m: float | None = None
        """Distance of the last believed reading, m."""
        self._left: tuple[int, float] | None = None
        """When a jump left a bottom that had been believed, and its distance, m."""
        self._repeated, self._jump = RepeatedDepth(), DeepJump()
        self.bottom: KnownBottom = Unknown()
        """What else is known of the bottom. Whoever knows it sets it."""
        self.trouble = ""
        """Why readings are not believed, or should be looked at, in words; empty when there is nothing to say."""
        self._distrusts = self._is_ranging = False
        """What is repeated is not believed; the last reading was the sounder's range."""
        self.configure(config)

    def configure(self, config: DepthInputConfig) -> None:
        """Take new settings; what has been measured stays."""
        self._config = config
        self._cone = math.cos(math.radians(config.beam_half_angle_deg))
        self._range_min_m, self._range_max_m = config.range_min_m, config.range_max_m
        self._sigma_m = config.sigma_m
        self._jump_rate_mps, self._jump_slope = config.jump_rate_mps, config.jump_slope
        self._median_samples = config.median_samples
        self._limit_us = round(config.stale_s * 1e6)

    def measure(self, distance: Distance, state: EstimatedState | None, source: int | None = 0) -> tuple[Altitude, ...]:
        """Judge one reading of the sensor link ``source`` (None: it came over MAVLink).

        Returns the altitudes that it adds (several when a held jump is confirmed, else one or none).
        """
        limit_m, stated_m = self._range_max_m, distance.range_max_m
        if stated_m is not None and 0.0 < stated_m < limit_m:
            limit_m = stated_m
        reading = self._convert(distance, state, limit_m, self._geometry.transducer_of(source))
        if reading is None:
            self.rejected += 1
            return ()
        self.raw_m = reading.value_m
        if self.gated is not None and reading.t_us <= self.gated.t_us:
            return ()
        assert distance.value_m is not None
        if self._is_disbelieved(reading, distance.value_m, limit_m, state):
            self.rejected += 1
            return ()
        is_alone = not self._held
        passed = self._gate(self.gated, reading, 0.0 if state is None else state.sog_mps or 0.0)
        if passed and self._doubts(passed, distance.value_m, state, is_alone=is_alone):
            self.rejected += 1
            return ()
        if passed:
            self._take(passed, distance.value_m)
            reach_m = self._range_max_m if self._scale.changes(stated_m) else limit_m
            self._reach.note(distance.t_us, distance.value_m > _FAR_SHARE * reach_m)
        return passed

    def altitude_m(self, now_us: int) -> float | None:
        """The filtered altitude, m; None when too few readings are fresh."""
        if self.gated is None or self._distrusts or now_us - self.gated.t_us > self._stale_us:
            return None
        return self._filtered_m

    def age_s(self, now_us: int) -> float:
        """Time since the last believed reading, s; infinite when there is none."""
        return math.inf if self.gated is None else (now_us - self.gated.t_us) / 1e6

    def lag_s(self, now_us: int) -> float:
        """How old the filtered value is: the middle of the readings that it is the median of, s."""
        return (now_us - self._middle_us) / 1e6

    @property
    def repeats(self) -> bool:
        """Whether the last reading was the one before, which is normal for a while."""
        return self._repeated.repeats

    @property
    def is_stuck(self) -> bool:
        """Whether it has been for longer than a sounder that hears can."""
        return self._repeated.is_stuck

    @property
    def is_disputed(self) -> bool:
        """Whether there are readings, and they are not believed."""
        return self._distrusts or self._is_ranging or self._jump.is_doubted

    @property
    def out_of_reach(self) -> bool:
        """True when the bottom was near the end of the range: losing it there is normal.

        A few echoes from above it (fish, a second echo) do not count as having found it again, nor far ones as deep water.
        """
        return self._reach.far

    def _is_disbelieved(
        self, reading: Altitude, distance_m: float, limit_m: float, state: EstimatedState | None
    ) -> bool:
        """Whether a reading cannot be of the bottom, before it is compared with the one before it."""
        near_m = self._near_m
        was_ranging, at_end = self._is_ranging, distance_m >= _END_SHARE * limit_m
        self._is_ranging = near_m is not None and at_end and near_m <= _FAR_SHARE * limit_m
        if self._is_ranging:
            if not was_ranging:
                self.trouble = f"Sounder says its range, {distance_m:.0f} m, after {near_m:.1f} m: no bottom heard"
            return True
        slope, speed_mps = self.bottom.slope(reading.t_us), 0.0 if state is None else state.sog_mps or 0.0
        self._repeated.hear(reading.t_us, None if at_end else distance_m, speed_mps, slope)
        if self._judge_repeated(reading, distance_m, state):
            return True
        jump = self._jump
        if not jump.is_doubted:
            return False
        if jump.refuses(reading.t_us, distance_m, state):
            return True
        if jump.is_proven:
            self.gated = None
        return False

    def _judge_repeated(self, reading: Altitude, distance_m: float, state: EstimatedState | None) -> bool:
        """Whether a reading repeats what the bottom contradicts; one that only should be looked at is told of."""
        repeated = self._repeated
        if not repeated.is_stuck:
            self._distrusts = False
            return False
        if not self._distrusts:
            here_m = self._known_m(reading, distance_m, state)
            is_lying = repeated.was_closing and repeated.is_noise_gone
            self._distrusts = is_lying or (here_m is not None and is_much_deeper(distance_m, here_m))
            ends = "not believed until it changes" if self._distrusts else "look at it"
            self.trouble = f"Sounder repeats {distance_m:.2f} m while the boat moves: {ends}"
        return self._distrusts

    def _known_m(self, reading: Altitude, distance_m: float, state: EstimatedState | None) -> float | None:
        """What chart or memory say is below the transducer here, m."""
        known_m = self.bottom.known_altitude_m(state)
        return None if known_m is None else known_m + distance_m - reading.value_m

    def _doubts(
        self, passed: tuple[Altitude, ...], distance_m: float, state: EstimatedState | None, *, is_alone: bool
    ) -> bool:
        """Whether what agrees with others like it, or comes after a silence, is so much deeper that it may be no bottom."""
        near_m, gated, reading = self._near_m, self.gated, passed[-1]
        if gated is None or near_m is None or not is_much_deeper(distance_m, near_m):
            return False
        if is_alone and reading.t_us - gated.t_us <= self._stale_us:
            return False
        if self._is_back(reading.t_us, distance_m):
            return False
        slope = self.bottom.slope(reading.t_us) or self._jump.slope_before(reading.t_us)
        here_m = self._known_m(reading, distance_m, state)
        # A chart that was far off before the jump vouches for nothing.
        is_apart = here_m is None or is_much_deeper(here_m, near_m) or is_much_deeper(near_m, here_m)
        is_known = here_m is not None and not is_apart and is_much_deeper(distance_m, here_m)
        if slope <= 0.0 and not is_known:
            return False
        self._jump.begin(gated.t_us, near_m, distance_m, slope)
        self._jump.refuses(reading.t_us, distance_m, state)
        why = f"{near_m:.1f} m that closed" if slope > 0.0 else f"{near_m:.1f} m that is known here"
        self.trouble = f"Sounder jumped to {distance_m:.1f} m from {why}: doubted, second echo?"
        return True

    def _is_back(self, t_us: int, distance_m: float) -> bool:
        """Whether a bottom is read again that a jump has left lately."""
        if self._left is None:
            return False
        left_us, left_m = self._left
        return t_us - left_us <= _BACK_US and abs(distance_m - left_m) <= _BACK_SHARE * left_m

    def _take(self, passed: tuple[Altitude, ...], distance_m: float) -> None:
        """Believe readings."""
        if len(passed) > 1 and self._near_m is not None:
            self._left = passed[-1].t_us, self._near_m
        for item in passed:
            self._times_us.append(item.t_us)
            self._values_m.append(item.value_m)
        del self._times_us[:-_MEDIAN_MAX], self._values_m[:-_MEDIAN_MAX]
        self.gated, self._near_m = passed[-1], distance_m
        self._filter()
        self._jump.end()
        if not self._repeated.is_stuck:
            self.trouble = ""

    def _convert(
        self, distance: Distance, state: EstimatedState | None, range_max_m: float, transducer_m: float
    ) -> Altitude | None:
        value_m, quality = distance.bottom_m, distance.signal_quality
        if value_m is None or not self._range_min_m <= value_m <= range_max_m:
            return None
        if quality is not None and not quality >= self._config.quality_min:
            return None
        if state is not None and (state.phi_rad or state.theta_rad):
            value_m *= self._tilt(state.phi_rad or 0.0, state.theta_rad or 0.0)
        offset_m = distance.offset_m
        if offset_m is not None and self._config.use_sentence_offset:
            # A positive offset reaches up to the waterline, a negative one down to the keel.
            return Altitude(distance.t_us, value_m + offset_m - (self._keel_m if offset_m >= 0.0 else 0.0))
        return Altitude(distance.t_us, value_m + transducer_m - self._keel_m)

    def _tilt(self, phi_rad: float, theta_rad: float) -> float:
        cosine = math.cos(phi_rad) * math.cos(theta_rad)
        return 1.0 if cosine >= self._cone else max(cosine, 0.0)

    def _gate(self, gated: Altitude | None, reading: Altitude, speed_mps: float) -> tuple[Altitude, ...]:
        """Pass a credible reading; hold a jump until three readings agree on it, then pass all three."""
        if gated is None or reading.t_us - gated.t_us > _FORGET_US:
            self._held = []
            self._times_us.clear()
            self._values_m.clear()
            return (reading,)
        held = self._held
        if self._credible(gated, reading, speed_mps):
            held.clear()
            return (reading,)
        if held and not self._credible(held[-1], reading, speed_mps):
            held.clear()
        held.append(reading)
        if len(held) < _CONSISTENT:
            self.rejected += 1
            return ()
        self._held = []
        return tuple(held)

    def _credible(self, before: Altitude, after: Altitude, speed_mps: float) -> bool:
        dt_s = (after.t_us - before.t_us) / 1e6
        noise_m = 6.0 * reading_sigma_m(self._sigma_m, before.value_m)
        reach_m = (self._jump_rate_mps + self._jump_slope * abs(speed_mps)) * dt_s
        return abs(after.value_m - before.value_m) <= reach_m + noise_m

    def _filter(self) -> None:
        """Take the median of the newest readings, when there are enough of them."""
        times_us, count = self._times_us, self._samples_in_median()
        needed, used = (count + 1) // 2, len(times_us)
        if used > count:
            used = count
        self._stale_us = self._patience_us(used)
        self._middle_us = times_us[-needed] if needed < used else times_us[-used]
        # The median; of an even number the lower of the middle two, which is the shallower.
        self._filtered_m = sorted(self._values_m[-used:])[(used - 1) // 2] if used >= needed else None

    def _patience_us(self, used: int) -> int:
        """How old a reading may grow: the configured time, or for a slow sounder two and a half of its periods."""
        times_us = self._times_us
        if used < 2 or 5 * (times_us[-1] - times_us[-2]) <= 2 * self._limit_us:
            return self._limit_us
        newest = times_us[-min(used, _GAPS) :]
        period_us: int = min(map(sub, newest[1:], newest))
        return max(self._limit_us, min(period_us * 5 // 2, _FORGET_US))

    def _samples_in_median(self) -> int:
        """Five for a sounder of 5 Hz or more; three, that is two of three agreeing, for a slow one."""
        full, times_us = self._median_samples, self._times_us
        if full <= _CONSISTENT:
            return full
        held = len(times_us)
        if held > full:
            held = full
        share_us = _FAST_SPAN_US * (held - 1 or 1) // (full - 1)
        return full if times_us[-1] - times_us[-held] <= share_us else _CONSISTENT


class _Scale:
    """Whether a sounder changes its scale by itself: the one in use is then no end of its reach."""

    def __init__(self) -> None:
        self._stated_m: float | None = None
        self._changes = False

    def changes(self, stated_m: float | None) -> bool:
        if stated_m is not None and stated_m != self._stated_m:
            self._changes = self._stated_m is not None
            self._stated_m = stated_m
        return self._changes


class _Reach:
    """Whether the bottom is at the far end of the range. Changes when the readings have said so for some time."""

    def __init__(self) -> None:
        self.far = False
        self._heard_us: int | None = None
        self._since_us: int | None = None

    def note(self, t_us: int, far: bool) -> None:
        if self._heard_us is None:
            self.far = far
        gap = self._heard_us is not None and t_us - self._heard_us > _BREAK_US
        self._heard_us = t_us
        if far == self.far:
            self._since_us = None
        elif self._since_us is None or gap:
            self._since_us = t_us
        elif t_us - self._since_us >= _SURE_US:
            self.far, self._since_us = far, None
