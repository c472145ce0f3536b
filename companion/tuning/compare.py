"""Whether a vessel's file still fits her last voyages, and by how much not: fouling, load, a propeller that gives less.

Not a new file but a judgement of the old one: only what wear, load and weed change is left free, each as a share of what the file
says. Motion tells forces per mass, so a heavier boat looks like one whose thrust and drag are both smaller; told as such.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ..core.hull import VesselConfig
from ..core.hull.statics import Statics
from .fit import Progress, covariance_of, solve, widened
from .noise import Noise
from .problem import TOGETHER, Problem
from .unknowns import FitUnknown, unknowns_of
from .voyages import Stretch
from .windows import WINDOW_S, Windows, cut

Array = Any

_PRIOR: Final = 0.4
"""Width of what wear, load and weed do, before a voyage tells it."""
_ROUNDS: Final = 2
_SURE: Final = 2.0
"""A change is told when it is this many spreads away from none."""
_BARS: Final = {"thrust": 0.08, "drag": 0.15, "turning": 0.25, "starboard_share": 0.08, "area": 0.15}
"""And at least so large: less changes nothing that an operator would notice, and every file is wrong by as much."""
_REST_BAR: Final = 0.05
"""And a way to rest that is longer by so much: no margin of the guards hangs on less."""
_ALIKE: Final = 0.6
"""Thrust and drag that are smaller by shares whose ratio is at least this are one thing: mass."""
_LEAST_MORE: Final = -0.9
"""A tenth of the drag is left to any hull."""
_PER_MASS: Final = ("thrust", "drag")
_PER_INERTIA: Final = ("turning", "area")
_THROTTLE: Final = 0.6


@dataclass(frozen=True, slots=True)
class Share:
    """What the voyages say of one thing, as a share of what the file says; 0.1 = a tenth more."""

    more: float
    sure: float
    """Half of the 95 % interval."""

    def stands_out(self, bar: float) -> bool:
        return abs(self.more) > max(bar, self.sure)

    @property
    def words(self) -> str:
        return f"{abs(100 * self.more):.0f} % (± {100 * self.sure:.0f}) {'more' if self.more > 0 else 'less'}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """A file held against voyages."""

    seconds: float
    speed_mps: tuple[float, float]
    """At 60 % throttle: by the file, by the voyages."""
    rest_m: tuple[float, float]
    """Way to rest from the speed by the voyages, the same; by the file with its safety factor."""
    rest_between_m: tuple[float, float]
    """The 95 % interval of what the voyages say of it."""
    shares: dict[str, Share]

    @property
    def runs_on(self) -> bool:
        """Whether the boat surely runs on farther than the guards reckon with."""
        by_file_m, found_m = self.rest_m
        return found_m > (1.0 + _REST_BAR) * by_file_m and self.rest_between_m[0] > by_file_m

    @property
    def fits(self) -> bool:
        return not self.findings and not self.runs_on

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
        return tuple(_line(name, share) for name, share in out.items())


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


def _line(name: str, share: Share) -> str:
    what, less, more = _WORDS[name]
    return f"{what} {share.words} than the file says: {more if share.more > 0.0 else less}"


def compare(vessel: VesselConfig, stretches: Sequence[Stretch], say: Progress = lambda text: None) -> Comparison:
    """Hold a file against voyages. Raises ValueError, in words, when they are too short."""
    windows = cut(stretches)
    unknowns = _free(vessel, windows)
    noise, x = Noise.white(0.08, 0.1, 0.03), None
    for turn in range(_ROUNDS):
        problem = Problem(vessel, windows, unknowns, noise)
        x = solve(problem, np.zeros(problem.size) if x is None else x, turn, say)
        noise = Noise.of(problem.off(x), problem.measured)
    assert x is not None
    problem = Problem(vessel, windows, unknowns, noise)
    spread = widened(unknowns, np.sqrt(np.diag(covariance_of(problem, x))), by_fix=bool(windows.by_fix.all()))
    shares = {
        u.name: Share(float(u.value(x[k]) / u.start - 1.0), float(_SURE * u.spread(x[k], spread[k]) / u.start))
        for k, u in enumerate(unknowns)
        if u.name in _BARS
    }
    now = _worn(vessel, shares)
    old = Statics(vessel.model_copy(update={"stopping_factor": 1.0}))
    speeds = old.throttle_to_speed(_THROTTLE), now.throttle_to_speed(_THROTTLE)
    rest = Statics(vessel).stopping_distance_m(speeds[1]), now.stopping_distance_m(speeds[1])
    drag = shares["drag"]
    # a boat that runs out is slowed by her drag alone
    between = [
        _worn(vessel, shares | {"drag": Share(max(drag.more + end, _LEAST_MORE), 0.0)}).stopping_distance_m(speeds[1])
        for end in (drag.sure, -drag.sure)
    ]
    return Comparison(windows.count * WINDOW_S, speeds, rest, rest_between_m=(between[0], between[1]), shares=shares)


def _free(vessel: VesselConfig, windows: Windows) -> list[FitUnknown]:
    """What may have changed since the file was made, and what belongs to the record."""
    names = [name for name in _BARS if name in TOGETHER]
    found = [FitUnknown(name, 1.0, _PRIOR, True, low=-4.0, high=4.0) for name in names]
    usual = unknowns_of(vessel, windows)
    record = ("wind_", "velocity_", "place_", "heading_", "bow_", "sensor_", "offset")
    return found + [u for u in usual if u.name in _BARS or u.name.startswith(record)]


def _worn(vessel: VesselConfig, shares: dict[str, Share]) -> Statics:
    """The vessel's statics as the voyages show her."""
    thrust, drag = 1.0 + shares["thrust"].more, 1.0 + shares["drag"].more
    hull, thruster = vessel.hull, vessel.thruster
    side = 1.0 + shares["starboard_share"].more if "starboard_share" in shares else 1.0
    worn = {
        "hull": hull.model_copy(update={"xu": drag * hull.xu, "xuu": drag * hull.xuu}),
        "thruster": thruster.model_copy(
            update={
                "ahead_n": thrust * thruster.ahead_n,
                "astern_n": thrust * thruster.astern_n,
                "starboard_share": side * thruster.starboard_share,
            }
        ),
        "stopping_factor": 1.0,
    }
    return Statics(vessel.model_copy(update=worn))
