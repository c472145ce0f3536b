"""What must come of a scenario: expectations on the truth, on the board's pins and on what the vessel says, and their judge.

At the end of a run each expectation looks at the logbook's rows of its window and gives a ``Finding``: what was found, what
the limit is, and whether it holds. Nothing found is never a pass.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from pydantic import Field, model_validator

from companion.core.config import Config
from mavlink_bridge.language.figures import Circle
from mavlink_bridge.language.messages import Action, GuardState, Mode, PlanState
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.traffic import Danger, Role
from mavlink_bridge.language.units import wrap_pi

from .log import Logbook, TickRow
from .pins import Pulses, in_words

Number = float | int | None
Found = float | str | None


class Spot(Config):
    """A point and a distance from it, m."""

    north_m: float
    east_m: float
    m: float = Field(ge=0)


class Expect(Config):
    """One expectation: exactly one quantity, in a window of time, on one plan item or all."""

    from_s: float | None = Field(None, ge=0)
    to_s: float | None = Field(None, ge=0)
    item: int | None = Field(None, ge=0)
    """Number of the plan item, from 0, for errors of paths; without it all items count."""
    within_s: float | None = Field(None, gt=0)
    """For text, cause, action and mode: so long after ``from_s`` at the latest."""

    radius_error_rms_m_max: float | None = None
    radius_error_max_m_max: float | None = None
    """Circles, from when they are first reached."""
    path_error_rms_m_max: float | None = None
    path_error_max_m_max: float | None = None
    """Any loiter: distance to its figure, for a hover to its point."""
    cross_track_rms_m_max: float | None = None
    cross_track_max_m_max: float | None = None
    """Legs from one way-point to the next."""
    turns_min: float | None = None
    """Turns sailed about the centre of a circle."""
    lowest_altitude_m_min: float | None = None
    """Water under the keel."""
    distance_from_start_m_max: float | None = None
    distance_from_start_m_min: float | None = None
    """Furthest from the start."""
    distance_sailed_m_min: float | None = None
    stays_out_of: Spot | None = None
    stays_within: Spot | None = None
    comes_to: Spot | None = None
    ends_within: Spot | None = None
    speed_mps_max: float | None = None
    speed_mps_min: float | None = None
    """Over ground: the highest, and the highest must reach."""
    final_speed_mps_max: float | None = None
    clearance_m_min: float | None = None
    """To the hull of every other vessel, by the truth."""
    role: Literal["head_on", "give_way", "stand_on", "overtaking", "overtaken", "obstacle"] | None = None
    """The vessel takes this role towards another one."""
    danger: Literal["risk", "close"] | None = None
    """The vessel tells this of another one."""
    no_danger: Literal[True] | None = None
    """It tells nothing of others."""
    neutral_within_s: float | None = Field(None, gt=0)
    """After ``from_s``, measured at the board's pins: thrusters stopped and rudders centred."""
    stays_neutral: Literal[True] | None = None
    under_way: Literal[True] | None = None
    """Not neutral for at least half of the window."""
    final_pulses: Pulses | None = None
    """At the board's pins at the end of the window."""
    guard: str | None = None
    """The depth guard comes into this state in the window."""
    never_guard: str | None = None
    """It never does."""
    final_mode: str | None = None
    final_armed: bool | None = None
    final_guard: str | None = None
    mode: str | None = None
    """Comes about in the window."""
    plan_state: str | None = None
    """At the end of the window."""
    item_reached: int | None = Field(None, ge=0)
    text: str | None = None
    """The vessel says something that holds this."""
    no_text: str | None = None
    cause: str | None = None
    """A failsafe condition acts or warns; docs/SAFETY.md has the names."""
    action: str | None = None
    """At least this failsafe action comes about."""
    action_max: str | None = None
    """No action above this one."""
    no_failsafe: Literal[True] | None = None
    """No action above WARN."""

    @property
    def quantity(self) -> str:
        """Which quantity it is."""
        return next(key for key in QUANTITIES if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _one(self) -> Expect:
        named = [key for key in QUANTITIES if getattr(self, key) is not None]
        if len(named) != 1:
            raise ValueError(f"name exactly one quantity, not {', '.join(named) or 'none'}; see docs/SCENARIOS.md")
        if self.within_s is not None and named[0] not in _TIMED:
            raise ValueError(f"within_s is for {', '.join(_TIMED)}")
        return self

    @model_validator(mode="after")
    def _names(self) -> Expect:
        _among(self, ("action", "action_max"), [action.name for action in Action])
        _among(self, ("mode", "final_mode"), [mode.value for mode in Mode])
        _among(self, ("plan_state",), [state.name for state in PlanState])
        _among(self, ("guard", "never_guard", "final_guard"), [guard.name for guard in GuardState])
        return self


def _among(expect: Expect, keys: Sequence[str], known: list[str]) -> None:
    for key in keys:
        value = getattr(expect, key)
        if value is not None and value.lower() not in [name.lower() for name in known]:
            raise ValueError(f"{key} {value!r}: choose one of {', '.join(known)}")


@dataclass(frozen=True, slots=True)
class Finding:
    """One judged expectation."""

    what: str
    found: Found
    limit: Found
    passed: bool


def judge(expects: Sequence[Expect], log: Logbook) -> tuple[Finding, ...]:
    """Hold every expectation against the run."""
    return tuple(_judge(expect, log) for expect in expects)


def _judge(expect: Expect, log: Logbook) -> Finding:
    name = expect.quantity
    first, last = expect.from_s or 0.0, math.inf if expect.to_s is None else expect.to_s
    rows = [row for row in log.rows if first - 1e-6 <= row.t_s <= last + 1e-6]
    if expect.item is not None:
        rows = [row for row in rows if row.snapshot.progress.seq == expect.item]
    limit = getattr(expect, name)
    found, shown, passed = QUANTITIES[name](rows, limit, expect) if rows else (None, _plain(limit), False)
    return Finding(_describe(expect, name), found, shown, passed)


def _describe(expect: Expect, name: str) -> str:
    words = [name]
    if expect.item is not None:
        words.append(f"item {expect.item}")
    if expect.from_s is not None:
        words.append(f"from {expect.from_s:g} s")
    if expect.to_s is not None:
        words.append(f"to {expect.to_s:g} s")
    return ", ".join(words)


def _plain(limit: Any) -> Found:
    if isinstance(limit, Spot):
        return f"{limit.m:g} m of ({limit.north_m:g}, {limit.east_m:g})"
    if isinstance(limit, Pulses):
        return limit.shown
    return "yes" if limit is True else "no" if limit is False else limit


# ---- quantities: rows, limit, expectation -> (found, limit as shown, passed)

Verdict = tuple[Found, Found, bool]
Rows = list[TickRow]
Judge = Callable[[Rows, Any, Expect], Verdict]


def _most(measure: Callable[[Rows], Number]) -> Judge:
    def judged(rows: Rows, limit: float, expect: Expect) -> Verdict:
        found = measure(rows)
        return _round(found), limit, found is not None and found <= limit

    return judged


def _least(measure: Callable[[Rows], Number]) -> Judge:
    def judged(rows: Rows, limit: float, expect: Expect) -> Verdict:
        found = measure(rows)
        return _round(found), limit, found is not None and found >= limit

    return judged


def _round(value: Number) -> float | None:
    return None if value is None else round(float(value), 3)


def _rms(errors: Iterator[float]) -> float | None:
    values = list(errors)
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else None


def _worst(errors: Iterator[float]) -> float | None:
    return max(map(abs, errors), default=None)


def _circles(rows: Rows) -> Iterator[float]:
    for row in rows:
        if row.loiter is not None and isinstance(row.loiter.figure, Circle) and row.path_error_m is not None:
            yield row.path_error_m


def _figures(rows: Rows) -> Iterator[float]:
    return (row.path_error_m for row in rows if row.path_error_m is not None)


def _legs(rows: Rows) -> Iterator[float]:
    for row in rows:
        if row.leg is None:
            continue
        (n0, e0), (n1, e1) = row.leg
        length_m = math.hypot(n1 - n0, e1 - e0)
        if length_m > 1e-6:
            yield ((n1 - n0) * (row.east_m - e0) - (e1 - e0) * (row.north_m - n0)) / length_m


def _turns(rows: Rows) -> float:
    bearings = [row.bearing_rad for row in rows if row.bearing_rad is not None]
    turned = sum(wrap_pi(after - before) for before, after in itertools.pairwise(bearings))
    return abs(turned) / math.tau


def _away(rows: Rows, north_m: float = 0.0, east_m: float = 0.0) -> list[float]:
    return [math.hypot(row.north_m - north_m, row.east_m - east_m) for row in rows]


def _sailed(rows: Rows) -> float:
    return sum(math.dist((a.north_m, a.east_m), (b.north_m, b.east_m)) for a, b in itertools.pairwise(rows))


def _altitude(rows: Rows) -> float | None:
    return min((row.altitude_m for row in rows if row.altitude_m is not None), default=None)


def _clearance(rows: Rows) -> float | None:
    return min((row.clearance_m for row in rows if row.clearance_m is not None), default=None)


def _no_danger(rows: Rows, limit: bool, expect: Expect) -> Verdict:
    told = next((row for row in rows if row.snapshot.traffic.threats), None)
    return "none told" if told is None else f"told at {told.t_s:.2f} s", "none told", told is None


def _spot(pick: Callable[[list[float]], float], *, inside: bool) -> Judge:
    def judged(rows: Rows, limit: Spot, expect: Expect) -> Verdict:
        found = pick(_away(rows, limit.north_m, limit.east_m))
        return _round(found), _plain(limit), (found <= limit.m) if inside else (found > limit.m)

    return judged


def _neutral_within(rows: Rows, limit: float, expect: Expect) -> Verdict:
    """The moment from which it is neutral: it must last for half a second, so that a pulse through the middle is none."""
    start_s = expect.from_s or 0.0
    since: float | None = None
    for row in rows:
        since = (row.t_s if since is None else since) if row.neutral else None
        if since is not None and row.t_s - since >= 0.5:
            return round(since - start_s, 3), limit, since - start_s <= limit + 1e-6
    return None, limit, False


def _final_pulses(rows: Rows, limit: Pulses, expect: Expect) -> Verdict:
    found = rows[-1].pulses_us
    return in_words(found), limit.shown, limit.hold(found)


def _never_guard(rows: Rows, limit: str, expect: Expect) -> Verdict:
    when = next((row.t_s for row in rows if row.snapshot.guard.name.lower() == limit.lower()), None)
    return "never" if when is None else f"at {when:.2f} s", f"never {limit}", when is None


def _stays_neutral(rows: Rows, limit: bool, expect: Expect) -> Verdict:
    moved = next((row.t_s for row in rows if not row.neutral), None)
    return "yes" if moved is None else f"moves at {moved:.2f} s", "yes", moved is None


def _under_way(rows: Rows, limit: bool, expect: Expect) -> Verdict:
    share = sum(not row.neutral for row in rows) / len(rows)
    return f"{share:.0%}", "50%", share >= 0.5


def _final(read: Callable[[Snapshot], str]) -> Judge:
    def judged(rows: Rows, limit: Any, expect: Expect) -> Verdict:
        found, wanted = read(rows[-1].snapshot), str(_plain(limit))
        return found, wanted, found.lower() == wanted.lower()

    return judged


def _happens(test: Callable[[Snapshot, Any], bool]) -> Judge:
    def judged(rows: Rows, limit: Any, expect: Expect) -> Verdict:
        start_s = expect.from_s or 0.0
        when = next((row.t_s - start_s for row in rows if test(row.snapshot, limit)), None)
        shown = f"{limit}" if expect.within_s is None else f"{limit} within {expect.within_s:g} s"
        passed = when is not None and (expect.within_s is None or when <= expect.within_s + 1e-6)
        return "never" if when is None else f"after {when:.2f} s", shown, passed

    return judged


def _says(snapshot: Snapshot, wanted: str) -> bool:
    return any(wanted.lower() in text.text.lower() for text in snapshot.texts)


def _no_text(rows: Rows, limit: str, expect: Expect) -> Verdict:
    when = next((row.t_s for row in rows if _says(row.snapshot, limit)), None)
    return "never said" if when is None else f"said at {when:.2f} s", f"never '{limit}'", when is None


def _highest(rows: Rows, limit: Any, expect: Expect) -> Verdict:
    top = Action.WARN if limit is True else Action[limit.upper()]
    worst = max(rows, key=lambda row: row.snapshot.action).snapshot
    causes = f" ({', '.join(worst.causes)})" if worst.action > top else ""
    return f"{worst.action.name}{causes}", f"at most {top.name}", worst.action <= top


QUANTITIES: Final[dict[str, Judge]] = {
    "radius_error_rms_m_max": _most(lambda rows: _rms(_circles(rows))),
    "radius_error_max_m_max": _most(lambda rows: _worst(_circles(rows))),
    "path_error_rms_m_max": _most(lambda rows: _rms(_figures(rows))),
    "path_error_max_m_max": _most(lambda rows: _worst(_figures(rows))),
    "cross_track_rms_m_max": _most(lambda rows: _rms(_legs(rows))),
    "cross_track_max_m_max": _most(lambda rows: _worst(_legs(rows))),
    "turns_min": _least(_turns),
    "lowest_altitude_m_min": _least(_altitude),
    "distance_from_start_m_max": _most(lambda rows: max(_away(rows))),
    "distance_from_start_m_min": _least(lambda rows: max(_away(rows))),
    "distance_sailed_m_min": _least(_sailed),
    "stays_out_of": _spot(min, inside=False),
    "stays_within": _spot(max, inside=True),
    "comes_to": _spot(min, inside=True),
    "ends_within": _spot(lambda away: away[-1], inside=True),
    "speed_mps_max": _most(lambda rows: max(row.speed_mps for row in rows)),
    "speed_mps_min": _least(lambda rows: max(row.speed_mps for row in rows)),
    "final_speed_mps_max": _most(lambda rows: rows[-1].speed_mps),
    "clearance_m_min": _least(_clearance),
    "role": _happens(lambda snapshot, role: any(each.role is Role[role.upper()] for each in snapshot.traffic.threats)),
    "danger": _happens(
        lambda snapshot, danger: any(each.danger is Danger[danger.upper()] for each in snapshot.traffic.threats)
    ),
    "no_danger": _no_danger,
    "neutral_within_s": _neutral_within,
    "stays_neutral": _stays_neutral,
    "under_way": _under_way,
    "final_pulses": _final_pulses,
    "guard": _happens(lambda snapshot, state: snapshot.guard.name.lower() == state.lower()),
    "never_guard": _never_guard,
    "final_mode": _final(lambda snapshot: snapshot.mode.value),
    "final_armed": _final(lambda snapshot: "yes" if snapshot.armed else "no"),
    "final_guard": _final(lambda snapshot: snapshot.guard.name),
    "mode": _happens(lambda snapshot, mode: snapshot.mode.value.lower() == mode.lower()),
    "plan_state": _final(lambda snapshot: snapshot.progress.state.name),
    "item_reached": _happens(lambda snapshot, item: item in snapshot.progress.reached),
    "text": _happens(_says),
    "no_text": _no_text,
    "cause": _happens(lambda snapshot, cause: cause in snapshot.causes),
    "action": _happens(lambda snapshot, action: snapshot.action >= Action[action.upper()]),
    "action_max": _highest,
    "no_failsafe": _highest,
}
_TIMED: Final = ("guard", "mode", "item_reached", "text", "cause", "action", "role", "danger")
