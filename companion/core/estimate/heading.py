"""Heading and turn rate: compass and rate sentences filtered, gated against jumps, predicted to the tick."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import AngularVelocity, EulerAngles, Severity
from mavlink_bridge.language.units import clamp, wrap_pi

from .config import EstimatorConfig
from .filter import PairCovariance, Unseen
from .own_way import OwnWay
from .told import ComesAndGoes
from .variation import Variation

_PREDICT_MAX_S: Final = 1.0
"""A turn rate says nothing of the heading after longer."""
_COURSE_AGE_MAX_US: Final = 1_500_000
"""A course stands in for the compass this long: a fix at 1 Hz, and one that was lost."""
_RATE_AGE_MAX_US: Final = 500_000
"""A turn rate of its own sensor is used this long: half a second is two of the slowest that are sold."""
_FORGOTTEN_US: Final = 3_000_000
"""Longer than the slowest compass is waited for: by then nothing is left of the heading and the turn that it told of."""
_RATE_ANEW_VARIANCE: Final = 0.25
"""Of a turn rate that nothing is known of, (rad/s)^2: small hulls turn half a radian a second."""
_ASKED_VARIANCE: Final = math.radians(3.0) * math.radians(3.0)
"""Of a turn rate that was only asked for, (rad/s)^2: what a hull file and a gust make of it."""
_BRIDGE_S: Final = 0.6
"""A gap of a few headings is bridged by the turn rate, so that the boat does not flinch at each."""
_STEP_RATE_MAX_S: Final = 0.3
"""A silence widens the window for jumps by what the boat may turn meanwhile, but by no more than in this,"""
_SLOW_DPS: Final = 20.0
"""and by so much for each second more that a slow compass takes by itself: a boat that holds a course turns no faster for long."""
_RATE_NEWS_US: Final = 1_200_000
"""A turn rate of its own sensor is news of the heading for so long: one that is heard each second."""
_VAGUE_RAD: Final = math.radians(75.0)
"""A heading that comes back is expected no better than this after some silences: then the course is asked as well."""
_UNOPPOSED_US: Final = 60_000_000
"""A heading that the course has contradicted is accepted without a course only after so long: at rest nothing can contradict it,
and a sound compass must not be locked out for ever."""
_TRIED_AGAIN: Final = "Heading is tried again after 10 s of straight way by hand that bears it out, or 60 s at rest"


class HeadingTrack:
    """True heading and turn rate at any moment shortly after the last measurement."""

    def __init__(self, config: EstimatorConfig, texts: list[tuple[Severity, str]], way: OwnWay) -> None:
        self.variation = Variation(config, texts)
        self.configure(config)
        self.psi_rad = 0.0
        self.r_radps = 0.0
        self.t_us: int | None = None
        """Time of the filter's state; None before the first heading."""
        self.accepted_us: int | None = None
        """Time of the last heading that was believed."""
        self.course_us: int | None = None
        """Time of the last course that stood in; None while the compass is believed."""
        self._lead_s = 0.0
        self._texts, self._way = texts, way
        self._cov = PairCovariance(0.0, 0.0, 0.0)
        self._received_us = 0
        self._interval_s = 0.1
        self._rate_us = self._leant_us = -_RATE_AGE_MAX_US
        self._refused_since_us: int | None = None
        self._refused_run_us = 0
        """Since when the refused headings have gone together, and nothing has contradicted them."""
        self._borne_us: int | None = None
        """Since when a course that stands in has borne them out."""
        self._refused_rad = 0.0
        self._contradicted = False
        """Whether the course has contradicted the headings that are refused."""
        self.proven_wrong = False
        """Whether thrust has: then it takes a way by thrust, or the time at rest, to believe them again."""
        self._refused_is_back = False
        """What is refused came after a silence; what is not leapt under the vessel's eyes, and no silence widens its window."""
        self._unseen = Unseen()
        self._lost_said = False
        self._jump = ComesAndGoes()

    def configure(self, config: EstimatorConfig) -> None:
        """Take new settings; the state is kept."""
        self.config = config
        self.variation.configure(config)
        self._timeout_s = config.heading_timeout_s
        self._timeout_us = config.heading_timeout_s * 1e6
        self._late_s, self._late_us = config.heading_late_s, round(config.heading_late_s * 1e6)
        self._hold_s = config.heading_hold_s
        self._offset_rad = math.radians(config.heading_offset_deg)
        sigma_rad, rate_sigma_rad = math.radians(config.heading_sigma_deg), math.radians(config.rate_sigma_dps)
        self._variance = sigma_rad * sigma_rad
        self._rate_variance = rate_sigma_rad * rate_sigma_rad
        self._jump_rad = math.radians(config.heading_jump_deg)
        self._jump_deg, self._rate_max_dps = config.heading_jump_deg, config.heading_rate_max_dps
        self._rate_max_radps = math.radians(config.heading_rate_max_dps)

    def age_s(self, now_us: int) -> float | None:
        return None if self.accepted_us is None else (now_us - self.accepted_us) * 1e-6

    def valid(self, now_us: int) -> bool:
        """True while a believed heading, or one held against a jump, is young enough."""
        if self.accepted_us is None:
            return False
        age_s = (now_us - self.accepted_us) * 1e-6
        if self._refused_since_us is not None:
            return age_s <= self._hold_s
        # The shortest patience mostly settles it.
        return age_s <= self._timeout_s or age_s - self._late_s <= self._patience_s()

    def bridged(self, now_us: int) -> bool:
        """True with a course young enough to stand in, and from the loss of the compass to the first such course."""
        if self.course_us is not None:
            return now_us - self.course_us <= _COURSE_AGE_MAX_US
        if self.accepted_us is None:
            return False
        limit_s = self._patience_s() + self._late_s if self._refused_since_us is None else self._hold_s
        return (now_us - self.accepted_us) * 1e-6 <= limit_s + _BRIDGE_S

    def _patience_s(self) -> float:
        """How long a compass may be silent: one slower than 4 Hz gets two of its periods."""
        slow_s = min(2.0 * self._interval_s + 0.1, self.config.slow_compass_s)
        return max(self._timeout_s, slow_s)

    def at(self, now_us: int) -> float:
        """Heading at a moment near the filter's time, [-pi, pi)."""
        assert self.t_us is not None
        span_s = (now_us - self.t_us) * 1e-6
        if span_s > _PREDICT_MAX_S:
            span_s = _PREDICT_MAX_S
        newest_us = self._rate_us if self._rate_us > self._leant_us else self._leant_us
        if self.course_us is not None and now_us - newest_us - self._late_us > _RATE_AGE_MAX_US:
            span_s += self._lead_s
        return wrap_pi(self.psi_rad + self.r_radps * span_s)

    def waited_s(self, now_us: int) -> float | None:
        """For how long there has been no news of the heading: 0 while a sensor of its own tells the turn rate, None while it is lost."""
        if not self.valid(now_us):
            return None
        return 0.0 if now_us - self._rate_us - self._late_us <= _RATE_NEWS_US else (now_us - self._received_us) * 1e-6

    def has_rate(self, now_us: int) -> bool:
        """Whether a sensor of its own tells the turn rate."""
        return now_us - self._rate_us - self._late_us <= _RATE_AGE_MAX_US

    def true_heading(self, angles: EulerAngles) -> float | None:
        """The heading of one message in the vessel's frame; None when a magnetic one comes without any variation."""
        if angles.psi_rad is not None:
            return wrap_pi(angles.psi_rad + self._offset_rad)
        if angles.psi_magnetic_rad is None:
            return None
        variation = self.variation.of(angles)
        return None if variation is None else wrap_pi(angles.psi_magnetic_rad + variation + self._offset_rad)

    def update_heading(self, t_us: int, psi_rad: float, goes_against: Callable[[float], bool]) -> None:
        """Take a true heading. ``goes_against`` tells whether the vessel moves in another direction than a heading points."""
        if self.t_us is None or self.accepted_us is None:
            self._start(t_us, psi_rad)
            return
        self._advance(t_us)
        innovation = wrap_pi(psi_rad - self.psi_rad)
        since_received_us = t_us - self._received_us
        self._received_us = t_us
        # Within the narrowest gate of a compass that is heard there is nothing to weigh.
        near = -self._jump_rad <= innovation <= self._jump_rad and self._refused_since_us is None
        heard = 0 <= since_received_us <= self._timeout_us
        believable = (near and heard) or self._believable(t_us, since_received_us, psi_rad, innovation, goes_against)
        received_s = since_received_us * 1e-6
        if not 0.0 <= received_s <= 1.5:
            received_s = 0.0 if received_s < 0.0 else 1.5
        late_s = received_s - self._interval_s
        self._interval_s += (0.5 if late_s > 0.0 else 0.2) * late_s
        if not believable:
            return
        self._correct(innovation, self._cov.measure_value(self._variance))
        self.accepted_us = t_us
        self.course_us = None
        self._unseen.believed()
        self._unseen.see(t_us, self.r_radps)

    @property
    def refusing(self) -> bool:
        """True while headings are refused for a jump."""
        return self._refused_since_us is not None

    def move(self, t_us: int, psi_rad: float) -> None:
        """Start anew at a heading of another compass that is further off than a jump: the change is meant."""
        if self.t_us is None or abs(wrap_pi(psi_rad - self.at(t_us))) > self._jump_rad:
            r_radps = self.r_radps
            self._start(t_us, psi_rad)
            self.r_radps = r_radps

    def hand_over(self, t_us: int, psi_rad: float, period_s: float) -> None:
        """Take the newest heading of another compass, which speaks so often, for the one that was lost."""
        self.move(t_us, psi_rad)
        self.course_us = None
        self._end_refusal("")
        self.accepted_us = self._received_us = t_us
        self._interval_s = period_s or self._interval_s

    def expects(self, now_us: int, psi_rad: float) -> bool:
        """Whether a heading is no jump from the expected one, if any is expected."""
        return self.t_us is None or abs(wrap_pi(psi_rad - self.at(now_us))) <= self._jump_rad

    def forget(self) -> None:
        """The compass was wrong for some time: nothing of heading and turn rate is known."""
        self.t_us = self.accepted_us = self.course_us = None
        self._end_refusal("")

    def contradict(self, t_us: int, off_rad: float) -> None:
        """Take it as proven that the heading is wrong: it is lost at once, and what is expected is so much clockwise of it."""
        self._refused_rad = self.at(t_us)
        self.psi_rad = wrap_pi(self.psi_rad + off_rad)
        self._begin_doubt(t_us)
        self._jump.begins(t_us)
        self._lost_said = self._contradicted = self.proven_wrong = True
        off_deg = abs(math.degrees(off_rad))
        said = f"Heading not believed: thrust moves the boat {off_deg:.0f} deg off it (compass or thrusters wrong)"
        self._texts.append((Severity.ERROR, said))
        self._texts.append((Severity.INFO, _TRIED_AGAIN))
        lost_s = self._hold_s + self._late_s + _BRIDGE_S
        self.accepted_us, self.course_us = t_us - round(lost_s * 1e6) - 1, None

    def update_rate(self, rate: AngularVelocity) -> None:
        """Take a turn rate."""
        if self.t_us is None:
            return
        since_s, most = (rate.t_us - self._rate_us) * 1e-6, self._rate_max_radps
        self._rate_us = rate.t_us
        self._unseen.see(rate.t_us, rate.r_radps)
        if abs(rate.r_radps) > most:
            self._unseen.clip((abs(rate.r_radps) - most) * clamp(since_s, 0.0, _PREDICT_MAX_S))
        self._advance(rate.t_us)
        self._correct(rate.r_radps - self.r_radps, self._cov.measure_rate(self._rate_variance))

    def lean_on(self, t_us: int, r_radps: float) -> None:
        """Take the turn rate that was asked for, while neither compass nor sensor tells one: the course alone comes late to steer by."""
        if self.t_us is None or self.has_rate(t_us):
            return
        if t_us - self._received_us - self._late_us > self._timeout_us:
            self._unseen.see(t_us, r_radps)
        if self.course_us is None:
            return
        self._leant_us = t_us
        self._advance(t_us)
        self._correct(r_radps - self.r_radps, self._cov.measure_rate(_ASKED_VARIANCE))

    def update_course(self, t_us: int, course_rad: float, sigma_rad: float, late_s: float = 0.0) -> bool:
        """Take the course through the water as a poor heading while the compass is lost; True when the heading begins anew with it.

        The hull's sideslip makes it lag; a sigma of a few degrees leaves the rate sensor in command. ``late_s``: it lags by so much more,
        as that of an antenna behind the centre does. More lead than the settings' makes the steering swing, and so does less than none.
        """
        lead_s = self.config.course_lead_s
        self._lead_s = clamp(lead_s + late_s, 0.0, lead_s)
        is_first = self.course_us is None or t_us - self.course_us > _COURSE_AGE_MAX_US
        before_us, self.course_us = self.t_us, t_us
        self._unseen.strays = not self._way.is_hers()
        if before_us is None:
            self._start(t_us, course_rad)
            self.accepted_us, self.course_us = None, t_us
            return True
        self._advance(t_us)
        innovation = wrap_pi(course_rad - self.psi_rad)
        if is_first and t_us - before_us > _FORGOTTEN_US:
            self._cov = PairCovariance(self.config.yaw_acceleration_psd, sigma_rad * sigma_rad, _RATE_ANEW_VARIANCE)
            self.psi_rad, self.r_radps = course_rad, 0.0
            return True
        if is_first and abs(innovation) > 0.5 * math.pi:
            # The compass had been wrong altogether: that the heading is another says nothing of how fast it changes.
            self._cov.begin_value(sigma_rad * sigma_rad)
            self.psi_rad = course_rad
            return True
        self._correct(innovation, self._cov.measure_value(sigma_rad * sigma_rad))
        return False

    def _correct(self, innovation: float, gains: tuple[float, float]) -> None:
        """Take a difference into heading and turn rate by their gains; the vessel never turns faster than the settings say."""
        self.psi_rad = wrap_pi(self.psi_rad + gains[0] * innovation)
        r_radps, most = self.r_radps + gains[1] * innovation, self._rate_max_radps
        self.r_radps = most if r_radps > most else -most if r_radps < -most else r_radps

    def _start(self, t_us: int, psi_rad: float) -> None:
        self._cov = PairCovariance(self.config.yaw_acceleration_psd, self._variance, _RATE_ANEW_VARIANCE)
        self.psi_rad, self.r_radps, self.t_us = psi_rad, 0.0, t_us
        self.accepted_us = self._received_us = t_us
        self.course_us = self._refused_since_us = None
        self._contradicted = self.proven_wrong = False
        self._unseen.believed()

    def _advance(self, t_us: int) -> None:
        assert self.t_us is not None
        dt_s = (t_us - self.t_us) * 1e-6
        if dt_s <= 0.0:
            return
        if dt_s > _PREDICT_MAX_S:
            dt_s = _PREDICT_MAX_S
        self._cov.predict(dt_s)
        self.psi_rad = wrap_pi(self.psi_rad + self.r_radps * dt_s)
        self.t_us = t_us

    def _believable(
        self, t_us: int, since_us: int, psi_rad: float, innovation: float, goes_against: Callable[[float], bool]
    ) -> bool:
        since_s = since_us * 1e-6
        is_held = self._refused_since_us is not None and not self._refused_is_back
        is_old = since_us > self._timeout_us and since_s > self._patience_s()
        is_back = is_old and not is_held
        if is_back:
            self._end_silence(t_us, since_s)
        quickly_s = min(since_s, _STEP_RATE_MAX_S)
        slowly_s = max(0.0, min(since_s, self._interval_s) - _STEP_RATE_MAX_S)
        turned_deg = self._rate_max_dps * quickly_s + _SLOW_DPS * slowly_s + self._unseen.off_deg
        gate = math.radians(self._jump_deg + turned_deg)
        excused = not is_held and self._stands_in(t_us) and not self._contradicted and not self._way.denies(psi_rad)
        is_far = abs(innovation) > gate and not excused
        if is_far or not self._knows_better(t_us) or (gate > _VAGUE_RAD and self._is_elsewhere(psi_rad, goes_against)):
            self._refuse(t_us, psi_rad, innovation, gate, goes_against, is_back=is_back)
            return False
        starts_anew = is_old or self._unseen.off_deg > 0.0
        if self._refused_since_us is not None:
            self._end_refusal("heading is plausible again" if self._jump.ends() else "")
        if starts_anew:
            self._start(t_us, psi_rad)
        return not starts_anew

    def _knows_better(self, t_us: int) -> bool:
        """Whether what is expected may end a refusal: after a contradiction only where course or turn rate have told of it since."""
        assert self.accepted_us is not None
        newest_us = max(self.accepted_us, self.course_us or 0, self._rate_us)
        return not self._contradicted or (not self.proven_wrong and t_us - newest_us <= _FORGOTTEN_US)

    def _is_elsewhere(self, psi_rad: float, goes_against: Callable[[float], bool]) -> bool:
        """Whether a heading that nothing else tells of is not where thrust takes the vessel."""
        way = self._way
        return goes_against(psi_rad) and way.is_hers() and way.is_steady() and way.denies(psi_rad)

    def _stands_in(self, t_us: int) -> bool:
        """Whether a course stands in for the compass."""
        return self.course_us is not None and t_us - self.course_us <= _COURSE_AGE_MAX_US

    def _end_silence(self, t_us: int, silent_s: float) -> None:
        """Widen the window by how far the vessel may have turned from what is expected: a course knows of each turn."""
        if self._stands_in(t_us):
            self._unseen.end_course()
        else:
            self._unseen.end_silence(silent_s, is_told=t_us - self._rate_us <= _RATE_NEWS_US)

    def _refuse(
        self,
        t_us: int,
        psi_rad: float,
        innovation: float,
        gate: float,
        goes_against: Callable[[float], bool],
        *,
        is_back: bool,
    ) -> None:
        if self._refused_since_us is None:
            self._begin_refusal(t_us, math.degrees(innovation), is_back=is_back)
        elif abs(wrap_pi(psi_rad - self._refused_rad)) > gate:
            self._refused_run_us, self._borne_us = t_us, None  # not even consistent with itself
        self._refused_rad = psi_rad
        if not self._lost_said and not self.valid(t_us):
            self._lost_said = True
            self._texts.append((Severity.ERROR, "Heading refused: compass contradicts the motion"))
        if goes_against(psi_rad):
            self._refused_run_us, self._borne_us, self._contradicted = t_us, None, True
        elif not self._stands_in(t_us) or (self.proven_wrong and not self._way.is_driven()):
            self._borne_us = None
        elif self._borne_us is None:
            self._borne_us = t_us
        waited_us, anew_us = t_us - self._refused_run_us, self.config.reaccept_s * 1e6
        is_borne_out = self._borne_us is not None and t_us - self._borne_us >= anew_us
        if is_borne_out or waited_us >= max(anew_us, _UNOPPOSED_US if self._contradicted else 0.0):
            self._start(t_us, psi_rad)
            self._end_refusal(f"new heading accepted after {waited_us * 1e-6:.0f} s")

    def _begin_doubt(self, t_us: int) -> None:
        self._refused_since_us = self._refused_run_us = t_us
        self._borne_us, self._contradicted, self.proven_wrong, self._refused_is_back = None, False, False, False

    def _begin_refusal(self, t_us: int, off_deg: float, *, is_back: bool) -> None:
        self._begin_doubt(t_us)
        self._refused_is_back = is_back
        if not self._jump.begins(t_us):
            return
        if is_back:
            self._lost_said = True
            self._texts.append(
                (Severity.ERROR, f"Heading is back {off_deg:.0f} deg off the expected one: not believed")
            )
        else:
            self._texts.append((Severity.WARNING, f"Heading jumped by {off_deg:.0f} deg: holding"))

    def _end_refusal(self, text: str) -> None:
        self._refused_since_us = None
        self._lost_said = self._contradicted = self.proven_wrong = False
        if text:
            self._texts.append((Severity.INFO, f"Compass: {text}"))
