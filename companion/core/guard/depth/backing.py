"""Backing out from a shoal: from when to when, once for each stop.

It begins with an order that leads back while she lies with her bow on the shoal, and then goes on to its end: judged anew at each tick
the way ordered would lead back at one place and not at the next, and she would dither between astern and ahead.
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


@value
class Come:
    """Where she is, from where she was stopped."""

    off_m: float
    towards_m: float
    """Towards the shoal; negative: back from it."""
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
        elif come.bow < _ASKEW:
            self.end()
        return self._is_due
