"""From a fit to a boat's file: the fitted vessel, how far it may still run, what gains it bears at the worst corner, the TOML text."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ..core.hull import Handling, VesselConfig
from ..core.hull.blown import MOST_OFF_RAD, off_rad
from ..core.hull.statics import Statics
from ..core.steer import SteeringConfig
from ..core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ..core.steer.model import ModelController
from ..core.steer.yaw_loop import DELAY_S, LoopJudge, LoopMargins, yaw_plant
from .fit import Fit
from .problem import TOGETHER
from .unknowns import PLACES as PLACES, FitUnknown, with_values as with_values

Array = Any

_DRAWS: Final = 2000
"""The way to rest that nearly all of them keep within is then sure to a hundredth."""
_UPPER_PERCENT: Final = 97.5
"""The upper end of the 95 % interval, as the file tells its intervals. A twentieth of all boats beyond it were too many: of 31 fits two had
come out short, by less than a hundredth."""
_STOPS_FROM: Final = (0.2, 0.35, 0.5, 1.0)
"""Shares of the top speed from which a stop is reckoned: shoals are met slowly, too."""
_CORNER_DRAWS: Final = 6
_CORNER: Final = 2.0
"""Corners lie two standard deviations out along each principal axis of the confidence region."""
_UNEXPLAINED_SURGE, _UNEXPLAINED_YAW = 0.75, 0.6
"""Error on stretches kept apart, RMS over standard deviation, from which on most of a motion is not the model's doing. A boat of 9 kg
in waves for one of 50 came to 0.99, and her way to rest out a third too short; five light boats drawn at random that came to 0.65 and more
turned up to twice as fast as they do. Trials in waves that a boat is made for stay below 0.3."""
_UNEXPLAINED_SWAY, _SWAY_MPS = 0.6, 0.15
"""As of surge and yaw, where what is not explained is more than a receiver's noise, m/s: of a boat that hardly drifts there is nothing
else. Good records came to 0.39 at most; a sway of the wrong sign to 0.64 and 0.18 m/s, on a boat whose sway inertia was then told eight
times too large."""
_STRAYED: Final = 3.0
"""Files that are wrong by half, and owners' guesses by VESSEL.md, are left by less; km/h for m/s makes 3.6."""
_FELT: Final = 1.05
"""Intervals that are wider by less look the same."""
_TOUCHES: Final = 1e-9
"""Widths; what is so near to its bound is at it."""
_SLOWER: Final = 0.85
_LEAST_BANDWIDTH: Final = 0.4
"""rad/s: slower ones are not tried. Most boats are turned away by wind long before."""
_SPEEDS: Final = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Shares of the greatest speed at which margins are looked at."""


def fitted_vessel(fit: Fit) -> VesselConfig:
    """Return the vessel as the record tells it; what it does not tell is as it was."""
    found = with_values(fit.vessel, fit.values)
    return found.model_copy(update={"stopping_factor": stopping_factor(fit, found)})


def stopping_factor(fit: Fit, found: VesselConfig) -> float:
    """Upper end of the 95 % interval of the way to rest over its best estimate, from a walk to top speed.

    At the slow end the way hangs on the linear drag alone, which a record of cruising tells least of.
    """
    best, most = Statics(_plain(found)), 1.0
    speeds = [share * best.top_mps for share in _STOPS_FROM]
    ways = np.array([[Statics(_plain(v)).stopping_distance_m(speed) for speed in speeds] for v in draws(fit, _DRAWS)])
    for k, speed in enumerate(speeds):
        most = max(most, float(np.percentile(ways[:, k], _UPPER_PERCENT)) / best.stopping_distance_m(speed))
    return round(min(most, 3.0), 3)


def _plain(vessel: VesselConfig) -> VesselConfig:
    """As it moves: what the file before added to the way to rest says nothing of this one."""
    return vessel.model_copy(update={"stopping_factor": 1.0})


def draws(fit: Fit, count: int) -> list[VesselConfig]:
    """Vessels drawn from the confidence region."""
    dice = np.random.default_rng(1)
    middle = _middle(fit)
    return [_at(fit, x) for x in dice.multivariate_normal(middle, fit.covariance, size=count, method="eigh")]


def corners(fit: Fit) -> list[VesselConfig]:
    """Vessels at the ends of the confidence region's axes, and some between."""
    sizes, axes = np.linalg.eigh(fit.covariance)
    middle = _middle(fit)
    reach = _CORNER * np.sqrt(np.maximum(sizes, 0.0))
    ends = [middle + sense * reach[k] * axes[:, k] for k in range(len(sizes)) for sense in (-1.0, 1.0)]
    dice = np.random.default_rng(2)
    for _ in range(_CORNER_DRAWS):
        way = dice.normal(size=len(sizes))
        ends.append(middle + axes @ (reach * way / np.linalg.norm(way)))
    return [_at(fit, x) for x in ends]


def _middle(fit: Fit) -> Array:
    """The fitted values, and of what the record does not tell the file's, in widths."""
    found = []
    for u in fit.unknowns:
        value = fit.values[u.name]
        found.append(math.log(value / u.start) / u.width if u.relative else (value - u.start) / u.width)
    return np.array(found + [0.0] * len(fit.untold))


def _at(fit: Fit, x: Array) -> VesselConfig:
    x = _within(fit, x)
    return with_values(fit.vessel, {u.name: float(u.value(x[k])) for k, u in enumerate(_every(fit))})


def _every(fit: Fit) -> list[FitUnknown]:
    """What the covariance is of."""
    return [*fit.unknowns, *fit.untold]


def _within(fit: Fit, x: Array) -> Array:
    """The likeliest point of the region where ``x`` may not go: what is at its bound takes with it all that hangs on it.

    A yaw damping that may not fall below nothing would else leave alone the added mass whose moment it was to bear: a boat far
    outside the region, and unstable where the region is not.
    """
    low, high = (np.array([getattr(u, side) for u in _every(fit)]) for side in ("low", "high"))
    at, held, moved = np.zeros(len(x), dtype=bool), x.copy(), x
    for _ in x:
        beyond = (moved < low - _TOUCHES) | (moved > high + _TOUCHES)
        if not beyond.any():
            break
        at |= beyond
        held[beyond] = np.clip(moved, low, high)[beyond]
        back = np.linalg.lstsq(fit.covariance[np.ix_(at, at)], (held - x)[at], rcond=None)[0]
        moved = x + fit.covariance[:, at] @ back
    return np.clip(moved, low, high)


@dataclass(frozen=True, slots=True)
class Gains:
    """The heading loop that the ``model`` law takes from the fitted file, and what it leaves."""

    bandwidth: float
    """STEER_BW to set, rad/s."""
    lowered: bool
    """It is less than the settings ask for, because of what is not known."""
    speeds: tuple[float, ...]
    gains: tuple[tuple[float, float, float], ...]
    """P, I, D at each speed."""
    best: tuple[LoopMargins, ...]
    worst: tuple[LoopMargins, ...]
    """At the worst corner of the confidence region."""
    off_rad: tuple[float, ...] = ()
    """How far wind turns the bow there, at each speed with way on."""
    blown: bool = False
    """Bandwidths were left out because wind would turn the bow away."""

    @property
    def holds(self) -> bool:
        return all(_kept(m) for m in self.worst)

    @property
    def up_to_mps(self) -> float:
        """The greatest speed looked at up to which the bars hold at the worst corner; 0 when nowhere."""
        kept = itertools.takewhile(lambda pair: _kept(pair[1]), zip(self.speeds, self.worst, strict=True))
        return max((speed for speed, _ in kept), default=0.0)


def _kept(margins: LoopMargins) -> bool:
    return margins.gain_db >= GAIN_BAR_DB and margins.phase_deg >= PHASE_BAR_DEG


def gains_for(fit: Fit, vessel: VesselConfig, steering: SteeringConfig) -> Gains:
    """Return the greatest bandwidth whose margins hold at the worst corner over all speeds, or the settings' own when none does.

    Not the slowest: a hull that turns away by itself at speed needs a fast law, and a slow one lets it go; and any hull is blown about
    by one. There the speed is to be lowered, up to which the margins hold. A bandwidth that holds up to a greater speed than the
    settings' own, and not to the greatest, was tried: the blueboat's legs and circles in a blow were half as good again with it.
    """
    ends, most = corners(fit), steering.model.heading_bandwidth
    own = found = _with_bandwidth(vessel, ends, steering, most)
    while not found.holds and found.bandwidth * _SLOWER >= _LEAST_BANDWIDTH:
        found = _with_bandwidth(vessel, ends, steering, found.bandwidth * _SLOWER)
        if _blown(found, own):
            return replace(own, blown=True)
    return found if found.holds else own


def _with_bandwidth(
    vessel: VesselConfig, ends: Sequence[VesselConfig], steering: SteeringConfig, bandwidth: float
) -> Gains:
    lowered = bandwidth < steering.model.heading_bandwidth
    model = steering.model.model_copy(update={"heading_bandwidth": bandwidth})
    return _gains(vessel, ends, steering.model_copy(update={"model": model}), bandwidth, lowered=lowered)


def _blown(slower: Gains, own: Gains) -> bool:
    """Whether wind turns the bow too far, and farther than by the settings' own bandwidth."""
    both = zip(slower.off_rad, own.off_rad, strict=True)
    return any(off > max(MOST_OFF_RAD, usual) for off, usual in both)


def _gains(
    vessel: VesselConfig, ends: Sequence[VesselConfig], steering: SteeringConfig, bandwidth: float, *, lowered: bool
) -> Gains:
    controller = ModelController(steering, vessel)
    at_rest = yaw_plant(vessel, 0.0)
    # where a rudder needs way on, nothing holds at rest and nothing fails
    shares = _SPEEDS if any((*at_rest.by_rudder, *at_rest.by_thrust)) else _SPEEDS[1:]
    speeds = tuple(share * controller.steady_mps for share in shares)
    gains = tuple(controller.heading_gains(speed) for speed in speeds)
    late_s = DELAY_S + steering.model.heading_late_s
    best, worst = [], []
    for speed, (kp, ki, kd) in zip(speeds, gains, strict=True):
        best.append(LoopJudge(yaw_plant(vessel, speed), late_s).margins(kp, ki, kd))
        others = [LoopJudge(yaw_plant(end, speed), late_s).margins(kp, ki, kd) for end in ends]
        worst.append(LoopMargins(min(m.gain_db for m in others), min(m.phase_deg for m in others)))
    # where she lies she is let turn to face what pushes
    off = (
        max(off_rad(end, speed, kp) for end in ends)
        for speed, (kp, _, _) in zip(speeds, gains, strict=True)
        if speed > 0.0
    )
    return Gains(bandwidth, lowered, speeds, gains, best=tuple(best), worst=tuple(worst), off_rad=tuple(off))


def changes(old: VesselConfig, new: VesselConfig, steering: SteeringConfig) -> list[tuple[str, str, str]]:
    """What changes for whoever adopts the file: (what, before, after)."""
    plain = [_plain(vessel) for vessel in (old, new)]

    def row(what: str, of: Callable[[VesselConfig], str], vessels: Sequence[VesselConfig]) -> tuple[str, str, str]:
        return what, of(vessels[0]), of(vessels[1])

    def rest(speed: float) -> Callable[[VesselConfig], str]:
        return lambda v: f"{Statics(v).stopping_distance_m(speed):.1f}"

    def steady(throttle: float) -> Callable[[VesselConfig], str]:
        return lambda v: f"{Statics(v).throttle_to_speed(throttle):.2f}"

    def law(v: VesselConfig) -> ModelController:
        return ModelController(steering, v)

    both = (old, new)
    return [
        row("top speed, m/s", lambda v: f"{Statics(v).top_mps:.2f}", plain),
        *(row(f"way to rest from {speed:g} m/s, m", rest(speed), both) for speed in (1.0, 2.0)),
        *(row(f"speed at {throttle:.0%} throttle, m/s", steady(throttle), plain) for throttle in (0.3, 0.6)),
        row("heading bandwidth at half speed, rad/s", lambda v: f"{law(v).schedule.gains[4].omega_radps:.2f}", both),
        row("greatest speed with safe margins, m/s", lambda v: f"{law(v).steady_mps:.2f}", both),
        row("greatest turn rate at 1 m/s, deg/s", lambda v: f"{math.degrees(Handling(v).max_yaw_rate(1.0)):.0f}", both),
    ]


def doubt(fit: Fit) -> str:
    """Say, to whoever might adopt the file, what the fitted boat does not do as the recorded one did; "" when she does all."""
    found = unexplained(fit.errors, _spread_of_sway(fit))
    mend = "if it was calm, a column, sensor or lead is wrong; else sail a trial in calmer water"
    return f"DO NOT adopt this file: {' and '.join(found)}; {mend}" if found else ""


def unexplained(errors: tuple[float, float, float], sway_mps: float) -> list[str]:
    """What of a recorded motion is not the model's doing, in words, by its errors and the standard deviation of sway."""
    surge, sway, yaw = errors
    found = []
    if surge > _UNEXPLAINED_SURGE:
        found.append(
            f"her speed is hardly explained (error {surge:.2f}): wind and current did more than her propellers"
        )
    if sway > _UNEXPLAINED_SWAY and sway * sway_mps > _SWAY_MPS:
        found.append(
            f"her sideways motion is hardly explained (error {sway:.2f}): the sign of sway is wrong, or she was set about more than turned"
        )
    if yaw > _UNEXPLAINED_YAW:
        found.append(f"her turning is hardly explained (error {yaw:.2f}): waves turned her more than her helm")
    return found


def _spread_of_sway(fit: Fit) -> float:
    """Standard deviation of what was measured, m/s; the error of a motion is told as a share of it."""
    return float(np.nanstd(fit.samples["measured"][:, 1])) if fit.samples else 0.0


def strayed(fit: Fit) -> str:
    """Name what came out far from what the file said, with its factor; "" when nothing did."""
    factors = {u.name: fit.values[u.name] / u.start for u in fit.unknowns if u.relative and u.name in PLACES}
    far = [
        f"{name} {factor:.2g} times" for name, factor in factors.items() if abs(math.log(factor)) > math.log(_STRAYED)
    ]
    return f"far from the file: {', '.join(far)}: are units, signs and mass right?" if far else ""


def care(fit: Fit) -> str:
    """Say what is less sure than usual of a file that may be adopted; "" when nothing is."""
    if doubt(fit):
        return ""
    found = []
    if fit.wider > _FELT:
        found.append(
            f"waves turned her nearly as hard as her helm (error {fit.errors[2]:.2f}), so intervals are {fit.wider:.1f} times as "
            "wide as usual, and the way to rest is reckoned longer; a trial in calmer water tells more"
        )
    if fit.unsteady > _FELT:
        found.append(
            f"gusts or a current that turns gave and took way, so thrust and drag are told {fit.unsteady:.1f} times as wide as usual, "
            "and the way to rest is reckoned longer; a trial in less wind tells more"
        )
    return f"take care: {'; '.join(found)}" if found else ""


def as_toml(fit: Fit, vessel: VesselConfig, source: str, day: str) -> str:
    """Return the text of a vessel file: every fitted value with its interval, what stayed is marked."""
    notes = {PLACES[name][:2]: _interval(name, fit) for name in fit.values if name in PLACES}
    notes |= {PLACES[u.name][:2]: _left(u.name, fit) for u in fit.untold if u.name in PLACES}
    data = vessel.model_dump(exclude_none=True)
    lines = [
        f"# Fitted to {source}, {day}, {fit.seconds:.0f} s of record. Read it before you sail by it.",
        f"# Error on stretches kept apart (RMS over standard deviation): surge {fit.errors[0]:.2f}, sway {fit.errors[1]:.2f}, "
        f"yaw rate {fit.errors[2]:.2f}; with the file before: {fit.errors_before[0]:.2f}, {fit.errors_before[1]:.2f}, "
        f"{fit.errors_before[2]:.2f}.",
        "# Motion tells forces per mass: everything stands in proportion to hull.m11_kg, which is as it was. Intervals are 95 %.",
    ]
    if text := doubt(fit) or care(fit):
        lines.append(f"# {text}")
    if text := strayed(fit):
        lines.append(f"# {text}")
    notes["", "stopping_factor"] = "upper end of the 95 % interval over the best estimate"
    _table(lines, "", data, notes)
    return "\n".join(lines) + "\n"


def vessel_toml(vessel: VesselConfig) -> str:
    """Return the text of a vessel file without notes."""
    lines: list[str] = []
    _table(lines, "", vessel.model_dump(exclude_none=True), {})
    return "\n".join(lines) + "\n"


def _left(name: str, fit: Fit) -> str:
    if fit.turning != 1.0 and name in TOGETHER["yaw"]:
        return f"not told by the record: {fit.turning:.2g} times what it was, as all that resists turning"
    return "not told by the record: as it was"


def interval(name: str, fit: Fit) -> tuple[float, float]:
    """The 95 % interval as the fit reckons with it: known as a share of itself, or within what can be, and so never below zero."""
    unknown, value, spread = next(u for u in fit.unknowns if u.name == name), fit.values[name], fit.spread[name]
    if unknown.relative:
        share = math.exp(2.0 * spread / value)
        return value / share, value * share
    least, most = (float(unknown.value(end)) for end in (unknown.low, unknown.high))
    return max(value - 2.0 * spread, least), min(value + 2.0 * spread, most)


def _interval(name: str, fit: Fit) -> str:
    scale = math.degrees(1.0) if name == "offset" else 1.0
    low, high = (scale * end for end in interval(name, fit))
    return f"{low:.4g} to {high:.4g} {PLACES[name][2]}".rstrip()


def _table(lines: list[str], path: str, data: dict[str, Any], notes: dict[tuple[str, str], str]) -> None:
    tables = {key: value for key, value in data.items() if isinstance(value, dict)}
    if path and any(key not in tables for key in data):
        lines += ["", f"[{path}]"]
    for key, value in data.items():
        if key not in tables:
            note = notes.get((path, key))
            lines.append(f"{key} = {_toml(value)}{f'  # {note}' if note else ''}")
    for key, table in tables.items():
        if table:
            _table(lines, f"{path}.{key}" if path else key, table, notes)


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple | list):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, float):
        return f"{value:.6g}" if value != int(value) or abs(value) > 1e9 else f"{value:.1f}"
    return str(value).lower() if isinstance(value, bool) else str(value)
