"""Voyages cut into windows of one length, side by side, and how a boat's motion comes into them: late, smoothed, only when it is told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from .hull_arrays import STEP_S, Commands
from .voyages import SMOOTH_STEPS, Stretch

Array = Any

WINDOW_S: Final = 16.0
"""Long enough for a hull of seconds to show its damping, short enough that a wrong start does not run away with it."""
_LEAST_WINDOWS: Final = 6
MOST_WINDOWS: Final = 450
"""Two hours. Intervals are no narrower for more: the model's own shape is the rest; and a day of record would be fitted for hours."""
EVERY: Final = 4
"""Residuals are taken every so many steps, at 5 Hz: closer ones say the same again."""
_BEGINS: Final = 6
"""Steps whose mean is what a window begins with: 0.3 s, less than any hull's own time."""


@dataclass(frozen=True, slots=True)
class Windows:
    """Stretches of one length, side by side: commands (steps, windows), measured (steps, 3, windows), NaN where nothing came."""

    commands: Commands
    measured: Array
    starts: Array
    follows: Array
    """Whether each goes on where the one before it ended."""
    voyage: Array
    smoothed: Array
    """Whether its velocities come from places."""
    age_s: Array
    """(steps, windows): how old each measured velocity is; NaN where none came."""
    by_fix: Array
    """Whether its velocities are fixes, as the receiver told them."""

    @property
    def count(self) -> int:
        return int(self.measured.shape[2])

    def links(self) -> tuple[Array, Array]:
        """Numbers of the windows that have one before them in their voyage, and how many window lengths ago that began."""
        ago = np.diff(self.starts) / WINDOW_S
        linked = np.flatnonzero((np.diff(self.voyage) == 0) & (ago > 0.0))
        return linked + 1, ago[linked]

    def only(self, keep: Array) -> Windows:
        c = self.commands
        cut = Commands(c.port[:, keep], c.starboard[:, keep], c.rudder_rad[:, keep], c.psi_rad[:, keep])
        follows = self.follows[keep].copy()
        follows[1:] &= np.diff(np.flatnonzero(keep)) == 1
        if len(follows):
            follows[0] = False
        return Windows(
            cut,
            self.measured[:, :, keep],
            self.starts[keep],
            follows,
            voyage=self.voyage[keep],
            smoothed=self.smoothed[keep],
            age_s=self.age_s[:, keep],
            by_fix=self.by_fix[keep],
        )


def cut(stretches: Sequence[Stretch]) -> Windows:
    """Cut stretches into windows. Raises ValueError when there are too few."""
    steps = round(WINDOW_S / STEP_S)
    columns: list[tuple[Array, ...]] = []
    starts, follows, voyage, smoothed, by_fix = [], [], [], [], []
    sources = list(dict.fromkeys(stretch.source for stretch in stretches))
    for stretch in stretches:
        names = ("port", "starboard", "rudder_rad", "psi_rad", "surge", "sway", "rate")
        age = np.zeros(len(stretch.port)) if stretch.age_s is None else stretch.age_s
        whole = [*(getattr(stretch, name) for name in names), age]
        for k in range(len(stretch.port) // steps):
            columns.append(tuple(value[k * steps : (k + 1) * steps] for value in whole))
            starts.append(stretch.start_s + k * WINDOW_S)
            follows.append(k > 0)
            voyage.append(sources.index(stretch.source))
            smoothed.append(stretch.from_places)
            by_fix.append(stretch.age_s is not None)
    if len(columns) < _LEAST_WINDOWS:
        raise ValueError(
            f"only {len(columns) * WINDOW_S:.0f} s of unbroken record; a fit needs {_LEAST_WINDOWS * WINDOW_S:.0f} s"
        )
    port, starboard, rudder, psi, surge, sway, rate, age = (
        np.stack(part, axis=1) for part in zip(*columns, strict=True)
    )
    measured = np.stack([surge, sway, rate], axis=1)
    commands = Commands(port, starboard, rudder, psi)
    return Windows(
        commands,
        measured,
        np.array(starts),
        np.array(follows),
        voyage=np.array(voyage),
        smoothed=np.array(smoothed),
        age_s=age,
        by_fix=np.array(by_fix),
    )


def thinned(windows: Windows) -> Windows:
    """At most ``MOST_WINDOWS``, evenly over all voyages: whoever picked the lively ones would pick the gusts."""
    if windows.count <= MOST_WINDOWS:
        return windows
    keep = np.zeros(windows.count, dtype=bool)
    keep[np.linspace(0, windows.count - 1, MOST_WINDOWS).round().astype(int)] = True
    return windows.only(keep)


def too_poor(windows: Windows) -> None:
    """Raise ValueError, in words, when the voyages cannot tell anything."""
    commands = windows.commands
    both = 0.5 * (commands.port + commands.starboard)
    lacks = []
    if np.percentile(both, 95) - np.percentile(both, 5) < 0.2:
        lacks.append("the throttle hardly changes: sail at several speeds")
    if np.nanpercentile(np.abs(windows.measured[:, 0]), 95) < 0.3:
        lacks.append("the boat hardly moves")
    turning = np.percentile(np.abs(windows.measured[:, 2]), 95)
    if turning < 0.05:
        lacks.append("the boat hardly turns: sail zig-zags and circles")
    if lacks:
        raise ValueError("; ".join(lacks))


def smoothed(motion: Array, smooth_s: Array) -> Array:
    """Motion (steps, ...) through a filter of first order along the hull, with which an estimator turns what it believes.

    Its share falls evenly from none on (backward Euler): the exact one does not move at all for less than half a step, and a fit sees
    no slope there.
    """
    found = np.empty_like(motion)
    share = STEP_S / (STEP_S + smooth_s)
    found[0] = motion[0]
    for k in range(1, len(motion)):
        found[k] = found[k - 1] + (motion[k] - found[k - 1]) * share
    return found


def late(out: Array, late_s: Array, rows: Array) -> Array:
    """Values (steps, 3, boats, windows) at the rows (rows, 1 or windows), which may lie between steps, so many seconds (boats, 1) ago.

    Between two steps they go along a cubic (Catmull and Rom): a straight line bends at each step, and a fit stops at the bend.
    """
    back = np.clip(late_s[:, 0] / STEP_S, -(SMOOTH_STEPS // 2), 1.0 / STEP_S - 1.0)
    where = np.clip(rows[:, None] - back[None, :, None], 1.0, out.shape[0] - 2.001)
    lower = where.astype(int)
    p = (where - lower)[..., None]
    weights = (
        ((2.0 - p) * p - 1.0) * p / 2.0,
        ((3.0 * p - 5.0) * p * p + 2.0) / 2.0,
        ((4.0 - 3.0 * p) * p + 1.0) * p / 2.0,
        (p - 1.0) * p * p / 2.0,
    )
    # the parts last, so that each boat and window picks its own rows
    turned, boats, windows = np.moveaxis(out, 1, 3), np.arange(out.shape[2])[:, None], np.arange(out.shape[3])
    found = sum(weight * turned[lower + k, boats, windows] for k, weight in zip((-1, 0, 1, 2), weights, strict=True))
    return np.moveaxis(found, 3, 1)


@dataclass(frozen=True, slots=True)
class HeardRows:
    """What was measured at the rows: the newest of the steps since the row before."""

    at: Array
    """(rows, windows): the moments, in steps, at which velocities were valid; the row's own where none came."""
    measured: Array
    """(rows, 3, windows), NaN where nothing came."""
    bow: tuple[Array, Array]
    """Cosine and sine of the heading at those moments, as recorded."""

    @staticmethod
    def of(windows: Windows, rows: Array) -> HeardRows:
        measured, at = windows.measured[rows], np.repeat(rows[:, None], windows.count, axis=1).astype(float)
        came = np.zeros(at.shape, dtype=bool)
        for back in range(EVERY):
            new = np.isfinite(windows.age_s[rows - back]) & ~came
            here = windows.measured[rows - back, :2]
            measured[:, :2] = np.where(new[:, None], here, measured[:, :2])
            at = np.where(new, rows[:, None] - back - windows.age_s[rows - back] / STEP_S, at)
            came |= new
        low = at.astype(int)
        columns = np.arange(windows.count)
        psi = windows.commands.psi_rad
        part = at - low
        bow = psi[low, columns] * (1.0 - part) + psi[np.minimum(low + 1, len(psi) - 1), columns] * part
        return HeardRows(at, measured, (np.cos(bow), np.sin(bow)))


def first_heard(measured: Array) -> Array:
    """About what a window (steps, windows) begins with: the mean of what came within its first 0.3 s, or the first."""
    first = np.argmax(np.isfinite(measured), axis=0)
    begins = np.where(np.arange(len(measured))[:, None] < np.maximum(first + 1, _BEGINS), measured, math.nan)
    heard = np.isfinite(begins)
    return np.where(heard, begins, 0.0).sum(axis=0) / np.maximum(heard.sum(axis=0), 1)
