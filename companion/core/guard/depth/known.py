"""What is known of the bottom here beside the reading itself: how it was closing, and what chart or memory say of the place.

A reading is held against this where it cannot be judged alone: a sounder that repeats itself, a jump to much deeper water.
"""

from __future__ import annotations

from typing import Final, Protocol

from mavlink_bridge.language.messages import EstimatedState

_SHARE: Final = 1.6
"""Times the depth: a second echo lies at twice as much at least, a chart and a step between two readings seldom at more than half."""
_LEAST_M: Final = 1.0
"""Less is a ditch or heave, and costs no boat her keel."""


class KnownBottom(Protocol):
    """Who knows."""

    def slope(self, t_us: int) -> float:
        """By how much the bottom rose for each metre sailed, as far as that was proven lately; 0 = it did not rise."""
        ...

    def known_altitude_m(self, state: EstimatedState | None) -> float | None:
        """Altitude here by chart or memory, the lesser; None = neither knows the place."""
        ...


class Unknown:
    """Nobody knows."""

    def slope(self, t_us: int) -> float:
        return 0.0

    def known_altitude_m(self, state: EstimatedState | None) -> float | None:
        return None


def is_much_deeper(distance_m: float, than_m: float) -> bool:
    """Whether a distance below the transducer is so much more than another that no bottom goes down like this unseen."""
    return distance_m > _SHARE * than_m and distance_m - than_m > _LEAST_M
