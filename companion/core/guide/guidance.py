"""Guidance: from a manoeuvre to a heading, a speed and a yaw rate, tick by tick.

Legs with rounded corners, circles, racetracks, figure-eights and station keeping; each is sailed as itself or refused,
never silently as another. A loiter tighter than the vessel can sail is slowed down for, and only then widened, and the
operator is told.
"""

from __future__ import annotations

import math

from pydantic import Field

from mavlink_bridge.language.figures import Circle, FigureEight, Hover, LoiterDirection, Round
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import (
    ActuatorOutput,
    Desired,
    EstimatedState,
    Goto,
    Loiter,
    PathControlState,
    Severity,
)
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import wrap_pi

from ..config import Config, param
from ..hull import Handling, VesselConfig
from ..hull.left import WHOLE, Shares
from .alone import Alone, turns_under_way
from .carried import CarriedOff
from .follow import FollowConfig, Follower
from .output import GuidanceOutput
from .paths import Arc, Chain, Line, Projection, straight_on
from .station import StationConfig, StationKeeper
from .stemmed import Stemmed
from .tight import TightWatch


class GuidanceConfig(Config):
    """How manoeuvres are sailed."""

    acceptance_m: float = param(
        2.0, "WP_RADIUS", "A point without a corner counts as reached within", unit="m", ge=0.2, le=100.0
    )
    corner_cut_m: float = param(
        0.9, "PATH_CUT", "A corner is rounded at most this far inside its legs", unit="m", ge=0.1, le=50.0
    )
    loiter_radius_m: float = param(
        20.0, "LOIT_RADIUS", "Radius of a loiter that names none", unit="m", ge=1.0, le=1000.0
    )
    follow: FollowConfig = Field(default_factory=FollowConfig)
    station: StationConfig = Field(default_factory=StationConfig)


_LEAST_LEG_M = 0.5
"""A shorter leg has no direction: that of two points so near is their receivers' noise."""
_TOO_FAST = "the water is faster than the vessel"
_CARRIED_MPS = 0.3
"""Speed over ground from which water that seems too fast is believed: it would carry the vessel away. One that stays where
it is under thrust has lost its thrust instead (weed, propellers gone): the monitors say so. Steerage way of the field."""


class Guidance:
    """Sails one manoeuvre at a time. Positions are metres from the estimator's origin."""

    def __init__(self, config: GuidanceConfig, vessel: VesselConfig) -> None:
        self._config = config
        self._acceptance_m = config.acceptance_m
        self._handling = Handling(vessel)
        self.follower = Follower(config.follow, self._handling)
        self._station = StationKeeper(config.station, self._handling)
        self._shares, self._backs_and_fills = WHOLE, False
        self._stemmed = Stemmed(self._handling)
        self._alone = self._station.alone = self._found_alone()
        self._texts: list[tuple[Severity, str]] = []
        self._unable = ""
        self._corner: tuple[NorthEast, Arc] | None = None
        """The arc into the coming leg, and the corner that it rounds."""
        self._clear()

    def _clear(self) -> None:
        self._maneuver: Goto | Loiter | None = None
        self._loiter: Loiter | None = None
        """The manoeuvre, when it is a loiter."""
        self._about_it = False
        """It is a circle about its point."""
        self._target = NorthEast((0.0, 0.0))
        self._track: Chain | None = None
        self._onward: NorthEast | None = None
        self._eight: tuple[float, float, float] | None = None
        self._goal_m, self._reach_m = math.inf, 0.0
        self._end_mps: float | None = None
        self._arrived = self._on_path = self._slowed = self._holds = False
        self._last_run_m: float | None = None
        self._sailed_m = 0.0
        self._tight = TightWatch()
        self._carried = CarriedOff()
        if self._alone is not None:
            self._alone.begin()

    def configure(self, config: GuidanceConfig) -> None:
        """Take new settings; geometry changes at the next manoeuvre."""
        self._config = config
        self._acceptance_m = config.acceptance_m
        self.follower.configure(config.follow)
        self._station.configure(config.station)

    def limit(self, *, fast_mps: float, turn_radps: float, backs_and_fills: bool) -> None:
        """Ask for no more than the steering law gives: m/s through the water at which it keeps its margins, rad/s of yaw.

        ``backs_and_fills``: it turns a boat of one screw where she lies.
        """
        if backs_and_fills is not self._backs_and_fills:
            self._backs_and_fills = backs_and_fills
            self._alone = self._station.alone = self._found_alone()
        self._handling.steered_within(turn_radps)
        self.follower.limit(fast_mps)
        self._stemmed.limit(fast_mps, is_whole=self._shares == WHOLE)

    def thrusters(self, shares: Shares) -> None:
        """Reckon with what each thruster still gives, port and starboard, as a share of what it is told."""
        self._shares = shares
        self._handling.thrusters(shares)
        self._alone = self._station.alone = alone = self._found_alone()
        lost = (alone.turning_mps, alone.most_mps) if alone and min(shares) == 0.0 else None
        self.follower.bends_within(*(lost or (0.0, math.inf)))
        self._station.thrusters(shares)

    def _found_alone(self) -> Alone | None:
        return turns_under_way(self._handling.vessel, self._shares, backs_and_fills=self._backs_and_fills)

    def drain_texts(self) -> tuple[tuple[Severity, str], ...]:
        texts, self._texts = tuple(self._texts), []
        return texts

    def begin(
        self,
        now_us: int,
        state: EstimatedState,
        maneuver: Goto | Loiter,
        previous: tuple[float, float] | None,
        following: Goto | Loiter | None,
    ) -> None:
        """Start a manoeuvre. ``previous`` is the point (lat, lon in rad) that the leg comes from, None = from here."""
        if not state.position_valid or state.origin_lat_rad is None or state.origin_lon_rad is None:
            raise ValueError("guidance begins with a known position only")
        frame = LocalFrame(state.origin_lat_rad, state.origin_lon_rad)
        corner = self._corner
        self._clear()
        self._corner = None
        self._maneuver = maneuver
        self._loiter = maneuver if isinstance(maneuver, Loiter) else None
        self._target = frame.to_local(maneuver.lat_rad, maneuver.lon_rad)
        if isinstance(maneuver, Goto):
            start = None if previous is None or maneuver.leg_from_here else frame.to_local(*previous)
            onward = None if following is None else frame.to_local(following.lat_rad, following.lon_rad)
            round_it = isinstance(following, Loiter) and not _stops(following)
            self._onward = None if round_it else onward
            self._begin_leg(state, maneuver, start, corner=corner, following=following, onward=onward)
            return
        figure = maneuver.figure
        if isinstance(figure, Hover):
            self._station.begin(self._target, _drift(state))
        else:
            self._begin_figure(state, figure)  # whatever goes round: it has segments

    def step(
        self,
        now_us: int,
        dt_s: float,
        state: EstimatedState,
        speed_mps: float,
        sent: ActuatorOutput | None = None,
    ) -> GuidanceOutput:
        """Return what to steer now. Without a position or a heading: nothing (neutral). ``sent``: what went out last."""
        if state.x_m is None or state.y_m is None or state.psi_rad is None:
            return GuidanceOutput(Desired(None, None), PathControlState(), self._arrived, self._on_path, self._turns())
        if self._track is None or (self._arrived and self._end_mps is not None):
            return self._keep_station(dt_s, state, sent)
        return self._follow(dt_s, state, self._track, speed_mps)

    def path_ahead(self, reach_m: float) -> list[NorthEast]:
        """The path that is being sailed, ``reach_m`` on from abeam of the vessel: points north and east of the origin.

        Beyond a leg's end it goes on to the next item; to keep station is to go to one point.
        """
        track = self._track
        if track is None or (self._arrived and self._end_mps is not None):
            return [self._target]
        points = track.way(reach_m)
        if not track.closed and self._onward is not None:
            points.append(self._onward)
        return points

    def _begin_leg(
        self,
        state: EstimatedState,
        maneuver: Goto,
        start: NorthEast | None,
        corner: tuple[NorthEast, Arc] | None,
        following: Goto | Loiter | None,
        onward: NorthEast | None,
    ) -> None:
        here = NorthEast((state.x_m or 0.0, state.y_m or 0.0))
        self._reach_m = maneuver.acceptance_m or self._acceptance_m
        entry = corner[1] if corner and start and math.dist(corner[0], start) < 0.01 else None
        if start and math.dist(start, self._target) < _LEAST_LEG_M:
            start = entry = None
            self._reach_m += _LEAST_LEG_M  # she has just been there, and has hardly gone on since
        begin = entry.point(entry.length_m) if entry else start or here
        segments: list[Line | Arc] = [entry] if entry else []
        arc = None
        if isinstance(following, Goto) and onward and maneuver.hold_s <= 0.0 and not following.leg_from_here:
            length_m = math.dist(begin, self._target)
            reach = max(0.0, length_m - 0.5) if start or length_m > self._reach_m else 0.0
            arc = self.follower.corner(begin, self._target, onward, cut_m=self._config.corner_cut_m, reach_m=reach)
        if arc is None:
            self._arrived = max(math.dist(place, self._target) for place in (here, begin)) <= self._reach_m
            segments.append(Line(begin, (self._arrived and onward) or self._target))
            self._goal_m = math.fsum(segment.length_m for segment in segments)
            through = following is not None and maneuver.hold_s <= 0.0 and not _stops(following)
            self._end_mps = None if through else 0.0
            if through and onward and not (self._arrived or straight_on(begin, self._target, onward)):
                self._end_mps = 0.3
        else:
            segments += [Line(begin, arc.point(0.0)), arc]
            self._goal_m = math.fsum(segment.length_m for segment in segments) - 0.5 * arc.length_m
            self._corner = (self._target, arc)
        self._track = Chain(tuple(segments), closed=False)
        self.follower.integrator.z_m *= 1.0 if entry else 0.0

    def _begin_figure(self, state: EstimatedState, figure: Round) -> None:
        self._about_it = isinstance(figure, Circle)
        radius = figure.radius_m or self._config.loiter_radius_m
        tightest = self.follower.tightest_m()
        if radius < tightest:
            self._warn(f"loiter radius raised from {radius:.1f} to {tightest:.1f} m: the vessel's limit")
            radius = tightest
        sense = self._sense(state, figure.direction)
        if isinstance(figure, FigureEight):
            self._eight = (sense * radius, figure.length_m or 2.0 * radius, figure.bearing_rad or 0.0)
        self._track = Chain(figure.segments(self._target, radius, sense), closed=True)
        self._track.nearest(state.x_m or 0.0, state.y_m or 0.0)
        self.follower.integrator.z_m = 0.0

    def _sense(self, state: EstimatedState, direction: LoiterDirection) -> int:
        """1 clockwise, -1 counter-clockwise."""
        if direction is LoiterDirection.CW:
            return 1
        if direction is LoiterDirection.CCW:
            return -1
        north, east = self._target[0] - (state.x_m or 0.0), self._target[1] - (state.y_m or 0.0)
        ahead_n, ahead_e = math.cos(state.psi_rad or 0.0), math.sin(state.psi_rad or 0.0)
        if direction is LoiterDirection.INTO_DRIFT:
            drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
            if math.hypot(*drift) > 0.05:
                ahead_n, ahead_e = -drift[0], -drift[1]
        # the centre to starboard of where it wants to go: clockwise
        return 1 if ahead_n * east - ahead_e * north >= 0.0 else -1

    def _follow(self, dt_s: float, state: EstimatedState, track: Chain, speed_mps: float) -> GuidanceOutput:
        desired, here, planned_mps = self.follower.step(dt_s, state, track, speed_mps, self._end_mps)
        if self._loiter is None:
            path = self._progress_of_leg(track, here, state)
        else:
            self._progress_of_loiter(track, here, state)
            self._tell_slowed(planned_mps, speed_mps)
            self._warn(self._tight.step(dt_s, near=self._on_path, cross_m=here.cross_m, radius_m=track.tightest_m))
            path = self._orbit_state(self._loiter, state, track, here)
        if not self._config.follow.use_drift:
            return self._result(self._led(dt_s, state, desired), path)
        return self._judged(dt_s, state, self._led(dt_s, state, desired), path)

    def _keep_station(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None) -> GuidanceOutput:
        if self._track is not None and self._station.anchor != self._target:
            self._station.begin(self._target, _drift(state))
        desired = self._station.step(dt_s, state, sent)
        if self._alone is not None:
            way_round, told = self._alone.way_round(state, self._target, self.follower.tightest_m())
            self._warn(told)
            if way_round is not None:
                desired, _, _ = self.follower.step(dt_s, state, way_round, self._alone.turning_mps, None)
        distance = self._station.distance_m(state)
        near = distance < self._acceptance_m
        self._warn(self._carried.step(dt_s, distance, state.sog_mps, near=near, turns_at_rest=self._alone is None))
        self._on_path = self._on_path or near
        self._holds = self._on_path or distance < self._station.reach_m
        maneuver = self._maneuver
        lat_rad, lon_rad = (None, None) if maneuver is None else (maneuver.lat_rad, maneuver.lon_rad)
        path = PathControlState(
            distance_m=distance,
            target_bearing_rad=self._bearing(state),
            target_lat_rad=lat_rad,
            target_lon_rad=lon_rad,
            on_path=near,
        )
        return self._judged(dt_s, state, self._led(dt_s, state, desired), path)

    def _led(self, dt_s: float, state: EstimatedState, desired: Desired) -> Desired:
        return desired if self._alone is None else self._alone.led(dt_s, state.psi_rad, desired)

    def _judged(self, dt_s: float, state: EstimatedState, desired: Desired, path: PathControlState) -> GuidanceOutput:
        drift_mps = math.hypot(*_drift(state))
        self._warn(self._stemmed.step(dt_s, drift_mps))
        carried = state.sog_mps is None or state.sog_mps >= _CARRIED_MPS
        if carried and not self._stemmed.can(drift_mps):
            return self._result(Desired(None, None), path, _TOO_FAST)
        return self._result(desired, path)

    def _result(self, desired: Desired, path: PathControlState, unable: str = "") -> GuidanceOutput:
        if unable and not self._unable:
            self._say(Severity.CRITICAL, unable[0].upper() + unable[1:] + ": stopped")
        self._unable = unable
        return GuidanceOutput(
            desired=desired,
            path=path,
            arrived=self._arrived,
            on_path=self._on_path,
            turns=self._turns(),
            unable=unable,
            holds=self._holds,
        )

    def _turns(self) -> float:
        return self._sailed_m / self._track.lap_m if self._track is not None and self._track.closed else 0.0

    def _progress_of_leg(self, track: Chain, here: Projection, state: EstimatedState) -> PathControlState:
        """Arrival by radius or by passing abeam."""
        maneuver = self._maneuver
        assert isinstance(maneuver, Goto)
        distance = math.dist((state.x_m or 0.0, state.y_m or 0.0), self._target)
        if not self._arrived:
            near = self._corner is None and distance <= self._reach_m
            self._arrived = near or track.run_m + here.along_m >= self._goal_m
        on_path = -self._acceptance_m < here.cross_m < self._acceptance_m
        return PathControlState(
            cross_track_m=here.cross_m,
            distance_m=distance,
            target_bearing_rad=self._bearing(state),
            target_lat_rad=maneuver.lat_rad,
            target_lon_rad=maneuver.lon_rad,
            on_path=on_path,
        )

    def _progress_of_loiter(self, track: Chain, here: Projection, state: EstimatedState) -> None:
        """Laps from the first touch of the path."""
        if not self._on_path:
            course = state.cog_rad if state.cog_rad is not None else state.psi_rad or 0.0
            aligned = abs(wrap_pi(course - here.course_rad)) < math.radians(35.0)
            self._on_path = abs(here.cross_m) < 1.0 and aligned
            self._last_run_m = None
        run = track.run_m + here.along_m
        if self._on_path and self._last_run_m is not None:
            step = run - self._last_run_m
            lap = track.lap_m
            self._sailed_m += step - lap * round(step / lap)
        self._last_run_m = run

    def _orbit_state(self, loiter: Loiter, state: EstimatedState, track: Chain, here: Projection) -> PathControlState:
        about_it, segment = self._about_it, track.segment
        return PathControlState(
            cross_track_m=here.cross_m,
            distance_m=abs(here.cross_m),
            target_bearing_rad=self._bearing(state),
            target_lat_rad=loiter.lat_rad,
            target_lon_rad=loiter.lon_rad,
            on_path=self._on_path,
            orbit_radius_m=segment.sense * segment.radius_m if isinstance(segment, Arc) else None,
            orbit_lat_rad=loiter.lat_rad if about_it else None,
            orbit_lon_rad=loiter.lon_rad if about_it else None,
            eight=self._eight,
        )

    def _bearing(self, state: EstimatedState) -> float:
        return math.atan2(self._target[1] - (state.y_m or 0.0), self._target[0] - (state.x_m or 0.0))

    def _tell_slowed(self, planned_mps: float, speed_mps: float) -> None:
        if not self._slowed and planned_mps < 0.95 * speed_mps:
            self._slowed = True
            self._say(Severity.INFO, f"slowing to {planned_mps:.1f} m/s: {speed_mps:.1f} is too fast for this radius")
        elif self._slowed and planned_mps > 0.98 * speed_mps:
            self._slowed = False
            self._say(Severity.INFO, f"back to {speed_mps:.1f} m/s")

    def _warn(self, told: str) -> None:
        if told:
            self._say(Severity.WARNING, told)

    def _say(self, severity: Severity, text: str) -> None:
        self._texts.append((severity, text))


def _stops(following: Goto | Loiter) -> bool:
    return isinstance(following, Loiter) and isinstance(following.figure, Hover)


def _drift(state: EstimatedState) -> tuple[float, float]:
    return (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
