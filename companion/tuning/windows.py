"""Voyages cut into windows of one length, side by side, and whether they can tell anything at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from .hull_arrays import STEP_S, Commands
from .voyages import Stretch

Array = Any

WINDOW_S: Final = 16.0
"""Long enough for a hull of seconds to show its damping, short enough that a wrong start does not run away with it."""
_LEAST_WINDOWS: Final = 6


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
