"""Keeping station without a sway thruster: face the push of wind and current and hold against it, or drift and return.

``weathervane`` points the bow once into what pushes and holds there: ahead and astern by thrust, sideways by turning the
bow a little to the side of the point, where the push itself brings the vessel over. Where nothing pushes it rests on its
heading and uses the thrusters ahead and astern. ``drift`` lets go inside a radius.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

from mavlink_bridge.language.messages import ActuatorOutput, Desired, EstimatedState
from mavlink_bridge.language.units import clamp, wrap_pi

from ..config import Config, param
from ..estimate import SmoothMotion
from ..hull import Handling
from ..hull.left import Shares
from ..hull.statics import Statics
from .alone import Alone
from .push import PushObserver

_TURN_ROUND_S = 6.0
"""A boat takes about so long to bring its bow back to the point: it begins that much before the circle's edge."""
_AT_REST = Desired(None, None)
_FACE_TAU_S = 6.0
"""How fast the bow follows the push when that turns."""
_FACE_RADPS = 0.1
"""The bow follows a push that turns no faster than 6 degrees a second: turning costs thrust."""
_VEERS_RAD, _VEERS_S = math.pi, 60.0
"""No wind and no current goes half round in a minute. A push that does turns with the bow, and is what the file says wrongly of the
thrust that turns her: a hull of other figures had followed her own tail for ever."""
_FEIGNED = 1.5
"""Pushes up to this much more than one that was none are none either, for as long as the boat stays at this point."""
_SURE = 1.2
_GONE = 0.4
"""Shares of the calm's limit at which a push is faced, and at which it is gone and the vessel rests as it lies."""
_UNKNOWN_MPS2 = 0.0025
"""A push that would hardly move the hull's mass is lost in the noise of its speed: a heavy one with little drag turned to that."""
_WEAK_MPS = 0.1
"""A push that carries the boat slower than this does not bring it over to a point that lies abeam: the boat must sail there. What
is left of the braking at the end of a voyage looks like such a push, too."""
_KICKS_WEAK_MPS = 0.04
"""The same where kicks over the rudder turn the boat: it cannot lie across a weak push, and hunted its point for minutes."""
_STAYS_WEAK = 1.5
"""A boat that sails back goes on until the push is so much stronger: it is not known to a tenth, and the bow went to and fro for it."""
_BACK = 0.3
"""Share of the radius within which the vessel is back at its point."""
_RESTS, _GOES, _TURNS = 0.08, 0.16, 0.22
"""Shares of the radius in still water: within the first the vessel rests, beyond the second it closes the distance along its bow,
beyond the third it turns for it when the point lies abeam."""
_FILLS = 2.0
"""Of as many radii are those shares where kicks over the rudder turn the boat: each turn sets it aside by some decimetres."""
_FILLS_MPS, _FILLS_RAD = 0.3, 0.15
"""So much way astern is asked for while kicks turn the bow by more than that: each kick brings way ahead, and one that is only taken back
leaves her a metre further on after a quarter turn. Light air alone lets her: in a wind she needs the way ahead. Not so in mode drift, whose
light hand would not close what it opens."""
_FILLS_FIRM = 0.25
"""From this firmness on none."""
_SAILS_FROM = 4.0
"""Beyond as many radii it heads for its point as on any voyage."""
_ABEAM = 0.8
"""The sine of the bearing off the bow, 53 degrees: from there on way ahead or astern brings the vessel no nearer to speak of."""
_ALONG_RAD = 0.5
"""With the bow so far off its heading the way that it makes leads past the point."""
_PAYS_S = 60.0
"""Mode drift: letting go pays when it lasts longer than this; turning the bow back costs more than holding meanwhile."""
_ALONE_M = 3.0
"""On one thruster the point is kept within this, or within the radius: less is no room to get way on."""
_ALONE_BACK = 0.5
"""Share of it within which the vessel lets go again."""
_ALONE_OFF_RAD = 0.5
"""With the bow so far off the rudders need more flow than it takes to hold it straight."""
_GUSTS_PER_MPS = 0.8
"""A stronger push comes in stronger gusts: so much more speed towards the point, per m/s that it would carry the boat at."""
_INNER_SHARE = 0.6
"""Most of the speed loop's bandwidth that the distance may ask for: more, and a boat of slow propellers surges to and fro."""
_BOW_LEADS = 3.0
"""Gain of the sideways distance over the yaw rate that the hull has at rest: beyond it the bow does not follow where it is told to look,
and a heavy boat goes to and fro beside her point."""
_MEETS_GUST = 1.4
"""Share of a gust's turn that the bow meets, over what slow propellers leave of the speed that the distance asks for."""
_MEETS_MOST = 0.25
"""The greatest share: a gust is half over when it is known, and a heavy boat that meets more of it swings about."""
_LIGHT = 0.15
"""Mode drift: share of the gain with which the point is held."""
_SIDEWAYS_MPS = 0.2
"""Below it the angle at which the bow is put aside stays small, however weak the push."""
_ASTERN_MPS, _AHEAD_MPS = 0.4, 0.8
"""Greatest speeds towards the point from near it."""


class StationConfig(Config):
    """Station keeping."""

    mode: Literal["weathervane", "drift"] = "weathervane"
    """'weathervane' holds the point with steady thrust, 'drift' saves energy inside the radius."""
    radius_m: float = param(2.0, "HOLD_RADIUS", "Drift mode: let go inside this radius", unit="m", ge=0.3, le=100.0)
    gain: float = param(0.35, "HOLD_GAIN", "Speed towards the point per metre of distance", unit="1/s", ge=0.05, le=2.0)
    speed_mps: float = param(1.0, "HOLD_SPEED", "Greatest speed towards the point", unit="m/s", ge=0.1, le=5.0)
    calm_mps: float = param(
        0.01,
        "HOLD_CALM",
        "The heading is left alone where wind and current carry the boat slower than this",
        unit="m/s",
        ge=0.01,
        le=1.0,
    )


class StationKeeper:
    """Holds one anchor point at a time."""

    def __init__(self, config: StationConfig, handling: Handling) -> None:
        self._most_firm = _INNER_SHARE * handling.surge_radps
        self._turns_at_rest = handling.model.turns_at_rest
        self._most_aside = _BOW_LEADS * handling.max_yaw_rate(0.0) if self._turns_at_rest else math.inf
        self._motion = SmoothMotion()
        self._push = PushObserver(handling)
        self._vessel, self._statics = handling.vessel, Statics(handling.vessel)
        self._weak_mps = _WEAK_MPS if self._turns_at_rest else _KICKS_WEAK_MPS
        self.alone: Alone | None = None
        """It turns only under way: what it can do."""
        self.anchor = (0.0, 0.0)
        self._heading_rad: float | None = None
        self._returning = self._sailing_back = False
        self._bow_rad: float | None = None
        self._followed_rad = 0.0
        """How far the bow has followed the push, of late."""
        self._feigned_n = 0.0
        """What a push was that went round with the bow."""
        self.configure(config)

    def thrusters(self, shares: Shares) -> None:
        """Reckon with what each thruster still gives of what it is told."""
        self._push.thrusters(shares)

    def configure(self, config: StationConfig) -> None:
        self._drifts = config.mode == "drift"
        self._radius_m, self._gain = config.radius_m, config.gain * (_LIGHT if self._drifts else 1.0)
        self._near_m = config.radius_m * (1.0 if self._turns_at_rest else _FILLS)
        self._firm = self._gain
        """The same in the push as it is."""
        self._speed_mps = config.speed_mps
        unknown_n = _UNKNOWN_MPS2 * self._vessel.hull.m11_kg
        self._calm_n = max(self._statics.drag_n(config.calm_mps), unknown_n)

    def begin(self, anchor: tuple[float, float], drift: tuple[float, float] = (0.0, 0.0)) -> None:
        """Hold this point from now on. ``drift``: what the estimator knows of the water, m/s north and east."""
        self.anchor = anchor
        self._motion.reset()
        self._push.begin(drift)
        self._heading_rad = None
        self._returning = self._sailing_back = False
        self._bow_rad = None
        self._feigned_n = 0.0

    @property
    def reach_m(self) -> float:
        """How near its point the boat may lie and turn for it before it comes to it, m."""
        if self.alone is not None:
            return max(self._radius_m, _ALONE_M)
        return self._radius_m if self._turns_at_rest else _SAILS_FROM * self._radius_m

    def distance_m(self, state: EstimatedState) -> float:
        assert state.x_m is not None
        assert state.y_m is not None
        return math.hypot(self.anchor[0] - state.x_m, self.anchor[1] - state.y_m)

    def step(self, dt_s: float, state: EstimatedState, sent: ActuatorOutput | None = None) -> Desired:
        """Return what to steer. ``sent``: what went out last."""
        self._push.step(dt_s, state, sent)
        motion = self._motion
        motion.step(dt_s, state)
        north, east = self.anchor[0] - motion.north_m, self.anchor[1] - motion.east_m
        drift = (state.drift_n_mps or 0.0, state.drift_e_mps or 0.0)
        if self.alone is not None and not self.alone.lies(math.hypot(drift[0], drift[1])):
            return self._on_one(state, north, east, drift, self.alone)
        if self._drifts:
            return self._drift_and_return(dt_s, state, north, east, drift)
        return self._weathervane(dt_s, state, north, east, drift)

    def _weathervane(
        self, dt_s: float, state: EstimatedState, north: float, east: float, drift: tuple[float, float]
    ) -> Desired:
        distance = math.hypot(north, east)
        if distance > _SAILS_FROM * self._radius_m:
            return self._go(state, north, east, drift)
        push_mps = self._statics.speed_for_thrust(self._push.strength_n)
        weak_mps = self._weak_mps * (_STAYS_WEAK if self._sailing_back else 1.0)
        from_m = self._sails_from_m(state.psi_rad or 0.0, north, east)
        self._sailing_back = push_mps < weak_mps and distance > from_m
        self._firm = self._gain if self._drifts else self._gain * (1.0 + _GUSTS_PER_MPS * push_mps)
        wanted, self._firm = self._firm, min(self._firm, self._most_firm)
        facing = None if self._sailing_back else self._face(dt_s)
        if facing is None:
            return self._rest(state, north, east, distance)
        # slow propellers cannot take back at once what a gust takes: so much of it is met with the bow
        meets = self._push.firmness * min(_MEETS_GUST * (1.0 - self._firm / wanted), _MEETS_MOST)
        facing = wrap_pi(facing + meets * self._push.gust_rad)
        cos, sin = math.cos(facing), math.sin(facing)
        starboard = east * cos - north * sin
        aside = math.atan2(
            min(self._firm, self._most_aside) * starboard, (push_mps if push_mps >= 0.3 else 0.3) + _SIDEWAYS_MPS
        )
        self._heading_rad = wrap_pi(facing + aside)
        return self._in_wind(self._steer(state, north, east), state.psi_rad or 0.0)

    def _sails_from_m(self, psi_rad: float, north: float, east: float) -> float:
        """How far off its point the boat sails there. With kicks it turns for a point abeam from further off, and leaves a nearer one
        to the push: it would lie there for ever.
        """
        turns_m = _TURNS * self._near_m
        if not self._sailing_back:
            return max((1.0 if self._drifts else 0.5) * self._radius_m, turns_m)
        is_abeam = abs(east * math.cos(psi_rad) - north * math.sin(psi_rad)) > _ABEAM * math.hypot(north, east)
        is_round = self._heading_rad is not None and abs(wrap_pi(self._heading_rad - psi_rad)) < _ALONG_RAD
        return turns_m if is_abeam and is_round and not self._turns_at_rest else 0.2 * self._radius_m

    def _steer(self, state: EstimatedState, north: float, east: float) -> Desired:
        """Turn gently to the heading that is chosen, and close the distance along the bow as it looks now."""
        psi = state.psi_rad or 0.0
        along = north * math.cos(psi) + east * math.sin(psi)
        most = self._speed_mps if self._speed_mps < _AHEAD_MPS else _AHEAD_MPS
        speed = clamp(self._firm * along - self._fills_mps(psi), -_ASTERN_MPS, most)
        return Desired(self._heading_rad, speed, brake=True, gentle=True)

    def _fills_mps(self, psi_rad: float) -> float:
        """How much less way ahead is asked for while kicks turn the bow."""
        is_turning = (
            not self._turns_at_rest
            and not self._drifts
            and self._heading_rad is not None
            and abs(wrap_pi(self._heading_rad - psi_rad)) > _FILLS_RAD
        )
        return _FILLS_MPS * max(0.0, 1.0 - self._push.firmness / _FILLS_FIRM) if is_turning else 0.0

    def _in_wind(self, desired: Desired, psi_rad: float) -> Desired:
        """The same, as hard as the wind asks for, with what turns the hull away met before it does."""
        return replace(desired, firmness=self._push.firmness, yaw_nm=self._push.counter_nm(psi_rad))

    @property
    def _least_n(self) -> float:
        """A push below this is nothing to face."""
        return max(self._calm_n, self._feigned_n)

    def _face(self, dt_s: float) -> float | None:
        """The direction that the bow is to look in, chosen once and then following slowly; None where nothing pushes."""
        push = self._push
        strength_n = push.strength_n
        if self._bow_rad is None:
            if strength_n < _SURE * self._least_n:
                return None
            self._bow_rad = push.against_rad
        elif strength_n < _GONE * self._least_n:
            self._bow_rad = None
        else:
            step = wrap_pi(push.against_rad - self._bow_rad) * dt_s / _FACE_TAU_S
            most = _FACE_RADPS * dt_s
            step = clamp(step, -most, most)
            self._bow_rad = wrap_pi(self._bow_rad + step)
            self._followed_rad += step - self._followed_rad * dt_s / _VEERS_S
            if abs(self._followed_rad) > _VEERS_RAD:
                self._feigned_n = max(self._feigned_n, _FEIGNED * strength_n)
                push.forget()
                self._bow_rad = None
        if self._bow_rad is None:
            self._followed_rad = 0.0
        return self._bow_rad

    def _would_face(self, psi_rad: float) -> float:
        """Where the bow had best look when it must turn: against what pushes a little, or it would soon turn again; else as it lies."""
        push = self._push
        return psi_rad if push.strength_n < _GONE * self._least_n else push.against_rad

    def _rest(self, state: EstimatedState, north: float, east: float, distance: float) -> Desired:
        """Still water: rest near the point; beyond, close the distance ahead or astern, and turn only when it lies abeam."""
        near_m = self._near_m
        self._returning = distance > (_RESTS if self._returning else _GOES) * near_m
        if not self._returning:
            self._heading_rad = None
            return _AT_REST
        psi = state.psi_rad or 0.0
        if self._heading_rad is None:
            self._heading_rad = psi
        cos, sin = math.cos(self._heading_rad), math.sin(self._heading_rad)
        if distance > _TURNS * near_m and abs(east * cos - north * sin) > _ABEAM * distance:
            bearing = math.atan2(east, north)
            behind = abs(wrap_pi(bearing - self._would_face(psi))) > 0.5 * math.pi
            self._heading_rad = wrap_pi(bearing + (math.pi if behind else 0.0))
        steer = replace(self._steer(state, north, east), brake=False)
        # a hull that turns slowly would go round and round its point if it made way meanwhile
        return steer if abs(wrap_pi(self._heading_rad - psi)) < _ALONG_RAD else replace(steer, speed_mps=0.0)

    def _go(self, state: EstimatedState, north: float, east: float, drift: tuple[float, float]) -> Desired:
        """Head for the point by the triangle of velocities, slower while the bow is elsewhere."""
        distance = math.hypot(north, east)
        wanted = min(self._speed_mps, self._gain * distance) / max(distance, 1e-6)
        water_n, water_e = north * wanted - drift[0], east * wanted - drift[1]
        psi = math.atan2(water_e, water_n)
        self._heading_rad = psi
        bow_rad = state.psi_rad or 0.0
        surge = math.hypot(water_n, water_e) * max(0.0, math.cos(wrap_pi(psi - bow_rad)))
        # along the bow as it looks now: by the drift against the way home a boat that lies across was backed away, full astern
        over_ground_mps = surge + drift[0] * math.cos(bow_rad) + drift[1] * math.sin(bow_rad)
        # turned gently, a small boat in strong wind does not come round, and is blown off for good
        return self._in_wind(Desired(psi, over_ground_mps, brake=True), bow_rad)

    def _drift_and_return(
        self, dt_s: float, state: EstimatedState, north: float, east: float, drift: tuple[float, float]
    ) -> Desired:
        """Let go inside the radius; come back, and hold with a light hand where the push would soon carry it off again."""
        distance, radius = math.hypot(north, east), self._radius_m
        over_ground_mps = math.hypot(state.vx_mps or 0.0, state.vy_mps or 0.0)
        if distance > radius - min(0.5 * radius, _TURN_ROUND_S * over_ground_mps):
            self._returning = True
        elif distance < _BACK * radius and self._carried_s() > _PAYS_S:
            self._returning = False
        if not self._returning:
            return _AT_REST
        return self._weathervane(dt_s, state, north, east, drift)

    def _on_one(
        self, state: EstimatedState, north: float, east: float, drift: tuple[float, float], alone: Alone
    ) -> Desired:
        """With one thruster there is no astern and no turn at rest: sail to the point, let go there, and come back to it."""
        self._returning = math.hypot(north, east) > (_ALONE_BACK if self._returning else 1.0) * self.reach_m
        if not self._returning:
            return _AT_REST
        go = self._go(state, north, east, drift)
        assert go.psi_rad is not None
        bow_rad = state.psi_rad or 0.0
        along_mps = drift[0] * math.cos(bow_rad) + drift[1] * math.sin(bow_rad)
        off = abs(wrap_pi(go.psi_rad - bow_rad))
        water_mps = alone.turning_mps if off > _ALONE_OFF_RAD else alone.least_mps
        return replace(go, speed_mps=max(go.speed_mps or 0.0, water_mps + along_mps), brake=False)

    def _carried_s(self) -> float:
        """How long the push would take to carry the vessel out of the radius, s."""
        return self._radius_m / max(self._statics.speed_for_thrust(self._push.strength_n), 1e-3)
