"""Where a hull comes to rest under steady forces: sway and yaw stepped through time, on any hull that damps at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

_HALVINGS: Final = 6
"""The shortest step is a sixty-fourth of the one asked for: a hull that damps quicker is none that floats."""
_STILL: Final = 0.01
"""m/s² or rad/s²: a turn that is all but steady swings through nothing, and that runs nowhere."""

Accelerations = Callable[[float, float], tuple[float, float]]
"""From sway and yaw rate to their changes, per second."""


def settled(accelerations: Accelerations, step_s: float, steps: int) -> tuple[float, float]:
    """Return sway and yaw rate after so many of Euler's steps from rest.

    A step after which an acceleration has turned round and grown was longer than the damping bears (it would run away): it is
    taken again by halves, and so are those that follow.
    """
    v = r = 0.0
    dv, dr = accelerations(v, r)
    halvings = 0
    while steps > 0:
        next_v, next_r = v + dv * step_s, r + dr * step_s
        next_dv, next_dr = accelerations(next_v, next_r)
        if halvings < _HALVINGS and (_runs_away(dv, next_dv) or _runs_away(dr, next_dr)):
            step_s, steps, halvings = 0.5 * step_s, 2 * steps, halvings + 1
            continue
        v, r, dv, dr = next_v, next_r, next_dv, next_dr
        steps -= 1
    return v, r


def _runs_away(before: float, after: float) -> bool:
    return before * after < 0.0 and abs(after) > abs(before) > _STILL
