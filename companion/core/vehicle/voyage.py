"""The voyage: that one has begun, and where. A new check refuses a departure, never a way back, so somebody must know which it is.

It begins with arming, and ends when an operator disarms at the place where it began, or half an hour after he did so elsewhere or
with the position lost. What else disarms (a failsafe, a board or a computer that starts again) does not end it; at the place where
it began it does, half an hour later. While it lasts arming again does not move home to the open sea. A computer that starts again
after an operator's disarm knows from the receiver's clock how long ago that was.
"""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.geodesy import at_most_m, inverse
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.points import LatLon

LANDED_M: Final = 50.0
"""So near to where it began, a vessel that is disarmed has come back: a pier, and the error of a receiver without corrections."""
RESUMED_M: Final = 5_000.0
"""A computer that starts again farther than this from home and from where the vessel was last seen does not go on with the voyage: it
was carried. A dead boat drifts less in an hour.
So was a vessel that is armed so far from where an operator disarmed her: no current sets her so far in ``OPEN_US``."""
_SEEN_EVERY_M: Final = 500.0
"""Where the vessel was last seen is kept this often: a tenth of the above, and one line on the disk in minutes."""
OPEN_US: Final = 30 * 60 * 1_000_000
"""So long after an operator's disarm elsewhere the next arming is still no departure; then the boat may lie on a trailer.
So long after another disarm at the place where it began: she may have been set out from there, or lie ashore, switched off."""
_NOT_YET: Final = 1 << 62
"""Later than any clock: what an earlier process's operator left is taken for left when this one began, until a receiver tells the time."""
ADRIFT: Final = (
    Severity.WARNING,
    "Restarted under way: disarmed and drifting; arm to go on, or Disarm to leave it so",
)
"""What a computer that starts again at sea leaves behind, until somebody decides."""
_PLACE_US: Final = 10_000_000
"""By then a receiver that runs has told the place: a boat by the pier does not drift, and one that may be anywhere is told of."""
_AGAIN_US: Final = 60_000_000
"""A trouble that lasts is told once a minute, as the store's is."""
Left = tuple[LatLon | None, int | None]
"""Where an operator left a voyage, and when by the receiver's clock, µs UTC; None = not known."""


class Voyage:
    """One vessel's. Times are the vessel's monotonic ones, µs."""

    def __init__(self) -> None:
        self.place: LatLon | None = None
        """Where it began, rad; None = not known."""
        self.has_sailed = False
        """Armed before, in the life of this process or on the voyage that it goes on with: a store that fails since bars nothing."""
        self._begun = False
        self._broken = False
        """What disarmed the vessel at sea, or ended the process before, was no operator."""
        self._left_us: int | None = None
        self._left_at: LatLon | None = None
        """Where an operator disarmed, or what else by the pier; with no position, where the vessel was last known to be."""
        self._left_utc_us: int | None = None
        self._is_dated = False
        """The receiver's clock has told when that was."""
        self.is_from_before = False
        """An earlier process began it, and no operator has armed or disarmed since."""
        self.standing: tuple[tuple[Severity, str], ...] = ()
        """What a station that comes late should hear too: that a restart has left the vessel to drift."""
        self._began_us: int | None = None
        self._tell_us = 0
        """When this process first looked, and when it says so again."""
        self._seen: LatLon | None = None
        """Where the vessel was last known to be."""
        self._kept: LatLon | None = None
        """The same to half a kilometre, which must outlive the process."""

    def passes(self, here: LatLon | None) -> None:
        """The vessel is here; None = nobody knows."""
        self._seen = here or self._seen
        if here is not None and (self._kept is None or at_most_m(*self._kept, *here) > _SEEN_EVERY_M):
            self._kept = here

    def hears_time(self, now_us: int, utc_us: int | None) -> None:
        """The receiver's clock tells when an operator left the voyage, in this process and in the next."""
        if self._left_us is None:
            return
        self._left_us = min(self._left_us, now_us)
        if utc_us is None or self._is_dated:
            return
        if self._left_utc_us is None:
            self._left_utc_us = utc_us - (now_us - self._left_us)
        self._left_us, self._is_dated = now_us - max(utc_us - self._left_utc_us, 0), True

    def tells_adrift(self, now_us: int) -> bool:
        """Whether ``ADRIFT`` is to be said now."""
        self._began_us = now_us if self._began_us is None else self._began_us
        is_looked_at = self._seen is not None or now_us - self._began_us >= _PLACE_US
        is_adrift = self.is_from_before and self._broken and is_looked_at and not self._is_landed(self._seen)
        self.standing = (ADRIFT,) if is_adrift else ()
        if not is_adrift or now_us < self._tell_us:
            return False
        self._tell_us = now_us + _AGAIN_US
        return True

    def has_begun(self, now_us: int) -> bool:
        """Whether the vessel is on its way, so that arming it is no departure."""
        return self._begun and (self._left_us is None or now_us - self._left_us < OPEN_US) and not self._was_carried

    def keeps_home(self, now_us: int, here: LatLon | None, home: LatLon | None) -> bool:
        """Whether arming must not make home of the place where the vessel happens to be."""
        self.passes(here)
        if self._broken:
            return True
        return self.has_begun(now_us) and here is not None and home is not None and inverse(*home, *here)[0] > LANDED_M

    @property
    def lasting(self) -> tuple[LatLon | None, LatLon | None] | None:
        """What must outlive the process of a voyage that is not over: where it began, and was last seen. None: there is none."""
        return (self.place, self._kept) if self._begun else None

    @property
    def left(self) -> Left | None:
        """Where and when an operator left it; None = he did not."""
        return None if self._left_us is None else (self._left_at, self._left_utc_us)

    def armed(self, now_us: int, here: LatLon | None) -> None:
        self.passes(here)
        if not self.has_begun(now_us):
            self.place = here
        self._begun, self._broken, self.is_from_before = True, False, False
        self._leave(None, None)
        self.has_sailed = True

    def disarmed(self, now_us: int, here: LatLon | None, *, by_operator: bool) -> None:
        self.passes(here)
        is_landed, was_left = self._is_landed(here), self._left_us is not None
        if not by_operator and was_left:
            return
        self._broken = self._begun and not by_operator and not is_landed
        self._begun = self._begun and not (by_operator and is_landed)
        self.is_from_before = self.is_from_before and not by_operator
        is_left = self._begun and not self._broken
        self._leave(now_us if is_left else None, self._seen if is_left else None)

    def resume(self, place: LatLon | None, seen: LatLon | None, left: Left | None = None) -> None:
        """The process before this one ended under way, or (``left``) after an operator had left the voyage; ``seen``: where she was."""
        self._kept = seen
        self.place, self._begun, self._broken = place, True, left is None
        self.has_sailed = self.is_from_before = True
        if left is not None:
            self._leave(_NOT_YET, left[0], left[1])

    def _leave(self, left_us: int | None, at: LatLon | None, utc_us: int | None = None) -> None:
        self._left_us, self._left_at, self._left_utc_us, self._is_dated = left_us, at, utc_us, False

    def carried_m(self, here: LatLon, home: LatLon) -> float:
        """How far the vessel is from the voyage that was resumed, where she came no such way by herself; else 0."""
        away_m = min(inverse(*place, *here)[0] for place in (home, self._kept) if place is not None)
        return away_m if self.is_from_before and away_m > RESUMED_M else 0.0

    def _is_landed(self, here: LatLon | None) -> bool:
        """Whether the vessel has come back. One whose position is lost may be anywhere."""
        return here is not None and self.place is not None and inverse(*self.place, *here)[0] <= LANDED_M

    @property
    def _was_carried(self) -> bool:
        """Whether the vessel is farther from where an operator disarmed it than it comes by itself."""
        left, seen = self._left_at, self._seen
        return left is not None and seen is not None and at_most_m(*left, *seen) > RESUMED_M
