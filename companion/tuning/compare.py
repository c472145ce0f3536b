"""Whether a vessel's file still fits her last voyages, and by how much not: fouling, load, a propeller that gives less.

Not a new file but a judgement of the old one: what wear, load and weed change is left free, each as a share of what the file says, and
all else as closely as a file is believed. What voyages do not tell is not held against the boat, nor does it bear the file out. Motion
tells forces per mass, so a heavier boat looks like one whose thrust and drag are both smaller; told as such.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.hull.statics import Statics
from .effects import THROTTLE, Blame, Effects, vessel_at
from .fit import YAW_WIDTH, Progress, covariance_of, errors_of, no_wider, noise_of, solve, unsteadied, widened
from .fitted import unexplained
from .hull_arrays import STEP_S, WIND_MOMENTS
from .noise import Noise
from .problem import SENSED, TOGETHER, Problem
from .unknowns import FitUnknown, unknowns_of
from .voyages import Stretch
from .windows import WINDOW_S, Windows, cut, thinned, too_poor

Array = Any

_PRIOR: Final = 0.4
"""Width of what wear, load and weed do, before a voyage tells it."""
_ROUNDS: Final = 2
_SURE: Final = 2.0
"""A change is told when it is this many spreads away from none."""
_BARS: Final = {"thrust": 0.15, "drag": 0.2, "turning": 0.3, "starboard_share": 0.1, "area": 0.2}
"""And at least so large: a tenth less changes nothing that an operator would notice, and every file is wrong by as much. What is known
less closely than this does not bear a file out, either."""
_OWN: Final = {"thrust": 0.04, "drag": 0.04, "turning": 0.13, "starboard_share": 0.03, "area": 0.05}
"""One spread, beside what windows say differently, of what a foreign hull's own fitted file is off by on another day: 13 % in the ratio of
thrust and drag, 30 % in damping of turning, and a tenth between the sides in a blow were told of sound boats."""
_REST_BAR: Final = 0.05
"""And a way to rest that is longer by so much: no margin of the guards hangs on less."""
_ALIKE: Final = 0.6
"""Thrust and drag that are smaller by shares whose ratio is at least this are one thing: mass."""
_PER_MASS: Final = ("thrust", "drag")
_PER_INERTIA: Final = ("turning", "area")
_HELD: Final = 0.4
"""What a file says of anything else is believed so much more closely than a fit believes it that starts from an owner's guess: files that
were fitted to half an hour's trial were wrong by a tenth in sway and yaw damping, and by a fifth in a single coefficient of drag."""
_DRIVE: Final = ("exponent", "speed_loss", "dead_band", "lag", "rudder_lag", "race_share")
_HELD_DRIVE: Final = 0.1
"""And what a motor does with a command is neither weed nor load: a law that answers gusts would be told as another curve of thrust."""
_WIND_TURNS: Final = 0.05
"""Nobody measures a windage's moment; houses before or abaft the middle come to so much of lateral area times length."""
_ONE_COURSE: Final = 0.8
"""Length of the mean of all bows: within 37 degrees either way of one course."""
_EXPLAINED, _WIDER_BEYOND = 0.3, 10.0
"""As a fit widens its intervals where waves turn the boat as hard as her helm; nothing is kept apart here, and errors are less."""
_EXPLAINS: Final = 4.0
"""Squares of spreads that a single cause may leave: two spreads."""
_SCALE: Final = 0.06
"""One spread of what thrust and drag are off by together: mass. Fouled foreign hulls came out 13 to 16 % off, and 1.4 in their ratio to a
hundredth."""
_SCALE_BY_VOYAGE: Final = 0.3
"""A sound boat that kept her speed in 9 m/s of wind looked twice as heavy as she is, one of 30 kg that was fouled a tenth too light."""
_THROWN_S, _THROWN = 2.0, 0.15
"""Standard deviation of what the throttle changes by in so many seconds: trials come to 0.26 to 0.3, voyages to 0.06 or 0.07."""
_BORNE: Final = 0.3
"""Share of what the model does not explain that may have gone into a change: it has the shape of some coefficient, or of none."""
_ALONG: Final = ("thrust", "drag", "rest")


@dataclass(frozen=True, slots=True)
class Share:
    """What the voyages say of one thing, as a share of what the file says; 0.1 = a tenth more."""

    more: float
    sure: float
    """Half of the 95 % interval."""

    @staticmethod
    def of(log: float, sure_log: float) -> Share:
        """Of logarithms."""
        share = math.exp(log)
        # the end that is nearer to no change: it decides
        return Share(share - 1.0, share * (math.exp(sure_log) - 1.0 if log < 0.0 else 1.0 - math.exp(-sure_log)))

    def stands_out(self, bar: float) -> bool:
        return abs(self.more) > max(bar, self.sure)

    @property
    def words(self) -> str:
        return f"{abs(100 * self.more):.0f} % (± {100 * self.sure:.0f}) {'more' if self.more > 0 else 'less'}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """A file held against voyages."""

    seconds: float
    speed_mps: tuple[float, float] = (0.0, 0.0)
    """At 60 % throttle: by the file, by the voyages."""
    rest_m: tuple[float, float] = (0.0, 0.0)
    """Way to rest from the speed by the voyages, the same; by the file with its safety factor."""
    rest_between_m: tuple[float, float] = (0.0, 0.0)
    """The 95 % interval of what the voyages say of it."""
    shares: dict[str, Share] = field(default_factory=dict)
    either: bool = False
    """A change of thrust may as well be one of drag the other way."""
    poor: str = ""
    """Why these voyages tell nothing, in words; nothing else is told then."""

    @property
    def runs_on(self) -> bool:
        """Whether the boat surely runs on farther than the guards reckon with."""
        by_file_m, found_m = self.rest_m
        return found_m > (1.0 + _REST_BAR) * by_file_m and self.rest_between_m[0] > by_file_m

    @property
    def fits(self) -> bool:
        """Whether nothing is held against the file; how much that is worth ``unclear`` tells."""
        return not self.findings and not self.runs_on

    @property
    def unclear(self) -> str:
        """What these voyages do not tell closely enough to bear the file out, and how closely; "" when nothing."""
        if self.poor:
            return self.poor
        wide = {
            name: share
            for name, share in self.shares.items()
            if share.sure > _BARS[name] and not share.stands_out(_BARS[name])
        }
        told = ", ".join(f"{_NAMES[name]} within ± {100 * share.sure:.0f} %" for name, share in wide.items())
        return f"{told}; sail turns and two speeds in calm water" if told else ""

    @property
    def findings(self) -> tuple[str, ...]:
        """What no longer fits, in words; empty when the file does."""
        out = {name: share for name, share in self.shares.items() if share.stands_out(_BARS[name])}
        load = _load(out)
        if load is not None:
            kind = "heavier" if load > 0.0 else "lighter"
            told = f"the boat is about {abs(100 * load):.0f} % {kind} than the file says: load"
            rest = {name: share for name, share in out.items() if not _follows(name, share, load)}
            return (told, *(_line(name, share) for name, share in rest.items()))
        return tuple(_line(name, share) + self._or(name, share) for name, share in out.items())

    def _or(self, name: str, share: Share) -> str:
        """What looks the same, in words."""
        if not self.either or name not in _PER_MASS:
            return ""
        what = "the drag is" if name == "thrust" else "the propellers give"
        return f"; or {what} {'less' if share.more > 0.0 else 'more'}"


def _load(out: dict[str, Share]) -> float | None:
    """By how much the mass has changed, when thrust and drag per mass have changed alike; None when not."""
    if not set(_PER_MASS) <= set(out):
        return None
    small, large = sorted((out[name].more for name in _PER_MASS), key=abs)
    if small * large <= 0.0 or abs(small) < _ALIKE * abs(large):
        return None
    return 1.0 / (1.0 + 0.5 * (small + large)) - 1.0


def _follows(name: str, share: Share, load: float) -> bool:
    """Whether a change is the load once more: inertia in yaw grows with it, and what acts against that is less per inertia."""
    if name in _PER_MASS:
        return True
    per_mass = 1.0 / (1.0 + load) - 1.0
    small, large = sorted((share.more, per_mass), key=abs)
    return name in _PER_INERTIA and small * large > 0.0 and abs(small) >= _ALIKE * abs(large)


_WORDS: Final = {
    "thrust": (
        "the propellers give",
        "worn or fouled propellers, or less voltage",
        "other propellers, or more voltage",
    ),
    "drag": ("the drag is", "a cleaned hull", "fouling, or something in tow"),
    "turning": ("what damps turning is", "a cleaned hull", "fouling, or something in tow"),
    "starboard_share": ("starboard gives, against port,", "weed or damage on starboard", "weed or damage on port"),
    "area": ("the rudders turn her by", "loose, bent or fouled", "other rudders"),
}
"""What it is called, and the usual cause of less and of more."""
_NAMES: Final = {
    "thrust": "thrust",
    "drag": "drag",
    "turning": "damping of turning",
    "starboard_share": "starboard against port",
    "area": "rudders",
}


def _line(name: str, share: Share) -> str:
    what, less, more = _WORDS[name]
    return f"{what} {share.words} than the file says: {more if share.more > 0.0 else less}"


def compare(vessel: VesselConfig, stretches: Sequence[Stretch], say: Progress = lambda text: None) -> Comparison:
    """Hold a file against voyages. Raises ValueError, in words, when they are too short."""
    windows = thinned(cut(stretches))
    if poor := _poor(windows):
        return Comparison(windows.count * WINDOW_S, poor=poor)
    unknowns = _free(vessel, windows)
    noise, x = Noise.white(0.08, 0.1, 0.03), None
    for turn in range(_ROUNDS):
        problem = Problem(vessel, windows, unknowns, noise)
        x = solve(problem, np.zeros(problem.size) if x is None else x, turn, say)
        noise = noise_of(problem, x)
    assert x is not None
    problem = problem.under(noise)
    theta, _ = problem.split(x)
    covariance = covariance_of(problem, x)
    deviation = np.sqrt(np.diag(covariance))
    wider = widened(unknowns, deviation, by_fix=bool(windows.by_fix.all())) / deviation
    return _compared(problem, theta, no_wider(covariance * np.outer(wider, wider)), errors_of(problem, x))


def _poor(windows: Windows) -> str:
    """What voyages lack to tell anything, in words; "" when nothing."""
    found = []
    try:
        too_poor(windows)
    except ValueError as error:
        found.append(str(error))
    # along one course a current is speed, and what the throttle does only answers gusts
    bow = np.exp(1j * windows.commands.psi_rad)
    if abs(bow.mean()) > _ONE_COURSE:
        found.append("she keeps one course: sail turns")
    return "; ".join(found)


def _compared(problem: Problem, theta: Array, covariance: Array, errors: tuple[float, float, float]) -> Comparison:
    vessel, unknowns, seconds = problem.vessel, problem.unknowns, problem.windows.count * WINDOW_S
    if poor := unexplained(errors, float(np.nanstd(problem.measured[:, 1]))):
        return Comparison(seconds, poor=" and ".join(poor))
    effects, now = Effects(vessel, unknowns), Statics(vessel_at(vessel, unknowns, theta))
    at, whole = effects.at(theta), effects.covariance(theta, covariance)
    wider = unsteadied(problem.noise.drift) * (1.0 + _WIDER_BEYOND * max(0.0, errors[2] - _EXPLAINED))
    born = np.array([0.5 * _BORNE * errors[0 if name in _ALONG else 2] for name in at])
    own = np.array([_OWN.get(name, 0.0) for name in at])
    whole = wider**2 * whole + np.diag(born**2 + own**2)
    place, scale = {name: k for k, name in enumerate(at)}, _scale(problem.windows)
    pair = [place[name] for name in _PER_MASS]
    apart = _attributed(np.array(list(at.values()))[pair], whole[np.ix_(pair, pair)] + scale**2)
    sure = {name: _SURE * math.sqrt(whole[k, k] + scale**2 * (name == "rest")) for k, name in enumerate(at)}
    shares = {name: Share.of(at[name] + apart.shift, sure[name]) for name in _BARS if name in at}
    if "starboard_share" in at:
        shares["starboard_share"] = Share.of(at["starboard_share"], sure["starboard_share"])
    shares |= {"thrust": apart.thrust, "drag": apart.drag}
    old = Statics(vessel.model_copy(update={"stopping_factor": 1.0}))
    speeds = old.throttle_to_speed(THROTTLE), now.throttle_to_speed(THROTTLE)
    rest = Statics(vessel).stopping_distance_m(speeds[1]), now.stopping_distance_m(speeds[1]) * math.exp(-apart.shift)
    between = rest[1] * math.exp(-sure["rest"]), rest[1] * math.exp(sure["rest"])
    return Comparison(seconds, speeds, rest, rest_between_m=between, shares=shares, either=apart.either)


def _scale(windows: Windows) -> float:
    """One spread of what thrust and drag are off by together. Only throttle that is thrown over tells how fast way is put on and taken
    off: a law that keeps a speed answers gusts, and the boat looks heavier or lighter than she is.
    """
    both, span = 0.5 * (windows.commands.port + windows.commands.starboard), round(_THROWN_S / STEP_S)
    return _SCALE if float(np.std(both[span:] - both[:-span])) > _THROWN else _SCALE_BY_VOYAGE


@dataclass(frozen=True, slots=True)
class _Apart:
    """Thrust and drag by the likeliest cause."""

    thrust: Share
    drag: Share
    either: bool = False
    """The other one explains it as well."""
    shift: float = 0.0
    """By how much the logarithm of all that acts per mass was off, then."""


def _attributed(found: Array, covariance: Array) -> _Apart:
    """By the one cause that explains the logarithms of thrust and drag best; both as they were found where no single one does.

    What a boat's speed is at a throttle tells only their ratio; the scale of both hangs on how fast way is put on and taken off, which
    weather and a foreign hull's shape mislead. A single cause is likelier than two that happen to look like it.
    """
    thrust, drag, load = (Blame.of(np.array(way), found, covariance) for way in ([1.0, 0.0], [0.0, 1.0], [1.0, 1.0]))
    alone = [Share.of(cause.log, _SURE * math.sqrt(cause.variance)) for cause in (thrust, drag)]
    by_mass = Share.of(load.log, _SURE * math.sqrt(load.variance))
    least = min(thrust.left, drag.left)
    if load.left < least and by_mass.stands_out(_BARS["thrust"]):
        return _Apart(by_mass, by_mass)
    if least > _EXPLAINS:
        own = _SURE * np.sqrt(np.diag(covariance))
        return _Apart(Share.of(found[0], own[0]), Share.of(found[1], own[1]))
    logs = np.array([thrust.log, 0.0] if thrust.left < drag.left else [0.0, drag.log])
    shares = [share if log else Share(0.0, share.sure) for share, log in zip(alone, logs, strict=True)]
    either = max(thrust.left, drag.left) < _EXPLAINS
    return _Apart(shares[0], shares[1], either, float(np.mean(logs - found)))


def _free(vessel: VesselConfig, windows: Windows) -> list[FitUnknown]:
    """What may have changed since the file was made, what it may be wrong in all along, and what belongs to the record.

    A file that could be wrong in nothing else would have all that it is wrong in told as wear.
    """
    found = [FitUnknown(name, 1.0, _PRIOR, True, low=-4.0, high=4.0) for name in _BARS if name in TOGETHER]
    # what the propellers turn her by is no measure of what they push: where she is steered against waves the helm's answer is learnt
    found.append(FitUnknown("yaw", 1.0, YAW_WIDTH, True, low=-4.0, high=4.0))
    found += [FitUnknown(name, 0.0, _WIND_TURNS, relative=False) for name in WIND_MOMENTS]
    usual = [u for u in unknowns_of(vessel, windows) if u.name != "ahead"]
    record = ("wind_", *SENSED)
    return found + [u if u.name in _BARS or u.name.startswith(record) else _held(u) for u in usual]


def _held(unknown: FitUnknown) -> FitUnknown:
    """The same, believed as what a file says is believed."""
    share = _HELD_DRIVE if unknown.name in _DRIVE else _HELD
    low, high = unknown.low / share, unknown.high / share
    return replace(unknown, width=share * unknown.width, low=low, high=high)
