"""Output-error fit of the whole three-degree model to recorded voyages: what a boat's file should say, and how well that is known.

Each window of a voyage is sailed by the model from a start and in a drift of its own; what is common is where a
soft loss, which spikes do not pull, comes to rest. What the record does not tell is left as the file has it. Motion alone tells forces per
mass: everything stands in proportion to ``m11_kg``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.hull.statics import Statics
from ..core.steer.yaw_loop import yaw_plant
from .drifting import believed, by_window, drift_change, precision_of
from .hull_arrays import STEP_S
from .noise import Noise
from .problem import SENSED, TOGETHER, Problem
from .settle import Box, settled
from .several import EXPLAINED
from .unknowns import FitUnknown, unknowns_of, with_values
from .voyages import Stretch
from .windows import WINDOW_S, Windows, cut, thinned, too_poor

Array = Any

_KEPT_APART: Final = 5
"""Every fifth stretch is kept apart to judge the fit by."""
_ROUNDS: Final = 3
_MOVED: Final = 2.0
"""A value that the record has moved by more than two widths of its prior is not as the file has it, however loosely it is known."""

_ALWAYS: Final = ("wind_", *SENSED)
"""What belongs to the record and not to the boat is always fitted."""
_ALIKE_WINDOWS: Final = 2
"""Windows of 16 s: wind and current of half a minute ago are still much the same."""
_WIDER: Final = 1.5
_WIDER_BY_FIX: Final = 1.2
"""Of records whose velocities are all fixes as they were told: no filter of an estimator adds to them."""
_UNSURE: Final = {"m22": 0.08, "yv": 0.08, "yvv": 0.08}
_UNSURE_ELSE: Final = 0.015
_UNSURE_S: Final = 0.015
"""Spreads are taken wider by this factor, and never narrower than this share of a coefficient, or of a tick: what the record's own
filters and the model's shape add is in no residual. Sway is the smallest of the three motions and comes through position, heading and
their filters: in trials of known hulls what it tells was off by so much beside the scatter."""

_WIDER_BEYOND: Final = 10.0
"""And by so much wider per error beyond it. Waves that turn a light boat as hard as her helm go on through her own motion, and are no
noise that is added to it: of six such boats the truth lay up to ten spreads off, at errors of 0.46 to 0.62."""
_STEADY_MPS: Final = 0.03
"""By so much, at most, wind and current go their own way from one window to the next in trials of 3 to 6 m/s of wind: 0.01 where a hull is
as the model says, 0.028 of a foreign plant."""
_WIDER_IN_GUSTS: Final = 3.0
"""And beyond it thrust and drag are known so much worse than windows scatter. A gust along the hull gives or takes way as drag does, most
at low way: of foreign boats in 9 m/s of wind (0.04 to 0.06) ways to rest were told up to a fifth too short, and so a tenth to two fifths
too long."""
ALONG: Final = ("xu", "xuu", "ahead", "astern", "speed_loss", "exponent")
"""What puts way on and takes it off."""
_DRAWN_PER_S: Final = 1.0
"""By how much the modelled yaw rate of a hull that turns away by itself is drawn to the one that was heard. A wave turns her through her
own motion, and that turn grows: a fit that foretells whole windows takes her for a steadier one (Ljung, System Identification: a
predictor must be stable). Of a hull that comes back by itself it would only hide what the model lacks: BlueBoat's recordings were
foretold half as badly again."""
_UNDER_WAY, _NEARLY_PER_S = 0.6, -0.1
"""At this share of the top speed, and turning away so slowly or coming back so slowly: hulls of the trials that needed it grew by 0.3 to
2.2 a second in truth, and come out steadier at first; of the others, and of BlueBoat's recordings, the fastest to grow came back by 0.2."""
_SCALE: Final = 0.03
_SCALE_BY_FIX: Final = 0.015
_TO_MASS: Final = ("m22", "m33", "xu", "xuu", "yv", "yvv", "nr", "nrr", "ahead", "astern", "area")
"""All that acts on the boat stands against ``m11_kg``, and what tells how is only how fast way is put on and taken off: through the
receiver's and the estimator's filters, whose shape is known roughly. By so much, together, in trials of known hulls; by half of it where
each fix stands as it was told."""

YAW_WIDTH: Final = 0.7
"""A factor of two either way is nothing unusual,"""
_FAR_OFF: Final = 1.6
"""and what lies beyond is told; nearer, the unknowns find it one by one."""

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Fit:
    """What was found. ``values`` and ``spread`` (one standard deviation, of the value) by the unknown's name."""

    vessel: VesselConfig
    values: dict[str, float]
    spread: dict[str, float]
    known: dict[str, bool]
    unknowns: list[FitUnknown]
    covariance: Array
    """Of the unknowns and then of those that the record does not tell, in widths of their priors."""
    errors: tuple[float, float, float]
    """On what was kept apart, RMS over standard deviation: surge, sway, yaw rate."""
    errors_before: tuple[float, float, float]
    """The same with the file that the fit started from."""
    seconds: float = 0.0
    turning: float = 1.0
    """Share by which all inertia and damping in yaw were set first, against the file's, because they were far off together."""
    wider: float = 1.0
    """How many times as wide as usual all intervals are, because waves turned the boat nearly as hard as her helm."""
    unsteady: float = 1.0
    """How many times as wide as usual thrust and drag are told, because wind or current gave and took way."""
    untold: list[FitUnknown] = field(default_factory=list)
    """What the record cannot tell: left as the file had it."""
    samples: dict[str, Any] = field(default_factory=dict)
    """Of the windows kept apart: time, measured, modelled, for pictures, and the number of the run."""
    sources: tuple[str, ...] = ()
    """The runs, by that number."""


def fit_vessel(vessel: VesselConfig, stretches: Sequence[Stretch], say: Progress = lambda text: None) -> Fit:
    """Fit a vessel to voyages. Raises ValueError, in words, when they are too poor."""
    windows = cut(stretches)
    too_poor(windows)
    windows = thinned(windows)
    apart = np.arange(windows.count) % _KEPT_APART == _KEPT_APART - 1
    noise = Noise.white(0.08, 0.1, 0.03)
    used, given = windows.only(~apart), vessel
    vessel, turning, x = rebased(vessel, used, noise, say)
    unknowns, drawn_per_s = unknowns_of(vessel, used), 0.0
    if x is not None:
        noise = noise_of(Problem(vessel, used, unknowns, noise), x)
    for turn in range(1, _ROUNDS):
        problem = Problem(vessel, used, unknowns, noise, drawn_per_s=drawn_per_s)
        x = solve(problem, np.zeros(problem.size) if x is None else x, turn, say)
        noise = noise_of(problem, x)
        drawn_per_s = _DRAWN_PER_S if _turns_away(problem, x) else 0.0
    assert x is not None
    covariance = covariance_of(Problem(vessel, used, unknowns, noise, drawn_per_s=drawn_per_s), x)
    by_fix = bool(used.by_fix.all())
    deviation = widened(unknowns, np.sqrt(np.diag(covariance)), by_fix=by_fix)
    told = [u.told(deviation[k]) or abs(x[k]) > _MOVED or u.name.startswith(_ALWAYS) for k, u in enumerate(unknowns)]
    untold = [u for u, keep in zip(unknowns, told, strict=True) if not keep]
    unsettled = left_open(problem, x, np.array(told), covariance)
    unknowns = [u for u, keep in zip(unknowns, told, strict=True) if keep]
    problem = Problem(vessel, used, unknowns, noise, drawn_per_s=drawn_per_s)
    x = solve(problem, np.concatenate([x[: len(told)][told], x[len(told) :]]), _ROUNDS, say)
    theta, known = problem.split(x)[0], len(unknowns)
    unsettled[:known, :known] += covariance_of(problem, x)
    covariance = no_wider(unsettled)
    say("judging on the stretches kept apart")
    judged = windows.only(apart)
    after = _judge(vessel, judged, unknowns, noise, theta)
    before = _judge(given, judged, [u for u in unknowns if u.name in SENSED], noise, None)
    wider = 1.0 + _WIDER_BEYOND * max(0.0, after[0][2] - EXPLAINED)
    unsteady = unsteadied(noise.drift)
    share = np.array([wider * (unsteady if u.name in ALONG else 1.0) for u in [*unknowns, *untold]])
    covariance = no_wider(np.outer(share, share) * _to_believe(unknowns, untold, covariance, by_fix))
    found = _told(vessel, unknowns, untold, theta=theta, covariance=covariance, after=after, before=before)
    sources = tuple(dict.fromkeys(stretch.source for stretch in stretches))
    found = replace(found, sources=sources)
    return replace(found, turning=turning, seconds=windows.count * WINDOW_S, wider=wider, unsteady=unsteady)


def unsteadied(drift_mps: float) -> float:
    """How many times wider thrust and drag are told of a record whose wind and current go so far from one window to the next."""
    return _WIDER_IN_GUSTS if drift_mps > _STEADY_MPS else 1.0


def _turns_away(problem: Problem, x: Array) -> bool:
    """Whether the hull that was found turns away by itself under way, or nearly: it is one that is taken for steadier than it is."""
    theta = problem.split(x)[0]
    found = with_values(problem.vessel, {u.name: float(u.value(theta[k])) for k, u in enumerate(problem.unknowns)})
    return yaw_plant(found, _UNDER_WAY * Statics(found).top_mps).grows_per_s > _NEARLY_PER_S


def noise_of(problem: Problem, x: Array) -> Noise:
    """What the record scatters by, and how steady its current is."""
    noise = Noise.of(problem.off(x), problem.measured)
    return replace(noise, drift=drift_change(problem.under(noise), x))


def rebased(
    vessel: VesselConfig, used: Windows, noise: Noise, say: Progress
) -> tuple[VesselConfig, float, Array | None]:
    """Return the vessel to start from, the share by which what resists turning differs from the file's, and what was found with it.

    What a file knows least is what moment the propellers really turn the hull by: they blow on it and on each other, and motion tells
    yaw inertia and damping per moment only. Where that is far off, all of them are, and each by itself would be held back by the file.
    """
    unknowns = unknowns_of(vessel, used)
    yaw = FitUnknown("yaw", 1.0, YAW_WIDTH, True, low=-4.0, high=4.0)
    problem = Problem(vessel, used, [*unknowns, yaw], noise)
    x = solve(problem, np.zeros(problem.size), 0, say)
    share = float(np.exp(YAW_WIDTH * x[len(unknowns)]))
    if 1.0 / _FAR_OFF < share < _FAR_OFF:
        return vessel, 1.0, _without_yaw(unknowns, x)
    hull = {name: share * getattr(vessel.hull, name) for name in ("m33_kgm2", "nr", "nrr", "nur")}
    return vessel.model_copy(update={"hull": vessel.hull.model_copy(update=hull)}), share, None


def _without_yaw(unknowns: list[FitUnknown], x: Array) -> Array:
    """The same boat with the common share put into each."""
    count = len(unknowns)
    for k, u in enumerate(unknowns):
        if u.name in TOGETHER["yaw"] and u.relative:
            x[k] += YAW_WIDTH * x[count] / u.width
    return np.delete(x, count)


def solve(problem: Problem, x: Array, turn: int, say: Progress) -> Array:
    """Settle a problem from ``x`` on, and say how far it is."""
    own = np.full(problem.size - len(problem.unknowns), np.inf)
    low, high = ([getattr(u, side) for u in problem.unknowns] for side in ("low", "high"))
    bounds = Box(np.concatenate([low, -own]), np.concatenate([high, own]))
    return settled(problem, x, bounds, lambda step: say(f"round {turn + 1} of {_ROUNDS + 1}, step {step}"))


def covariance_of(problem: Problem, x: Array) -> Array:
    """Covariance of the unknowns from what the windows say differently: waves and gusts make residuals of one window alike.

    Start, compass and gust of a window are taken out by projection, and the drifts go with each other as the current is steady;
    soft weights stand for the loss (a cluster-robust sandwich). What one window says is held against what all others say without
    it (a jackknife, CR3): a window that a coefficient hangs on has pulled the fit to itself, and its residual tells too little.
    A gust or a stretch of current lasts longer than a window, so neighbours count together (Bartlett's weights, Newey and West).
    """
    says, scores, places = by_window(problem, x)
    count, windows = len(problem.unknowns), problem.windows.count
    inverse = np.linalg.inv(precision_of(problem, says, places))
    clear = _clear_of_itself(says, scores, inverse[places[:, :, None], places[:, None, :]])
    # a window moves the unknowns directly, and by what it says of the current to all others
    without = np.einsum("ikj,kj->ki", inverse[:count][:, places], clear)
    meat = without.T @ without
    for lag in range(1, _ALIKE_WINDOWS):
        pairs = _going_on(problem.windows, lag)
        together = without[pairs].T @ without[pairs - lag]
        meat += (1.0 - lag / _ALIKE_WINDOWS) * (together + together.T)
    before = inverse[:count] @ believed(problem, problem.noise.drift) @ inverse[:, :count]
    return no_wider(meat * (windows - 1) / windows + before)


def _clear_of_itself(says: Array, scores: Array, inverse: Array) -> Array:
    """Scores of the windows as they would be had each not pulled the fit to itself (Bell and McCaffrey, CR2)."""
    sizes, axes = np.linalg.eigh(inverse)
    root, back = ((axes * sizes[..., None, :] ** power) @ np.swapaxes(axes, -1, -2) for power in (0.5, -0.5))
    share, ways = np.linalg.eigh(root @ says @ root)
    turned = np.einsum("kij,kil->kj", ways, root @ scores[..., None]) / np.sqrt(np.maximum(1.0 - share, 1e-6))
    return (back @ np.einsum("kij,kj->ki", ways, turned)[..., None])[..., 0]


def no_wider(covariance: Array) -> Array:
    """The same, but nothing less sure than it was before the record: few windows that contradict each other say too much."""
    share = 1.0 / np.sqrt(np.maximum(np.diag(covariance), 1.0))
    return covariance * np.outer(share, share)


def left_open(problem: Problem, x: Array, told: Array, covariance: Array) -> Array:
    """Covariance of the told unknowns, and then of those that stay as the file has them, that the latter are the cause of: they may
    be wrong.

    What a record does not tell by itself often stands in a sum with what it tells (the Munk moment with yaw damping): where the one
    is off, the other is, and the sum is not. How far off the file may be is what the fit of all found for it, and how sure that was.
    """
    says, _, places = by_window(problem, x)
    whole = np.linalg.inv(np.linalg.inv(precision_of(problem, says, places))[: len(told), : len(told)])
    pull = np.linalg.solve(whole[np.ix_(told, told)], whole[np.ix_(told, ~told)])
    away = x[: len(told)][~told]
    follows = np.concatenate([-pull, np.eye(len(away))])
    return follows @ (covariance[np.ix_(~told, ~told)] + np.outer(away, away)) @ follows.T


def _going_on(windows: Windows, lag: int) -> Array:
    """Numbers of the windows that go on from the one so many before, without a gap."""
    follows = windows.follows
    return np.array([k for k in range(lag, windows.count) if follows[k - lag + 1 : k + 1].all()], dtype=int)


def _judge(
    vessel: VesselConfig, windows: Windows, unknowns: list[FitUnknown], noise: Noise, theta: Array | None
) -> Any:
    """RMS over standard deviation of each output on windows of which only start and drift are fitted. ``theta`` None: the file's."""
    theta = np.zeros(len(unknowns)) if theta is None else theta
    problem = Problem(vessel, windows, unknowns, replace(noise, told=None))
    own = np.full(problem.size - len(unknowns), np.inf)
    held = Box(np.concatenate([theta, -own]), np.concatenate([theta, own]))
    x = settled(problem, np.concatenate([theta, np.zeros(len(own))]), held, lambda step: None)
    measured = problem.measured
    times = windows.starts[None] + problem.rows[:, None] * STEP_S
    _, nuisance = problem.split(x)
    modelled = problem.modelled(theta[None], nuisance[None])[:, :, 0, :]
    return errors_of(problem, x), {"times": times, "measured": measured, "modelled": modelled, "voyage": windows.voyage}


def errors_of(problem: Problem, x: Array) -> tuple[float, float, float]:
    """RMS over standard deviation of surge, sway, yaw rate: what of the motion a point leaves unexplained."""
    off, measured = problem.off(x), problem.measured
    surge, sway, yaw = (
        float(np.sqrt(np.nanmean(off[:, k] ** 2)) / max(float(np.nanstd(measured[:, k])), 1e-6)) for k in range(3)
    )
    return surge, sway, yaw


def widened(unknowns: list[FitUnknown], deviation: Array, *, by_fix: bool) -> Array:
    """Spreads, in widths of the priors, that a person may believe. ``by_fix``: all velocities are fixes, as they were told."""
    deviation = (_WIDER_BY_FIX if by_fix else _WIDER) * deviation
    least = np.array([_UNSURE.get(u.name, _UNSURE_ELSE) / u.width if u.relative else 0.0 for u in unknowns])
    late = [_UNSURE_S / (u.width * u.start if u.relative else u.width) for u in unknowns]
    floor = np.array(
        [s if u.name.endswith(("lag", "late", "smooth")) else 0.0 for u, s in zip(unknowns, late, strict=True)]
    )
    return np.maximum(np.hypot(deviation, least), floor)


def _to_believe(unknowns: list[FitUnknown], untold: list[FitUnknown], covariance: Array, by_fix: bool) -> Array:
    """Covariance of the unknowns, and then of those untold, as a person may believe it."""
    count, raw = len(unknowns), np.sqrt(np.diag(covariance))
    others = np.minimum((_WIDER_BY_FIX if by_fix else _WIDER) * raw[count:], 1.0)
    wider = np.concatenate([widened(unknowns, raw[:count], by_fix=by_fix), others]) / raw
    share = _SCALE_BY_FIX if by_fix else _SCALE
    scale = np.array([share / u.width if u.name in _TO_MASS else 0.0 for u in unknowns] + [0.0] * len(untold))
    return covariance * np.outer(wider, wider) + np.outer(scale, scale)


def _told(
    vessel: VesselConfig,
    unknowns: list[FitUnknown],
    untold: list[FitUnknown],
    *,
    theta: Array,
    covariance: Array,
    after: Any,
    before: Any,
) -> Fit:
    """The fit; ``covariance`` of the unknowns, and then of those untold."""
    deviation = np.sqrt(np.diag(covariance))
    return Fit(
        vessel,
        {u.name: float(u.value(theta[k])) for k, u in enumerate(unknowns)},
        {u.name: float(u.spread(theta[k], deviation[k])) for k, u in enumerate(unknowns)},
        known={u.name: bool(u.known(theta[k], deviation[k])) for k, u in enumerate(unknowns)},
        unknowns=unknowns,
        covariance=covariance,
        errors=after[0],
        errors_before=before[0],
        untold=untold,
        samples=after[1] | {"before": before[1]["modelled"]},
    )
