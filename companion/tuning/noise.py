"""What the residuals of a fit scatter by: their spread, how each goes on from row to row, and what a window may say of turning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

Array = Any

DRIFT_CHANGES: Final = 0.08
"""m/s from one window to the next, until the record has told how steady its current is."""
_FLOOR: Final = (0.02, 0.02, 0.008)
"""Least spread of surge, sway (m/s), yaw rate (rad/s) that is believed."""
_RHYTHM: Final = 8
"""Rows that the waves' rhythm is told by: 1.6 s, half a period of what moves a small boat most."""
_FRESH: Final = (0.01, 0.01, 1e-3)
"""Share of the power of surge, sway and yaw rate that is taken to be new in each row, at least: what a velocity is off by for long is the
very thing that tells of drag and thrust, and may not be taken out as rhythm altogether."""
_SELDOM: Final = 0.1
"""A receiver of which more rows hear nothing has no rhythm."""
_DOUBT: Final = 9.0
"""A window in which the helm turns the bow three times as far as the sea does is half believed."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Of the residuals at the rows: spread of each output, and how each goes on from row to row.

    Waves turn a hull to and fro, and whoever steers answers them: a fit that took that for white noise would learn the
    helmsman's answer for the hull's. With the waves' own rhythm taken out of the residuals it does not (Ljung, System
    Identification, prediction error in closed loop). Velocities of a receiver that tells once a second are wrong for a second.
    """

    spread: Array
    """Of what is left of each output without its rhythm."""
    rhythm: Array
    """(3, rows before): coefficients of the autoregression, from the row before on; none: white."""
    first: Array
    """Share of the spread in that of the whole, which the first rows have, because nothing is known before them."""
    told: Array | None = None
    """(windows): how much of what a window says of turning is believed; None: all. Where the helm only answers waves and gusts, what
    it does follows from what the bow has done, and a fit learns the helmsman (closed loop): least is told there, and most is wrong."""
    drift: float = DRIFT_CHANGES
    """How far the current goes from one window to the next, m/s (one standard deviation)."""

    @staticmethod
    def white(surge: float, sway: float, rate: float) -> Noise:
        """Without a rhythm; spreads in m/s and rad/s."""
        return Noise(np.array([surge, sway, rate]), np.zeros((3, 0)), np.ones(3))

    def whiten(self, off: Array) -> Array:
        """Residuals (rows, 3, ...) in spreads, without what follows from the rows before; NaN stays where nothing was heard."""
        more = [1] * (off.ndim - 2)
        whole = off / self.spread.reshape(1, 3, *more)
        clear, before = whole.copy(), np.nan_to_num(whole)
        for back in range(1, self.rhythm.shape[1] + 1):
            clear[back:] -= self.rhythm[:, back - 1].reshape(1, 3, *more) * before[:-back]
        clear[: self.rhythm.shape[1]] = (whole * self.first.reshape(1, 3, *more))[: self.rhythm.shape[1]]
        if self.told is not None:
            clear[:, 2] *= self.told
        return clear

    @staticmethod
    def of(off: Array, measured: Array) -> Noise:
        """What residuals (rows, 3, windows) show: spreads from their medians, the rhythm by Yule and Walker."""
        spread = np.maximum(np.nanmedian(np.abs(off), axis=(0, 2)) * 1.4826, _FLOOR)
        rhythm = np.stack([_rhythm(np.clip(off[:, k] / spread[k], -4.0, 4.0), _FRESH[k]) for k in range(3)])
        rest = Noise(spread, rhythm, np.ones(3)).whiten(off)[_RHYTHM:]
        share = np.clip(np.nanmedian(np.abs(rest), axis=(0, 2)) * 1.4826, 0.15, 1.0)
        own = np.maximum(spread * share, 0.3 * np.array(_FLOOR))
        # the filter works on values in spreads, so it is the same in either
        return Noise(own, rhythm, own / spread, _told(off[:, 2], measured[:, 2]))


def _told(off: Array, measured: Array) -> Array:
    """Share of what each window says of turning, (rows, windows), that is the helm's doing and not the sea's."""
    helms, seas = (off + measured).var(axis=0), np.mean(off * off, axis=0)
    return helms / (helms + _DOUBT * seas)


def _rhythm(values: Array, fresh: float) -> Array:
    """Autoregression of values (rows, windows), of which this share of the power is new in each row.

    None of a receiver that is slower than the rows: what it is off by is new in each fix.
    """
    from scipy.linalg import solve_toeplitz

    if np.isnan(values).mean() > _SELDOM:
        return np.zeros(_RHYTHM)
    values = np.nan_to_num(values)
    values = values - values.mean(axis=0)
    count = len(values)
    like = np.array([np.sum(values[: count - k] * values[k:]) / values.size for k in range(_RHYTHM + 1)])
    return np.asarray(solve_toeplitz(like[:-1] + fresh * like[0] * (np.arange(_RHYTHM) == 0), like[1:]))
