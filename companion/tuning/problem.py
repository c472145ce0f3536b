"""The fit as a problem of least squares: residuals of all windows, and their slopes by every unknown, sparse.

Common to all windows are hull, propellers, rudders, wind and the sensors' delays; each has a start and a drift of its own, which
changes slowly from one to the next. Unknowns are counted in widths of their priors, residuals in their spreads.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from .hull_arrays import STEP_S, WIND_MOMENTS, Drawn, HullArrays, coefficients
from .noise import Noise
from .unknowns import FitUnknown
from .voyages import SMOOTH_STEPS
from .windows import EVERY, HeardRows, Windows, first_heard, late, smoothed

Array = Any

_SETTLED_S: Final = 1.0
"""Of each stretch the first second only feeds the delays."""
NUISANCES: Final = 8
_BOW_SD: Final = math.radians(2.0)
"""A compass is off by so much, otherwise in each window: what that makes of the way ahead is no current."""
_START_SD: Final = (0.25, 0.25, 0.1)
DRIFT_SD: Final = 1.0
_GUST_SD: Final = 0.6
"""m/s: a gust of a fresh breeze, in the mean of a window. At low throttle it gives a hull more or less way than any drift may."""
_NUDGE: Final = 1e-3
TOGETHER: Final = {
    "thrust": ("ahead", "astern"),
    "drag": ("xu", "xuu"),
    "turning": ("nr", "nrr", "nur"),
    "yaw": ("m33", "nr", "nrr", "nur"),
}
"""Unknowns that stand for a share of several coefficients at once."""
SENSED: Final = (
    *("velocity_late", "velocity_smooth", "place_late", "place_smooth"),
    *("heading_late", "heading_offset", "bow_late", "sensor_forward"),
)

RATE_FILTER_S: Final = 0.05
"""The vessel's own record tells the rate of turn so much later than the heading that it comes with: half a period of 10 Hz."""


class Problem:
    """Residuals and their slopes of one set of windows."""

    def __init__(
        self,
        vessel: VesselConfig,
        windows: Windows,
        unknowns: list[FitUnknown],
        noise: Noise,
        *,
        drawn_per_s: float = 0.0,
    ) -> None:
        """``drawn_per_s``: by how much the yaw rate is drawn to what is heard; 0: every window is foretold from its start alone."""
        self.vessel, self.windows, self.unknowns, self.noise = vessel, windows, unknowns, noise
        self._drawn = Drawn(windows.measured[:, 2], drawn_per_s) if drawn_per_s else None
        self._hull, self._base = HullArrays(vessel), coefficients(vessel)
        self._of_hull = {*self._base, *WIND_MOMENTS}
        count, steps = windows.count, windows.measured.shape[0]
        self.rows = np.arange(round(_SETTLED_S / STEP_S), steps - SMOOTH_STEPS // 2, EVERY)
        self._first = np.stack([first_heard(windows.measured[:, k]) for k in range(3)])
        self._heard = HeardRows.of(windows, self.rows)
        self.measured = self._heard.measured
        """(rows, 3, windows), NaN where nothing was heard."""
        self._came = np.isfinite(self.measured)
        self._own = bool((windows.smoothed | windows.by_fix).all())
        self._cosine = np.cos(windows.commands.psi_rad)
        self._sine = np.sin(windows.commands.psi_rad)
        self.size = len(unknowns) + NUISANCES * count
        self._around: tuple[Array, Array] | None = None

    def under(self, noise: Noise) -> Problem:
        """The same with another noise."""
        drawn_per_s = self._drawn.per_s if self._drawn else 0.0
        return Problem(self.vessel, self.windows, self.unknowns, noise, drawn_per_s=drawn_per_s)

    def modelled(self, theta: Array, nuisance: Array) -> Array:
        """Sail; theta (boats, unknowns), nuisance (boats, 8, windows); return (rows, 3, boats, windows)."""
        c, extra = self._boats(theta)
        drift = np.stack([nuisance[:, 3] * DRIFT_SD, nuisance[:, 4] * DRIFT_SD])
        cosine, sine = self._cosine[0], self._sine[0]
        along, across = drift[0] * cosine + drift[1] * sine, drift[1] * cosine - drift[0] * sine
        start = np.stack([self._first[k] + nuisance[:, k] * _START_SD[k] for k in range(3)])
        start[0] -= along
        start[1] -= across + extra["sensor_forward"] * start[2]
        north, east = (mean + _GUST_SD * nuisance[:, 6 + k] for k, mean in enumerate(self._wind(extra)))
        out = self._hull.sail(c, self.windows.commands, start, (north, east), drift, drawn=self._drawn)
        sensed = out[:, :2].copy()
        sensed[:, 1] += extra["sensor_forward"] * out[:, 2]
        motion = self._as_recorded(sensed, extra)
        rate = late(out[:, 2:], extra["heading_late"], self.rows[:, None])
        cosine, sine = (part[:, None, :] for part in self._heard.bow)
        # a bow that is told late makes sway of surge in every turn; in a record of our own one compass tells heading and rate
        late_s = extra["heading_late"] - RATE_FILTER_S + extra["bow_late"] if self._own else extra["bow_late"]
        # what the bow has turned in that time, by the rate in its middle
        turned = late_s * late(out[:, 2:], 0.5 * late_s, self._heard.at)[:, 0]
        twist = extra["heading_offset"] + nuisance[:, 5] * _BOW_SD - turned
        surge, sway = motion[:, 0], motion[:, 1]
        # the drift is over ground: a record turns it by its own heading, whatever that is off by
        surge, sway = surge * np.cos(twist) + sway * np.sin(twist), sway * np.cos(twist) - surge * np.sin(twist)
        along, across = drift[0] * cosine + drift[1] * sine, drift[1] * cosine - drift[0] * sine
        return np.stack([surge + along, sway + across, rate[:, 0]], axis=1)

    def _boats(self, theta: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        c = {name: np.full((1, 1), value) for name, value in self._base.items()}
        extra = {name: np.zeros((1, 1)) for name in SENSED}
        shares: dict[str, Array] = {}
        for k, unknown in enumerate(self.unknowns):
            value = unknown.value(theta[:, k])[:, None]
            if unknown.name in TOGETHER:
                shares[unknown.name] = value
            else:
                (c if unknown.name in self._of_hull else extra)[unknown.name] = value
        for together, share in shares.items():
            for name in TOGETHER[together]:
                c[name] = c[name] * share
        return c, extra

    def _wind(self, extra: dict[str, Array]) -> tuple[Array, Array]:
        zero = np.zeros((1, 1))
        parts = []
        for way in ("north", "east"):
            named = [extra.get(f"wind_{way}_{k}", zero) for k in range(int(self.windows.voyage.max()) + 1)]
            parts.append(np.concatenate([named[k] + 0.0 * named[0] for k in self.windows.voyage], axis=1))
        return parts[0], parts[1]

    def _as_recorded(self, motion: Array, extra: dict[str, Array]) -> Array:
        """Surge and sway at the rows: as a receiver tells them, or an estimator, filtered or taken from places that it tells."""
        by_fix, at = self.windows.by_fix, self._heard.at
        told = motion if by_fix.all() else np.where(by_fix, motion, smoothed(motion, extra["velocity_smooth"]))
        found = late(told, extra["velocity_late"], at)
        if self.windows.smoothed.any():
            placed = late(self._from_places(smoothed(motion, extra["place_smooth"]))[:, None], extra["place_late"], at)
            found[:, 1] = np.where(self.windows.smoothed, placed[:, 0], found[:, 1])
        return found

    def _from_places(self, motion: Array) -> Array:
        """Sway as it is taken from places: smoothed north and east, then turned.

        Smoothed along the hull it would miss what a bow that begins to turn adds.
        """
        from scipy.ndimage import convolve1d

        half = SMOOTH_STEPS // 2 + 1
        weights = 1.0 - (np.arange(-half, half + 1) / half) ** 2
        cosine, sine = self._cosine[:, None, :], self._sine[:, None, :]
        north = cosine * motion[:, 0] - sine * motion[:, 1]
        east = sine * motion[:, 0] + cosine * motion[:, 1]
        north, east = (convolve1d(way, weights / weights.sum(), axis=0, mode="nearest") for way in (north, east))
        return cosine * east - sine * north

    def split(self, x: Array) -> tuple[Array, Array]:
        count = len(self.unknowns)
        return x[:count], x[count:].reshape(NUISANCES, self.windows.count)

    def off(self, x: Array) -> Array:
        """Modelled less measured, (rows, 3, windows); NaN where nothing was heard."""
        return self._sailed_around(x)[:, :, 0, :] - self.measured

    def residuals(self, x: Array) -> Array:
        theta, nuisance = self.split(x)
        off = np.nan_to_num(self.noise.whiten(self.off(x)))
        return np.concatenate([off.ravel(), self._beliefs(theta, nuisance)])

    def _beliefs(self, theta: Array, nuisance: Array) -> Array:
        follows, ago = self.windows.links()
        change = (nuisance[3:5, follows] - nuisance[3:5, follows - 1]) * (DRIFT_SD / (self.noise.drift * np.sqrt(ago)))
        return np.concatenate([theta, nuisance.ravel(), change.ravel()])

    def slopes(self, x: Array) -> Any:
        """Sparse Jacobian by differences: every unknown once, every nuisance in all windows at once."""
        from scipy.sparse import csr_matrix, vstack

        common, own = self.differences(x)
        rows, count = common.shape[0], len(self.unknowns)
        windows = self.windows.count
        across = np.arange(windows)
        # columns of one residual row: all unknowns, then this window's own
        columns = np.concatenate(
            [np.broadcast_to(np.arange(count)[None], (windows, count)),
             count + across[:, None] + windows * np.arange(NUISANCES)[None]], axis=1
        )  # fmt: skip
        data = np.concatenate([common, own], axis=-1)
        indices = np.broadcast_to(columns[None, None], (rows, 3, windows, count + NUISANCES))
        width = count + NUISANCES
        pointer = np.arange(0, rows * 3 * windows + 1) * width
        main = csr_matrix((data.ravel(), indices.ravel(), pointer), shape=(rows * 3 * windows, self.size))
        return vstack([main, self._belief_slopes()]).tocsr()

    def differences(self, x: Array) -> tuple[Array, Array]:
        """(rows, 3, windows, unknowns) and (rows, 3, windows, 8)."""
        found, count = self._sailed_around(x), len(self.unknowns)
        slope = self.noise.whiten((found[:, :, 1:] - found[:, :, :1]) / _NUDGE) * self._came[:, :, None]
        slope = np.moveaxis(slope, 2, 3)
        return slope[..., :count], slope[..., count:]

    def _sailed_around(self, x: Array) -> Array:
        """The boat at a point and one for each nudge, (rows, 3, boats, windows).

        Forty boats take little longer to sail than one, and who asks what is off at a point mostly asks for its slopes next: the last
        point is kept.
        """
        if self._around is not None and np.array_equal(self._around[0], x):
            return self._around[1]
        theta, nuisance = self.split(x)
        count = len(self.unknowns)
        boats = 1 + count + NUISANCES
        thetas, nuisances = np.tile(theta, (boats, 1)), np.tile(nuisance, (boats, 1, 1))
        for k in range(count):
            thetas[1 + k, k] += _NUDGE
        for k in range(NUISANCES):
            nuisances[1 + count + k, k] += _NUDGE
        self._around = x.copy(), self.modelled(thetas, nuisances)
        return self._around[1]

    def _belief_slopes(self) -> Any:
        from scipy.sparse import csr_matrix, eye, vstack

        follows, ago = self.windows.links()
        windows, count = self.windows.count, len(self.unknowns)
        size = DRIFT_SD / (self.noise.drift * np.sqrt(ago))
        rows, columns, data = [], [], []
        for part in range(2):
            base = count + (3 + part) * windows
            row = part * len(follows) + np.arange(len(follows))
            rows += [row, row]
            columns += [base + follows, base + follows - 1]
            data += [size, -size]
        change = csr_matrix(
            (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))), shape=(2 * len(follows), self.size)
        )
        return vstack([eye(self.size, format="csr"), change])
