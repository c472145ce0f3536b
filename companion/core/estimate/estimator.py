"""The estimator: measurements of the sensors in, the vessel's state at each tick out, with honest validity.

Position and heading are filtered where the measurement was valid and predicted to the tick; what is too old, refused
or frozen is None. The drift vector is what the ground velocity holds beyond the modelled speed through the water.
"""

from __future__ import annotations

import math
from typing import assert_never

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    AngularVelocity,
    Distance,
    EstimatedState,
    EulerAngles,
    FixType,
    GpsFix,
    Measurement,
    Severity,
)
from mavlink_bridge.language.units import wrap_pi

from ..hull.geometry import HullGeometry
from ..magnetic import FixVariation
from .antenna import Attitude, at_centre
from .compasses import Compasses
from .config import EstimatorConfig
from .flags import PlaceFlags
from .heading import HeadingTrack
from .own_way import MadeWay, OwnWay
from .position import Motion, PositionTrack
from .receivers import FixChoice
from .sounders import Sounders
from .sources import Choice, degrees_a_second
from .tilt import Tilt
from .told import FixText
from .water import WaterMeans

__all__ = ["Estimator", "EstimatorConfig"]

_COURSE_MIN_MPS = 0.1
"""Below this no course is shown: it is the direction of noise."""
_RATE_APART_RADPS = math.radians(2.0)
_SHOWN_US = 2_500_000
"""A compass slower than one heading in this time is not believed either (slow_compass_s)."""
_SAME_UNIT_US = 1_000_000
"""A turn rate that has stood for as long as the heading comes from the same unit, and is as wrong: they come by turns."""
_COURSE_SIGMA_RAD = math.radians(5.0)
_AT_THE_POINT = HullGeometry()
_Pair = tuple[float, float]


class Estimator:
    """One vessel's estimator. ``update`` each measurement, then ``predict`` once per tick."""

    def __init__(self, config: EstimatorConfig, geometry: HullGeometry = _AT_THE_POINT) -> None:
        """``geometry``: where the antennas are; by default at the vessel's reference point."""
        self._geometry = geometry
        self._texts: list[tuple[Severity, str]] = []
        self._water = WaterMeans()
        self._own = OwnWay(self._water)
        self._heading = HeadingTrack(config, self._texts, self._own)
        self._heading.variation.by_model = self._model_variation
        self.has_turn_rate, self.heading_waited_s = self._heading.has_rate, self._heading.waited_s
        self._position = PositionTrack(config, self._texts)
        self._receivers = FixChoice(
            self._texts, geometry.antenna_of, self._compass_attitude_at, self._position.is_acceptable
        )
        self._position.contradicted_by = self._receivers.contradicted_by
        self._compasses = Compasses(self._heading, self._texts, self._distrust_heading)
        self._rates = Choice("Turn rate", self._texts, least_s=1.0, most_s=3.0, figure=degrees_a_second)
        self._tilt = Tilt(self._texts)
        self._sounders = Sounders(self._texts, geometry)
        self.distance_at = self._sounders.at
        self._variation = FixVariation()
        self.latest_fix: GpsFix | None = None
        self._antenna_told: tuple[_Pair, _Pair] | None = None
        """What the newest fix told of the antenna's velocity, and where that is from the reference point."""
        self._attitude: EulerAngles | None = None
        self._rate: tuple[float, int] | None = None
        self._rate_since_us = 0
        """Since when the turn rate has been the very same."""
        self._fix_text = FixText(self._texts)
        self._utc_offset_us: int | None = None
        self._way = MadeWay()
        self._last_us: int | None = None
        self._motion: Motion | None = None
        self.configure(config)

    def configure(self, config: EstimatorConfig) -> None:
        """Take new settings; the state is kept."""
        self.config = config
        self._heading.configure(config)
        self._position.configure(config)
        self._course_mps = self._own.least_mps = config.course_speed_mps
        self._tilt.configure(config)
        self._drift_tau_s = config.drift_tau_s
        self._aligns = config.align_clock

    @property
    def origin(self) -> LocalFrame | None:
        """Origin of x and y: the first good fix of the run; None before."""
        return self._position.origin

    def flags(self, state: EstimatedState) -> PlaceFlags:
        """What the failsafe should know of the place, with the state that was predicted last."""
        return PlaceFlags(
            position_lost=state.x_m is None or state.y_m is None,
            heading_lost=state.psi_rad is None,
            position_frozen=self._position.frozen,
            sources_disagree=self._receivers.disagree,
        )

    @property
    def leapt_m(self) -> _Pair:
        """By how much the position has leapt in all, north and east, from what was believed to what was believed next."""
        return self._position.leapt_m

    @property
    def sources_disagree(self) -> bool:
        """True while two receivers are further apart than both allow, for 5 s and more."""
        return self._receivers.disagree

    @property
    def compasses_apart(self) -> str:
        """Which two compasses are further apart than a jump, for 5 s and more, in words; empty where none are."""
        return self._compasses.apart

    @property
    def heading_proven_wrong(self) -> bool:
        """Whether thrust has proven the compass wrong, and it has not been believed since."""
        return self._heading.proven_wrong

    @property
    def latest_attitude(self) -> EulerAngles | None:
        """The newest of every axis that is not too old, as measured: sentences measure different ones."""
        last, compass = self._attitude, self._compasses.angles
        if last is None or (last is compass and not self._tilt.is_known):
            return last
        return self._tilt.beside(last.t_us, compass)

    @property
    def used(self) -> dict[str, str]:
        """The source of each quantity that has one, as texts name it: ``{"heading": "compass GPHDT"}``."""
        named: dict[str, Choice | FixChoice | Compasses] = {"position": self._receivers, "heading": self._compasses}
        named |= {"turn rate": self._rates, **self._tilt.choices, "depth": self._sounders.choice}
        return {quantity: choice.used for quantity, choice in named.items() if choice.used}

    @property
    def knows_tilt(self) -> bool:
        """Whether roll or pitch has ever been measured."""
        return self._tilt.is_known

    def fix_at(self, now_us: int) -> GpsFix | None:
        """What the receiver says now: the newest fix, None when it has fallen silent."""
        fix = self.latest_fix
        return fix if fix is not None and self._position.is_young((now_us - fix.t_us) * 1e-6) else None

    def attitude_at(self, now_us: int) -> EulerAngles | None:
        """The newest of every axis that is not too old; None when no axis is."""
        found = self.latest_attitude
        return found if found is not None and now_us - found.t_us <= _SHOWN_US else None

    @property
    def latest_distance(self) -> Distance | None:
        """The newest sounding of the sounder that counts."""
        return self._sounders.latest

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Operator texts since the last call."""
        if not self._texts:
            return []
        texts, self._texts[:] = self._texts[:], []
        return texts

    def utc_us(self, now_us: int) -> int | None:
        """UTC now, microseconds since 1970; None before a receiver gave date and time."""
        return None if self._utc_offset_us is None else now_us + self._utc_offset_us

    def note_water_speed(self, u_mps: float | None, v_mps: float = 0.0) -> None:
        """Tell the modelled surge and sway through the water, m/s; None holds the drift as it is."""
        self._own.modelled_mps = None if u_mps is None else (u_mps, v_mps)

    def note_turn(self, now_us: int, dt_s: float, r_radps: float) -> None:
        """Tell the turn rate that thrusters and rudders were asked for, whatever a compass says of it."""
        self._compasses.watch.note_asked(now_us, dt_s, r_radps)
        self._heading.lean_on(now_us, r_radps)

    @property
    def turns_unseen(self) -> bool:
        """Whether no sensor tells the turn rate: the compass is lost, or has said the same for so long that it tells nothing."""
        return self._compasses.watch.tells_no_turn or self._heading.course_us is not None

    def recall_water(self, state: EstimatedState) -> tuple[EstimatedState, _Pair | None]:
        """A fault was found: take the water as it was before. Return the state with it, surge and sway through it, m/s; None: unknown."""
        return self._water.recall(state)

    def update(self, measurement: Measurement, source: int = 0) -> bool:
        """Take one measurement; True when its sensor is the one that counts. ``source`` numbers the links."""
        match measurement:
            case EulerAngles():
                return self._update_attitude(measurement, source)
            case AngularVelocity():
                return self._update_rate(measurement, source)
            case Distance():
                return self._sounders.update(measurement, source)
            case GpsFix():
                return self._update_fix(measurement, source)
            case _:
                assert_never(measurement)

    def predict(self, now_us: int, alt_m: float | None = None) -> EstimatedState:
        """The state at ``now_us``. ``alt_m`` is the height above the bottom from the depth guard's input chain."""
        self._stand_in(now_us)
        track, position, fix, origin = self._heading, self._position, self.latest_fix, self._position.origin
        heading_valid = track.valid(now_us)
        psi_rad, r_radps = (track.at(now_us), track.r_radps) if heading_valid or track.bridged(now_us) else (None, 0.0)
        self._motion = motion = position.predict(now_us, psi_rad, r_radps) if position.valid(now_us) else None
        north_m = east_m = vn = ve = sog_mps = cog_rad = u_mps = v_mps = lat_rad = lon_rad = height_m = None
        if motion is not None and fix is not None and origin is not None:
            north_m, east_m, vn, ve = motion
            lat_rad, lon_rad = origin.to_geodetic(north_m, east_m)
            height_m = fix.height_msl_m
            sog_mps = math.hypot(vn, ve)
            if sog_mps > _COURSE_MIN_MPS:
                cog_rad = wrap_pi(math.atan2(ve, vn))
        from_course = not heading_valid and self._course_stands_in(now_us)
        psi_rad = psi_rad if heading_valid or from_course else None
        dt_s, self._last_us = 0.0 if self._last_us is None else (now_us - self._last_us) * 1e-6, now_us
        ground = None if motion is None else motion[2:]
        self._own.step(dt_s, ground)
        if not heading_valid:
            self._water.lose_heading(dt_s, ground, self._own.modelled_mps)
        if ground is not None and psi_rad is not None:
            u_mps, v_mps = self._along(dt_s, ground, psi_rad, turns_radps=r_radps if heading_valid else None)
        drift, current = self._water.drift_mps, self._water.current_mps
        fix_n_mps, fix_e_mps = position.take_velocity()
        phi_rad, theta_rad = self._tilt.at(now_us)
        return EstimatedState(
            t_us=now_us,
            lat_rad=lat_rad,
            lon_rad=lon_rad,
            height_msl_m=height_m,
            origin_lat_rad=None if origin is None else origin.lat_rad,
            origin_lon_rad=None if origin is None else origin.lon_rad,
            x_m=north_m,
            y_m=east_m,
            vx_mps=vn,
            vy_mps=ve,
            u_mps=u_mps,
            v_mps=v_mps,
            phi_rad=phi_rad,
            theta_rad=theta_rad,
            psi_rad=psi_rad,
            r_radps=None if psi_rad is None else r_radps,
            sog_mps=sog_mps,
            cog_rad=cog_rad,
            drift_n_mps=drift[0],
            drift_e_mps=drift[1],
            current_n_mps=current[0],
            current_e_mps=current[1],
            made_share=self._water.made_share,
            alt_m=alt_m,
            fix_n_mps=fix_n_mps,
            fix_e_mps=fix_e_mps,
            position_age_s=None if position.accepted_us is None else (now_us - position.accepted_us) * 1e-6,
            heading_age_s=None if track.accepted_us is None else (now_us - track.accepted_us) * 1e-6,
            depth_age_s=self._sounders.age_s(now_us),
            fix_type=FixType.NONE if fix is None or self.fix_at(now_us) is None else fix.fix_type,
            heading_from_course=from_course,
        )

    def _along(
        self, dt_s: float, ground: tuple[float, float], psi_rad: float, *, turns_radps: float | None
    ) -> tuple[float, float]:
        """Return surge and sway over ground; where the compass tells the heading, and so the turn, see what the water does."""
        (vn, ve), sine, cosine = ground, math.sin(psi_rad), math.cos(psi_rad)
        if turns_radps is not None:
            self._step_water(dt_s, ground, bow=(cosine, sine), r_radps=turns_radps)
        return vn * cosine + ve * sine, ve * cosine - vn * sine

    def _update_fix(self, fix: GpsFix, link: int) -> bool:
        fix = self._receivers.somewhere(fix, link)
        if not self._receivers.leads(link, fix):
            return False
        self._take_fix(fix, link, anew=self._receivers.moved)
        return True

    def _take_fix(self, fix: GpsFix, link: int, *, anew: bool) -> None:
        """Take a fix of the receiver that counts; ``anew``: it has just become that."""
        self.latest_fix = fix
        self._fix_text.note(fix)
        t_us = self._position.aligned_us(fix) if self._aligns else fix.t_us
        if fix.utc_us is not None:
            self._utc_offset_us = fix.utc_us - t_us
        attitude = self._attitude_at(t_us)
        water_mps = self._own.modelled_mps[0] if self._own.modelled_mps else None
        moving = self._way.is_made(fix, attitude.psi_rad, water_mps=water_mps, drift_mps=self._water.known_mps)
        self._compasses.note_fix(fix, self._water.known_mps, self._course_mps)
        antenna = self._geometry.antenna_of(link)
        told = self._position.update(
            fix, t_us, attitude, moving, antenna, anew=self._receivers.period_s if anew else None
        )
        self._antenna_told = told
        if told is not None and not self._heading.valid(t_us) and self._position.valid(t_us):
            self._steer_by_course(t_us, *told)

    def _stand_in(self, now_us: int) -> None:
        """Before position or heading counts as lost: take the newest of another source that is sound."""
        position = self._position
        if not position.valid(now_us):
            expects = position.expects if position.is_known_wrong else None
            found = self._receivers.stand_in(now_us, position.why_lost, expects, lively=position.is_frozen_out)
            if found is not None:
                self._take_fix(found[1], found[0], anew=True)
        if not self._heading.valid(now_us):
            self._compasses.stand_in(now_us)

    def _distrust_heading(self, t_us: int, seconds: float) -> None:
        """The heading was wrong for the last seconds, and what was made of it: the course stands in at once, before the next fix."""
        self._heading.forget()
        self._position.forget_heading()
        self._water.take_back(seconds)
        if self._rate is not None and self._rate_since_us <= t_us - round(seconds * 1e6) + _SAME_UNIT_US:
            self._rates.bar("repeats one rate")
        if self._antenna_told is not None and self._position.valid(t_us):
            self._steer_by_course(t_us, *self._antenna_told)

    def _steer_by_course(self, t_us: int, antenna_mps: _Pair, ahead_m: _Pair) -> None:
        """The compass is lost: the direction of the motion through the water is the next best heading.

        From the fix itself, since the filtered velocity lags in a turn. A vessel that a stream carries may make no way through it.
        What an antenna makes beside the centre is taken off where the turn rate is measured. One that was found from the course would
        feed itself (behind the centre it grows): there the course is taken for a later or a sooner one.
        """
        track = self._heading
        is_measured = track.has_rate(t_us)
        north, east = self._water.through_mps(at_centre(antenna_mps, ahead_m, track.r_radps if is_measured else 0.0))
        made_mps = math.hypot(north, east)
        if made_mps < self._course_mps:
            return
        sigma = max(_COURSE_SIGMA_RAD, self.config.velocity_sigma_mps / made_mps)
        late_s = 0.0 if is_measured else -(north * ahead_m[0] + east * ahead_m[1]) / (made_mps * made_mps)
        if track.update_course(t_us, wrap_pi(math.atan2(east, north) + self._own.stern_rad), sigma, late_s):
            self._position.forget_heading()

    def _course_stands_in(self, now_us: int) -> bool:
        if self._motion is None or not self._heading.bridged(now_us):
            return False
        return math.hypot(*self._water.through_mps(self._motion[2:])) > self._course_mps

    def _update_rate(self, rate: AngularVelocity, link: int) -> bool:
        if self._rates.is_barred(rate.source, link) and self._rate is not None and rate.r_radps != self._rate[0]:
            self._rates.lift((link, "" if rate.source is None else rate.source.address), rate.t_us)
        if self._rates.leads(rate.source, link, rate.t_us):
            if self._rate is None or rate.r_radps != self._rate[0]:
                self._rate_since_us = rate.t_us
            self._rate = (rate.r_radps, rate.t_us)
            self._compasses.note_rate(rate.t_us, rate.r_radps)
            self._heading.update_rate(rate)
            return True
        self._rates.compare_newest(rate, link, value=rate.r_radps, used=self._rate, limit=_RATE_APART_RADPS)
        return False

    def _update_attitude(self, angles: EulerAngles, link: int) -> bool:
        leads = self._tilt.update(angles, link)
        if angles.psi_rad is not None or angles.psi_magnetic_rad is not None:
            leads |= self._compasses.update(angles, link, self._own.goes_against)
        if leads:
            self._attitude = angles
        return leads

    def _model_variation(self) -> float | None:
        return self._variation.of(self.latest_fix) if self.config.world_magnetic_model else None

    def _attitude_at(self, t_us: int) -> Attitude:
        track = self._heading
        if not track.valid(t_us) and not track.bridged(t_us):
            return Attitude()
        phi_rad, theta_rad = self._tilt.at(t_us)
        return Attitude(track.at(t_us), track.r_radps, phi_rad or 0.0, theta_rad or 0.0)

    def _compass_attitude_at(self, t_us: int) -> Attitude:
        """A course that stands in for the compass does not tell where an antenna is to a decimetre."""
        return self._attitude_at(t_us) if self._heading.valid(t_us) else Attitude()

    def _step_water(self, dt_s: float, ground: _Pair, *, bow: _Pair, r_radps: float) -> None:
        water, position, through = self._water, self._position, self._own.modelled_mps
        if through is None:
            return
        water.step(dt_s, self._drift_tau_s, ground_mps=ground, bow=bow, through_mps=through, r_radps=r_radps)
        off_rad = water.turned_by_rad(dt_s, ground_mps=ground, bow=bow, through_mps=through, told=position.told)
        position.drift_n_mps, position.drift_e_mps = (mps or 0.0 for mps in water.current_mps)
        if off_rad is not None and self._last_us is not None:
            self._heading.contradict(self._last_us, off_rad)
            position.forget_heading()
