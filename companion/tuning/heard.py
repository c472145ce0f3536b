"""How a boat's motion comes into a record: late, smoothed, and only when a receiver tells something."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from .hull_arrays import STEP_S
from .voyages import SMOOTH_STEPS
from .windows import Windows

Array = Any

EVERY: Final = 4
"""Residuals are taken every so many steps, at 5 Hz: closer ones say the same again."""
_BEGINS: Final = 6
"""Steps whose mean is what a window begins with: 0.3 s, less than any hull's own time."""


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
