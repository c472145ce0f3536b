"""What pushes a boat ahead, as long after the order as a hull takes to follow."""

from __future__ import annotations

from typing import Any, Final

from ..hull_arrays import STEP_S
from ..voyages import Stretch

Array = Any

_PUSHED_S: Final = 3.0
"""A hull takes on way in about so long after its propellers: more or less changes the correlation little."""


def smooth(value: Array, time_s: float) -> Array:
    """A filter of first order, which begins with the first value."""
    from scipy.signal import lfilter

    share = STEP_S / (STEP_S + time_s)
    return lfilter([share], [1.0, share - 1.0], value, zi=[(1.0 - share) * value[0]])[0]


def pushing(stretch: Stretch) -> Array:
    """The mean of the throttles, smoothed so."""
    return smooth(0.5 * (stretch.port + stretch.starboard), _PUSHED_S)
