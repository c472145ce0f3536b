"""A fit of several runs, told run by run: one that was sailed by another boat is explained worse than all others together hide."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, Protocol

import numpy as np

Array = Any

_MOTIONS: Final = ("surge", "sway", "yaw rate")
_LEAST_ERROR: Final = 0.15
"""RMS over standard deviation. Single runs of sound boats in calm water are left by less."""
_MUCH_WORSE: Final = 2.0
"""Times the error of the best explained other run: runs of one boat in 3 and in 6 m/s of wind differ by less."""


class FitOfRuns(Protocol):
    """What of a fit is needed."""

    @property
    def samples(self) -> dict[str, Any]: ...
    @property
    def sources(self) -> tuple[str, ...]: ...


def by_run(fit: FitOfRuns) -> Iterator[str]:
    """Say each run's errors on what was kept apart, and which run is explained much worse than another; nothing of a single one."""
    errors = {name: _errors(fit, k) for k, name in enumerate(fit.sources) if (fit.samples["voyage"] == k).any()}
    if len(errors) < 2:
        return
    for name, found in errors.items():
        told = ", ".join(f"{motion} {error:.2f}" for motion, error in zip(_MOTIONS, found, strict=True))
        yield f"  {name}: {told}"
    for name, found in errors.items():
        others = [min(other[k] for each, other in errors.items() if each != name) for k in range(3)]
        # sway is the smallest motion, and hangs on the sea
        if worse := [k for k in (0, 2) if found[k] > max(_LEAST_ERROR, _MUCH_WORSE * others[k])]:
            what = " and ".join(_MOTIONS[k] for k in worse)
            yield f"take care: {name} is explained much worse ({what}): is it another boat's? then leave it out; a rougher day looks alike"


def _errors(fit: FitOfRuns, voyage: int) -> tuple[float, float, float]:
    """RMS over standard deviation of the windows of one run."""
    own = fit.samples["voyage"] == voyage
    measured, off = (fit.samples[name][..., own] for name in ("measured", "modelled"))
    off = off - measured
    surge, sway, yaw = (
        float(np.sqrt(np.nanmean(off[:, k] ** 2)) / max(float(np.nanstd(measured[:, k])), 1e-6)) for k in range(3)
    )
    return surge, sway, yaw
