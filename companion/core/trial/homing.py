"""The way back to the middle of a trial's area, and the edge that must not be passed.

Whoever sails by it uses the vessel's law for the way back as long as that brings it nearer. A thruster that is dead, or a
file that is far off, can leave the law where it stands: then the trial's own sticks bring the vessel back, which lean on nothing
but the heading. Sticks out, nothing reaches an actuator from here.
"""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import clamp, wrap_pi

from .area import TrialArea
from .manoeuvres import towards

_LOOK_S: Final = 2.0
"""The edge is near when the vessel would be there in this time, besides its way to stop."""
_FARTHER: Final = 1.5
"""The way to stop is taken so much longer than the file says: that the file is not right is why the trial is held."""
_MARGIN_M: Final = 4.0
"""A boat's length or two, and a receiver without corrections."""
_INWARD: Final = 1.0
"""Throttle by which the way towards the edge is taken off."""
_ACROSS: Final = 0.3
"""Cosine between bow and edge below which neither ahead nor astern helps: the bow is turned first."""
_LEAST_HELM: Final = 0.3
"""More helm would leave too little of the thrust for the way back."""
_LAW_S: Final = 20.0
"""A vessel that its law brings back at all has turned round and made way long before."""
_NEARER_M: Final = 1.0
"""What counts as nearer: more than a receiver without corrections wanders in ``_LAW_S``."""
_HAND_THROTTLE: Final = 0.7
"""Enough way to steer by, with thrust left for the helm."""
_HAND_TURN: Final = 0.8
"""Helm without way, by the thrusters' difference."""
_HELM_PER_RAD: Final = 2.0
"""Rudders alone: hard over at 30 degrees off, because a lone thruster turns against them."""
_HAND_S: Final = 60.0
"""Rudders alone, and the thrusters' difference, get so long in turn: time for a turn round and 20 m."""
_AWAY_M: Final = 15.0
"""Farther off than she was, by so much, without the bow pointing home: this way of the sticks is wrong. A turn round takes less."""
_HOMEWARD_RAD: Final = math.radians(60.0)
"""The bow points home. A boat that is carried off all the same is in water that is faster than she, and her sticks are right."""
_WAYS: Final = 2
"""Of the sticks: by rudders alone, and by the thrusters' difference."""
_TURN_RAD: Final = math.radians(60.0)
_TURNED_RAD: Final = math.radians(20.0)
"""The bow is turned on the spot from the one on, until it is within the other."""
MIDDLE: Final = 0.35
"""Share of the way to the edge within which the vessel counts as back."""
_CENTRED: Final = 0.15
"""And within which the sticks let go again."""


class Homing:
    """Looks after one way back; ``begin`` for each."""

    def __init__(self, area: TrialArea, now_us: int, turn_s: float) -> None:
        """``turn_s``: wind and current set a stopped vessel for so long, until its bow is round."""
        self._area, self._turn_s = area, turn_s
        self.by_hand = False
        """The law has not brought the vessel nearer: the sticks do."""
        self._nearest_m, self._nearer_us = math.inf, now_us
        self._turning = False
        self._failed = 0
        """Ways of the sticks, one after the other, that did not even turn the bow home."""
        self._homeward_s = self._hand_s = 0.0
        self._stepped_us = now_us
        self.by_rudders = True
        """The sticks' turn with rudders alone: right where a thruster is dead, wrong where a rudder is stuck."""

    def begin(self, now_us: int) -> None:
        """The law's turn, from here on."""
        self.by_hand, self._nearest_m, self._nearer_us = False, math.inf, now_us
        self._failed = 0

    @property
    def in_vain(self) -> bool:
        """Neither way of the sticks so much as turns the bow home."""
        return self._failed >= _WAYS

    def step(self, now_us: int, state: EstimatedState, here: NorthEast) -> bool:
        """Take where the vessel is; return whether the sticks have just taken over."""
        area = self._area
        away_m, reach_m = area.away_m(here), area.reach_m(here)
        dt_s, self._stepped_us = (now_us - self._stepped_us) * 1e-6, now_us
        if self.by_hand:
            self._look_homeward(dt_s, state, here)
            if away_m < _CENTRED * reach_m:
                self.begin(now_us)
            elif away_m < self._nearest_m - _NEARER_M:
                self._nearest_m, self._nearer_us, self._failed = away_m, now_us, 0
            elif (now_us - self._nearer_us) * 1e-6 > _HAND_S or self._is_wrong(away_m):
                self._try_the_other(now_us, away_m)
            return False
        if away_m < MIDDLE * reach_m or away_m < self._nearest_m - _NEARER_M:
            self._nearest_m, self._nearer_us = away_m, now_us
        self.by_hand = (now_us - self._nearer_us) * 1e-6 > _LAW_S
        if self.by_hand:
            self._nearest_m, self._nearer_us = away_m, now_us
            self._homeward_s = self._hand_s = 0.0
        return self.by_hand

    def _look_homeward(self, dt_s: float, state: EstimatedState, here: NorthEast) -> None:
        assert state.psi_rad is not None
        self._hand_s += dt_s
        if abs(wrap_pi(self._bearing(here) - state.psi_rad)) < _HOMEWARD_RAD:
            self._homeward_s += dt_s

    def _is_wrong(self, away_m: float) -> bool:
        return away_m > self._nearest_m + _AWAY_M and self._homeward_s < 0.5 * self._hand_s

    def _try_the_other(self, now_us: int, away_m: float) -> None:
        self._failed = self._failed + 1 if self._homeward_s < 0.5 * self._hand_s else 0
        self.by_rudders = not self.by_rudders
        self._nearest_m, self._nearer_us = away_m, now_us
        self._homeward_s = self._hand_s = 0.0

    def sticks(self, state: EstimatedState, here: NorthEast) -> tuple[float, float]:
        """Surge and helm towards the middle."""
        assert state.psi_rad is not None
        home = self._bearing(here)
        off = wrap_pi(home - state.psi_rad)
        if self.by_rudders:
            return _HAND_THROTTLE, clamp(_HELM_PER_RAD * off - _HELM_PER_RAD * (state.r_radps or 0.0), -1.0, 1.0)
        self._turning = abs(off) > (_TURNED_RAD if self._turning else _TURN_RAD)
        if self._turning:
            return 0.0, math.copysign(_HAND_TURN, off)
        helm = towards(home, state.psi_rad, state.r_radps or 0.0)
        return _HAND_THROTTLE, clamp(helm, -_LEAST_HELM, _LEAST_HELM)

    def inward(self, state: EstimatedState, here: NorthEast) -> tuple[float, float]:
        """Thrust away from the edge, whichever end of the vessel points there."""
        assert state.psi_rad is not None
        home = self._bearing(here)
        ahead = math.cos(home - state.psi_rad)
        helm = towards(home, state.psi_rad, state.r_radps or 0.0)
        if abs(ahead) < _ACROSS:
            return _INWARD * _ACROSS, helm
        helm = clamp(helm, -_LEAST_HELM, _LEAST_HELM)
        return (_INWARD, helm) if ahead > 0.0 else (-_INWARD, 0.0)

    def edge_near(self, state: EstimatedState, here: NorthEast, stopping_m: float) -> bool:
        """Whether the vessel could not stop before the edge if it went on for a moment, and was set by wind and current then."""
        area, speed = self._area, state.sog_mps or 0.0
        if speed < 0.1:
            return False
        north, east = state.vx_mps or 0.0, state.vy_mps or 0.0
        if (here[0] - area.centre[0]) * north + (here[1] - area.centre[1]) * east <= 0.0:
            return False
        run_s = (_FARTHER * stopping_m + speed * _LOOK_S) / speed
        ahead = NorthEast((here[0] + run_s * north, here[1] + run_s * east))
        set_by = (self._turn_s * (state.drift_n_mps or 0.0), self._turn_s * (state.drift_e_mps or 0.0))
        ways = (ahead, NorthEast((ahead[0] + set_by[0], ahead[1] + set_by[1])))
        return min(map(area.room_m, ways)) < _MARGIN_M

    def _bearing(self, here: NorthEast) -> float:
        centre = self._area.centre
        return math.atan2(centre[1] - here[1], centre[0] - here[0])
