"""Several records together: a run that another boat sailed is explained worse than all others together hide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Protocol

import numpy as np

Array = Any

_MOTIONS: Final = ("surge", "sway", "yaw rate")
_LEAST_ERROR: Final = 0.15
"""RMS over standard deviation. Single runs of sound boats in calm water are left by less."""
_MUCH_WORSE: Final = 2.0
"""Times the error of the best explained other run: runs of one boat in 3 and in 6 m/s of wind differ by less."""
EXPLAINED: Final = 0.4
"""Error of the yaw rate on stretches kept apart up to which spreads are as scatter tells them: trials of known hulls came to 0.26 at most,
recordings of a real boat to 0.40. A fit to two boats comes beyond it for the one or the other, if not for both."""
_YAW: Final = 2
_OTHER_DAY: Final = 0.08
"""Of four pairs of days of one boat, to 8 m/s of wind, way came to 3 % apart at most; with a battery at 80 % of the thrust, or a third more
mass, to 14 to 19 %."""
_ONE_OF_TWO: Final = "is one of them another boat's? fit each alone; a rougher day looks alike"
"""A fit to two boats lies between them and may lie nearer to the stranger: who of the two is at home the owner knows alone."""
_ONE_OF_MANY: Final = "is it another boat's, or are the others? fit it alone; a rougher day looks alike"


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
    unlike = {name: worse for name, found in errors.items() if (worse := _worse(name, found, errors))}
    for name, worse in unlike.items():
        what = " and ".join(_MOTIONS[k] for k in worse)
        if len(errors) == 2:
            yield f"take care: {' and '.join(errors)} are not explained alike ({what}): {_ONE_OF_TWO}"
            return
        yield f"take care: {name} is explained much worse ({what}): {_ONE_OF_MANY}"
    if not unlike and (text := _pushed_unlike(fit, list(errors))):
        yield text


def _pushed_unlike(fit: FitOfRuns, names: Sequence[str]) -> str:
    """Say that she took on way otherwise in one run than in another; "" where she did not."""
    way = {name: _way(fit, fit.sources.index(name)) for name in names}
    most, least = max(way, key=lambda name: way[name]), min(way, key=lambda name: way[name])
    more = way[most] / max(way[least], 1e-6) - 1.0
    if more < _OTHER_DAY:
        return ""
    said = f"take care: {most} takes on {100.0 * more:.0f} % more way than {least} by the same throttle"
    return f"{said}: another battery, load or boat? the file lies between; fit each alone"


def _way(fit: FitOfRuns, voyage: int) -> float:
    """How many times what the fit foretells she changes her way within a window: what is steady in it is current."""
    own = fit.samples["voyage"] == voyage
    told, foretold = (fit.samples[name][:, 0, own] for name in ("measured", "modelled"))
    heard = np.isfinite(told) & np.isfinite(foretold)
    changes = [np.where(heard, each - np.nanmean(each, axis=0), 0.0) for each in (told, foretold)]
    return float((changes[0] * changes[1]).sum() / max(float((changes[1] ** 2).sum()), 1e-9))


def _worse(name: str, found: Sequence[float], errors: Mapping[str, Sequence[float]]) -> list[int]:
    """Which motions of a run are explained so much worse than another run's that they may be two boats'."""
    others = [min(other[k] for each, other in errors.items() if each != name) for k in range(3)]
    # sway is the smallest motion, and hangs on the sea
    worse = [k for k in (0, 2) if found[k] > max(_LEAST_ERROR, _MUCH_WORSE * others[k])]
    return worse or [k for k in (_YAW,) if found[k] > EXPLAINED >= others[k]]


def _errors(fit: FitOfRuns, voyage: int) -> tuple[float, float, float]:
    """RMS over standard deviation of the windows of one run."""
    own = fit.samples["voyage"] == voyage
    measured, off = (fit.samples[name][..., own] for name in ("measured", "modelled"))
    off = off - measured
    surge, sway, yaw = (
        float(np.sqrt(np.nanmean(off[:, k] ** 2)) / max(float(np.nanstd(measured[:, k])), 1e-6)) for k in range(3)
    )
    return surge, sway, yaw
