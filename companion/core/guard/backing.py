"""Backing out from a shoal: from when to when, once for each stop.

It begins with an order that leads back while she lies with her bow on the shoal, and then goes on to its end: judged anew at each tick
the way ordered would lead back at one place and not at the next, and she would dither between astern and ahead. A boat that does not
go astern (a dead thruster, one that pushes the wrong way, a stream) gives it up: she turns, or is stopped as anywhere.
"""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.value import value

_NEAR_M: Final = 25.0
"""Farther from where she was stopped she has got away, and turns as anywhere."""
_BACK_M: Final = 8.0
"""So far she backs out: a turn at rest carries a boat whose propellers give less astern some three metres on."""
_BOW: Final = 0.5
"""Cosine of 60 degrees: with the bow farther off the shoal astern leads along it, and the turn that is left is short."""
_ASKEW: Final = 0.0
"""Cosine of 90 degrees: a bow that yaws farther while she backs out has turned already."""
_PROVE_US: Final = 3_000_000
"""So long thrust astern is given to take off way; from rest every shipped hull goes astern sooner."""
_ASTERN_M: Final = 0.15
"""In that time a position wavers less: who has gone so far astern, or so much less far on than in the time before, obeys."""
_GAIN_MPS: Final = 0.3
"""More way towards the shoal than she has had, beyond what a sea gives a boat that is filtered: thrust astern drives her on."""


@value
class Come:
    """Where she is, from where she was stopped."""

    off_m: float
    towards_m: float
    """Towards the shoal; negative: back from it."""
    towards_mps: float
    """Over ground: what thrust the wrong way gives is taken for a stream at first."""
    bow: float | None
    """Cosine of the angle between her bow and the way to the shoal."""


class BackingOut:
    """May be begun after a stop, goes on, and is over until the next stop."""

    def __init__(self) -> None:
        self._is_due = False
        """She has not yet got the room to turn."""
        self.began_at: NorthEast | None = None
        """Where she began; None: she does not back out."""
        self._farthest_m = 0.0
        """How far she has come on towards the shoal since she was stopped."""
        self._least_mps = 0.0
        """The least way towards it since she began."""
        self._since_us, self._since_m, self._before_m = 0, 0.0, 0.0
        """When the span began in which she has to prove that she goes astern, where, and how far she came on in the one before."""

    def arm(self) -> None:
        """She has been stopped: she may."""
        self._is_due, self.began_at, self._farthest_m = True, None, 0.0

    def end(self) -> None:
        """Over, until the next stop."""
        self._is_due, self.began_at = False, None

    def pause(self) -> None:
        """Nothing is ordered that needs it; the next order may begin it anew."""
        self.began_at = None

    def redirect(self) -> None:
        """What is ordered does not lead back: what has begun is over."""
        if self.began_at is not None:
            self.end()

    def follow(self, come: Come) -> bool:
        """Note how far she has come; return whether she has room to turn, and so need not back out."""
        self._farthest_m = max(self._farthest_m, come.towards_m)
        has_room = come.off_m > _NEAR_M or self._farthest_m - come.towards_m >= _BACK_M
        if has_room:
            self.end()
        return has_room

    def goes_on(self, state: EstimatedState, come: Come) -> bool:
        """Whether she backs out now; begins it where she may."""
        if not self._is_due or come.bow is None or state.x_m is None or state.y_m is None:
            return False
        if self.began_at is None:
            if come.bow < _BOW:
                return False
            self.began_at = NorthEast((state.x_m, state.y_m))
            self._least_mps = come.towards_mps
            self._since_us, self._since_m = state.t_us, come.towards_m
            self._before_m = max(come.towards_mps, 0.0) * _PROVE_US * 1e-6
        elif come.bow < _ASKEW or not self._obeys(state.t_us, come):
            self.end()
        return self._is_due

    def _obeys(self, now_us: int, come: Come) -> bool:
        """Whether she goes astern, or still loses the way that she had."""
        self._least_mps = min(self._least_mps, come.towards_mps)
        if come.towards_mps > max(self._least_mps, 0.0) + _GAIN_MPS:
            return False
        if now_us - self._since_us < _PROVE_US:
            return True
        moved_m, before_m = come.towards_m - self._since_m, self._before_m
        self._since_us, self._since_m, self._before_m = now_us, come.towards_m, moved_m
        return moved_m <= max(-_ASTERN_M, before_m - _ASTERN_M)
