"""Whether the columns of a log can be what they are said to be: signs and scales, asked of the boat's own motion.

A fit believes its record. A sign or a unit that is wrong goes into coefficients, or looks like a rough sea; what a boat cannot do is seen
before: a heading that turns against its own rate, a hull that goes astern the faster the more its propellers push ahead or turns away from
where its helm turns it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from .hull_arrays import STEP_S
from .records.places import mirrored, too_fast
from .records.pushing import pushing, smooth
from .voyages import RUN_COLUMNS, Column, Stretch

Array = Any

_TURN_S: Final = 4.0
"""The bow's turn is held against the sum of its rates over so long: what a compass is late by hardly counts then."""
_TURNS_RAD: Final = 0.2
"""In less, one row in twenty, a record tells nothing of turning."""
_TURNS_SURELY_RAD: Final = 0.5
"""From here on two columns that tell of other turns are not a calm sea's and a compass's noise."""
_SPIKE_S: Final = 1.0
"""A median over so long leaves no spike of a few rows, and of what is turned in four seconds nearly all."""
_TURNS_MOST_RAD: Final = 25.0
"""Once round a second: no hull does, and 6 degrees a second are taken for it."""
_TOGETHER: Final = 0.5
"""Correlation below which two columns do not tell of the same motion; right records of the trials came to 0.98 at least."""
_SURELY: Final = 0.8
"""Correlation from which on a ratio is the columns' and not their noise's or spikes'."""
_SCALE: Final = (0.6, 1.67)
"""Ratios of what should be alike that pass. A hull of 3 kg, whose rate an estimator smooths, comes to 1.2."""
_DEGREES: Final = (30.0, 85.0)
"""A ratio that is one of degrees to radians, and no other unit's: headings that wrap at 360 make it smaller."""
_OPPOSITE: Final = -0.3
"""Speed gained against throttle added: right records of 40 voyages came to 0.3 at least, in rivers, gusts and waves; reversed ones to less
than minus that."""
_WRONG_WAY: Final = -0.3
"""Rate of turn against a helm that is well over: right records came to 0.05 at least, boats with crossed leads to -0.35 at most."""
_GAINED_S: Final = 2.0
"""Over so long a hull gains way and hardly any stream changes, but for the bow's turn in it."""
_LEAST_THROTTLE, _LEAST_MPS = 0.1, 0.15
"""Standard deviations from which on throttle and speed tell anything of each other."""
_PER_MPS: Final = {"km/h": 3.6, "knots": 1.944, "cm/s": 100.0, "mm/s": 1000.0}
_LIKE_UNIT: Final = 0.15
"""A ratio so near to a unit's is taken for it."""
_ON_BOARD: Final = "look at sensors, leads and channels (companion check, COMMISSIONING), then sail it again"
_FEWEST: Final = 200
"""Steps: what shows in less than ten seconds is no evidence."""


_HELM_S: Final = 1.0
"""A hull turns about so long after its helm."""
_HELMS: Final[tuple[tuple[str, Callable[[Stretch], Array], float], ...]] = (
    ("port and starboard", lambda s: 0.5 * (s.port - s.starboard), 0.15),
    ("rudder", lambda s: s.rudder_rad, 0.1),
)
"""What turns a hull, and what of it is well over, in commands and radians."""


@dataclass(frozen=True, slots=True)
class _Likeness:
    """What one column is of another: how many times it, and how surely."""

    times: float
    correlation: float

    @staticmethod
    def of(one: Array, other: Array) -> _Likeness:
        sizes = float(np.mean(one * one)), float(np.mean(other * other))
        if min(sizes) <= 0.0:
            return _Likeness(math.inf, 0.0)
        correlation = float(np.mean(one * other)) / math.sqrt(sizes[0] * sizes[1])
        return _Likeness(math.copysign(math.sqrt(sizes[0] / sizes[1]), correlation), correlation)

    @property
    def good(self) -> bool:
        return self.correlation > _TOGETHER and _SCALE[0] < self.times < _SCALE[1]


def disbelieved(stretches: Sequence[Stretch], columns: Mapping[str, Column] | None = None) -> str:
    """Say which column cannot be what it is said to be, what was found, and the mend; "" when all may be.

    ``columns``: as they were named; None: of a run of the vessel's own, whose columns are right and whose sensors or leads are not.
    """
    for judge in (_heading, too_fast, _placed, _track, _ahead, _turned):
        if text := judge(stretches, RUN_COLUMNS if columns is None else columns):
            return text if columns is not None else f"{text.partition('; ')[0]}; {_ON_BOARD}"
    return ""


def _turns(stretch: Stretch) -> tuple[Array, Array]:
    """By how much the bow turned in each span, by the heading and by the rate."""
    from scipy.ndimage import median_filter

    span = round(_TURN_S / STEP_S)
    steps = 2 * round(0.5 * _SPIKE_S / STEP_S) + 1
    psi, rate = (median_filter(each, steps, mode="nearest") for each in (stretch.psi_rad, stretch.rate))
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * STEP_S])
    return psi[span:] - psi[:-span], summed[span:] - summed[:-span]


def _unlike(one: Array, other: Array) -> bool:
    """Whether two do not tell of the same, however it is looked at: a gyro's bias hides it from one look, spikes from another."""
    from scipy.stats import rankdata

    looks = [(one, other)]
    looks += [tuple(each - each.mean() for each in pair) for pair in ((one, other), (rankdata(one), rankdata(other)))]
    return all(abs(_Likeness.of(*look).correlation) < _TOGETHER for look in looks)


def _median_ratio(one: Array, other: Array) -> float:
    """How many times ``other`` one is, in the middle of the turns: what a few spikes hardly change."""
    turned = np.flatnonzero(other)
    ratios = one[turned] / other[turned]
    order = np.argsort(ratios)
    weights = np.cumsum(np.abs(other[turned])[order])
    return float(ratios[order][np.searchsorted(weights, 0.5 * weights[-1])])


def _heading(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    by_heading, by_rate = map(np.concatenate, zip(*map(_turns, stretches), strict=True))
    heading, rate = columns["heading"], columns["yaw_rate"]
    turned = [float(np.percentile(np.abs(each), 95)) for each in (by_heading, by_rate)]
    if max(turned) < _TURNS_RAD:
        return ""
    if min(turned) > _TURNS_MOST_RAD:
        degrees = [_scaled(name, columns[name], math.degrees(1.0)) for name in ("heading", "yaw_rate")]
        mend = f"--columns {' '.join(degrees).replace('--columns ', '')}"
        return f"she turns by {min(turned) / _TURN_S:.0f} rad/s; are heading and yaw_rate in degrees? then {mend}"
    found = _Likeness.of(by_heading, by_rate)
    if found.good:
        return ""
    pair = f"heading (column {heading.name}) and yaw_rate (column {rate.name})"
    if abs(found.correlation) < _TOGETHER:
        if max(turned) < _TURNS_SURELY_RAD or not _unlike(by_heading, by_rate):
            return ""
        return f"{pair} do not tell of the same turns (correlation {found.correlation:.2f}): is each the right column?"
    times = _median_ratio(by_heading, by_rate)
    said = f"{pair} disagree: heading turns {times:.3g} times as fast"
    if _DEGREES[0] < abs(times) < _DEGREES[1]:
        return f"{said}; is it in degrees? then {_scaled('heading', heading, math.degrees(1.0))}"
    if _DEGREES[0] < 1.0 / abs(times) < _DEGREES[1]:
        return f"{said}; is yaw_rate in degrees? then {_scaled('yaw_rate', rate, math.degrees(1.0))}"
    if times * found.correlation < 0.0:
        return ""
    if times > 0.0:
        if found.correlation < _SURELY or _SCALE[0] < times < _SCALE[1]:
            return ""
        return f"{said}; is the scale of yaw_rate right? {_scaled('yaw_rate', rate, 1.0 / times)} would be"
    return f"{said}; {_counted_backwards(stretches, columns)}"


def _counted_backwards(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """Which of heading and rate has the wrong sign: what the helm does to the rate tells, where anything does."""
    heading, rate = columns["heading"], columns["yaw_rate"]
    east = f"heading={heading.name},{heading.zero + 0.5 * math.pi * heading.scale:.5g},{-heading.scale:.5g}"
    mathematical = f"heading counted counter-clockwise, from east? then --columns {east}"
    reverse = f"yaw_rate to port? then {_scaled('yaw_rate', rate, -1.0)}"
    helms = [helm.correlation for helm in helms_of(stretches).values()]
    if helms and min(helms) > 0.0:
        return mathematical
    return reverse if helms and max(helms) < 0.0 else f"{mathematical}; or {reverse}"


def helms_of(stretches: Sequence[Stretch]) -> dict[str, _Likeness]:
    """How the rate of turn follows each helm, where that is well over: thrusters apart, rudder. Above zero is as it should be."""
    found = {}
    rate = np.concatenate([stretch.rate for stretch in stretches])
    for name, of, least in _HELMS:
        helm = np.concatenate([smooth(of(stretch), _HELM_S) for stretch in stretches])
        over = np.abs(helm) > least
        if over.sum() > _FEWEST:
            found[name] = _Likeness.of(rate[over], helm[over])
    return found


def _placed(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """Places in a mirror; where a helm turns her the other way it is her heading that is."""
    if any(helm.correlation < 0.0 for helm in helms_of(stretches).values()):
        return ""
    return mirrored(stretches, columns)


def _track(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """Speeds that are told apart from places are held against these."""
    for k, name in enumerate(("surge", "sway")):
        pairs = [
            (getattr(stretch, name), stretch.track[k])
            for stretch in stretches
            if stretch.track is not None and name in columns
        ]
        if pairs:
            said, made = map(np.concatenate, zip(*pairs, strict=True))
            if text := _unlike_track(name, columns[name], _Likeness.of(said, made), float(made.std())):
                return text
            if name == "surge" and (text := _never_astern(columns[name], said, made)):
                return text
    return ""


def _never_astern(column: Column, said: Array, made: Array) -> str:
    """A speed over ground has no sign: where she goes astern it tells way ahead."""
    astern = made < -_LEAST_MPS
    if astern.sum() < _FEWEST or said.min() < -_LEAST_MPS or np.median(said[astern]) < _LEAST_MPS:
        return ""
    if np.corrcoef(said[astern], made[astern])[0, 1] > -_TOGETHER:
        return ""
    return (
        f"surge (column {column.name}) is never below 0, and the places tell of way astern; "
        "is it a speed over ground (SOG)? then leave surge out of --columns: the places tell it"
    )


def _unlike_track(name: str, column: Column, found: _Likeness, spread_mps: float) -> str:
    # noisy places are like nothing: only what they surely tell otherwise is held against a column
    if spread_mps < _LEAST_MPS or found.good or abs(found.correlation) < _SURELY:
        return ""
    said = f"{name} (column {column.name}) is {found.times:.2f} times what the places tell"
    for unit, per_mps in _PER_MPS.items():
        if abs(found.times / per_mps - 1.0) < _LIKE_UNIT:
            return f"{said}; is it in {unit}? then {_scaled(name, column, per_mps)}"
    if abs(found.times + 1.0) < _LIKE_UNIT:
        return f"{said}; is its sign right? {_scaled(name, column, -1.0)} would be"
    return f"{said}; is its scale right? {_scaled(name, column, found.times)} would be"


def _ahead(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """She goes astern, and the more so the more is pushed ahead: the one a stream can feign, the other none."""
    pushed, speed = (np.concatenate(each) for each in zip(*map(_pushed, stretches), strict=True))
    if len(pushed) < _FEWEST or pushed.std() < _LEAST_THROTTLE or speed.std() < _LEAST_MPS:
        return ""
    correlation = _gained(stretches).correlation
    if correlation > _OPPOSITE or float(np.mean(pushed * speed)) >= 0.0:
        return ""
    said = f"she goes astern when the throttle pushes ahead (correlation {correlation:.2f})"
    return f"{said}; {' or '.join(_reversed(stretches, columns))}"


def _pushed(stretch: Stretch) -> tuple[Array, Array]:
    """Push and speed, at the steps that tell a speed."""
    told = np.isfinite(stretch.surge)
    return pushing(stretch)[told], stretch.surge[told]


def _gained(stretches: Sequence[Stretch]) -> _Likeness:
    """Speed gained against throttle added, without what a steady stream makes of the bow's turn: of that nobody knows the size."""
    span = round(_GAINED_S / STEP_S)
    rows = []
    for stretch in stretches:
        told = np.flatnonzero(np.isfinite(stretch.surge))
        if len(told) > 1 and len(stretch.surge) > span:
            speed = np.interp(np.arange(len(stretch.surge)), told, stretch.surge[told])
            push = pushing(stretch)
            each = np.stack([push, speed, np.cos(stretch.psi_rad), np.sin(stretch.psi_rad)], axis=1)
            rows.append(each[span:] - each[:-span])
    if not rows:
        return _Likeness(math.inf, 0.0)
    changes = np.concatenate(rows)
    own, bow = changes[:, :2], changes[:, 2:]
    push, speed = (own - bow @ np.linalg.lstsq(bow, own, rcond=None)[0]).T
    return _Likeness.of(speed, push)


def _reversed(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> Iterator[str]:
    """What may be the wrong way round: the throttles, where they turn her the wrong way too, or the motion."""
    apart = helms_of(stretches).get("port and starboard")
    if apart is None or apart.correlation > 0.0:
        if "surge" in columns and stretches[0].age_s is None:
            yield f"is the sign of surge right? {_scaled('surge', columns['surge'], -1.0)} would be"
        else:
            yield "is the heading back to front?"
    if apart is None or apart.correlation < 0.0:
        names = [name for name in ("port", "starboard") if name in columns]
        mends = " ".join(_scaled(name, columns[name], -1.0).removeprefix("--columns ") for name in names)
        yield f"is the sign of the throttle right? --columns {mends} would be"


def _turned(stretches: Sequence[Stretch], columns: Mapping[str, Column]) -> str:
    """A helm that turns her the other way."""
    for helm, found in helms_of(stretches).items():
        if found.correlation < _WRONG_WAY:
            if helm == "rudder":
                mend = f"is its sign right? {_scaled('rudder', columns['rudder'], -1.0)} would be"
            else:
                mend = f"are they swapped? then --columns {_swapped(columns)}"
            said = f"she turns to port where {helm} should turn her to starboard (correlation {found.correlation:.2f})"
            return f"{said}; {mend}; or are heading, yaw_rate and sway counted to port?"
    return ""


def _swapped(columns: Mapping[str, Column]) -> str:
    sides = ("port", "starboard")
    return " ".join(
        _scaled(side, columns[other], 1.0).removeprefix("--columns ")
        for side, other in zip(sides, sides[::-1], strict=True)
    )


def _scaled(name: str, column: Column, times: float) -> str:
    """The mend of a column that is so many times what it should be."""
    return f"--columns {name}={column.name},{column.zero:.5g},{column.scale * times:.5g}"
