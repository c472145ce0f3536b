"""The receivers: which one counts, and whether they agree on where the vessel is, each antenna taken for where it sits."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple

from mavlink_bridge.language.geodesy import MEAN_RADIUS_M, inverse
from mavlink_bridge.language.messages import FixType, GpsFix, Severity

from ..hull.geometry import Arm
from .antenna import NO_ARM, Attitude, lever
from .config import POSITION_ACCURACY_M
from .doubts.in_turn import InTurn
from .sources import APART_US, SAY_EVERY_US, SOURCES_MAX, UNLABELLED, Choice, Key, Texts, source_name

_SIGMAS: Final = 3.0
"""Beyond three times what both say of their accuracy they cannot both be right."""
_FRESH_US: Final = 2_000_000
"""Two fixes at 1 Hz."""
_UNSURE_SHARE: Final = 0.2
"""Of what lies between two antennas: a magnetic compass 8 degrees off, a heel that nobody tells, a tape that sags."""
_IN_TURN: Final = (2.0, 5.0)
"""Two antennas that are further apart than this are told to be two under one name, where the place goes to and fro faster than the mast of
a small boat that rolls by 30 degrees. How fast she sails does not matter: she does not come back at each second fix."""
_Two = tuple[Key, Key]
"""Two receivers, in the order of their keys."""
_NEAR_M: Final = 10.0
"""Two receivers nearer than this may be exact, and their antennas apart on one hull."""


class FixChoice:
    """The receivers: a receiver without a fix does not lead, and any two with one are compared.

    Disagreement is declared after 5 s beyond three times the joint accuracy (hacc when the receiver gives it), less what lies
    between their antennas. It ends when they lie together by two fixes of each: one may be the last of a receiver that fell silent.
    """

    def __init__(
        self,
        texts: Texts,
        antenna_of: Callable[[int], Arm] = lambda link: NO_ARM,
        attitude_at: Callable[[int], Attitude] = lambda t_us: Attitude(),
        is_acceptable: Callable[[GpsFix], bool] = lambda fix: fix.has_position,
    ) -> None:
        """``antenna_of`` a link's number: where its antenna is. ``attitude_at`` a time: the compass's, unknown without one.

        ``is_acceptable``: whether a fix is of a kind that is sailed on; a receiver that has no other does not lead.
        """
        self._texts, self._is_acceptable = texts, is_acceptable
        self._antenna_of, self._attitude_at = antenna_of, attitude_at
        self._choice = Choice("Position", texts, least_s=0.8, most_s=3.0)
        self._in_turn = InTurn(texts, ("Position", "receivers"), *_IN_TURN, figure=_metres)
        self._fixes: dict[Key, GpsFix] = {}
        self._changed_us: dict[Key, int] = {}
        """When a receiver last told another place than before."""
        self._since_us: dict[_Two, int] = {}
        """Since when two receivers have been apart."""
        self._apart: dict[_Two, float] = {}
        """How far apart those were last, m, that were so for long enough: until they agree."""
        self._fits_us: dict[_Two, int] = {}
        """Of those apart: the time of the fix of one that the other's has lain together with, and not been apart from any since."""
        self._told: set[_Two] = set()
        self._unheard: set[_Two] = set()
        """Of those apart: that one of them fell silent is told."""
        self._said_us: int | None = None
        self._nowhere_us: int | None = None
        self.moved = False
        """Whether the last ``leads`` has just moved to a receiver that was not known to be off."""

    @property
    def disagree(self) -> bool:
        """Whether two receivers have been apart for 5 s and more, and have not agreed since: silence is no agreement."""
        return bool(self._apart)

    @property
    def used(self) -> str:
        """Name of the receiver that counts; empty before there is one."""
        return self._choice.used

    def somewhere(self, fix: GpsFix, link: int) -> GpsFix:
        """A fix, without its position where that is 0 N 0 E to the last digit: broken receivers say so and call it valid."""
        if fix.lat_rad != 0.0 or fix.lon_rad != 0.0 or not fix.has_position:
            return fix
        if self._nowhere_us is None or fix.t_us - self._nowhere_us > SAY_EVERY_US:
            label = UNLABELLED if fix.source is None else fix.source
            text = f"Receiver {source_name(label, link)} says 0 N 0 E: taken for no fix"
            self._texts.append((Severity.WARNING, text))
        self._nowhere_us = fix.t_us
        return replace(fix, fix_type=FixType.NONE, lat_rad=None, lon_rad=None)

    def leads(self, link: int, fix: GpsFix) -> bool:
        """Note a fix; True when its receiver is the one that counts."""
        self.moved = False
        if not self._is_acceptable(fix):
            return self._choice.is_chosen(fix.source, link) or self._choice.silent(fix.t_us)
        label = fix.source or UNLABELLED
        key = (link, label.address)
        lat_rad, lon_rad = _place(fix)
        place = MEAN_RADIUS_M * complex(lat_rad, lon_rad * math.cos(lat_rad))
        self._in_turn.take(key, source_name(label, link), fix.t_us, place)
        before = self._choice.chosen
        is_known_off = before is not None and _two(key, before) in self._apart
        lead = self._choice.leads(fix.source, link, fix.t_us, trusted=not is_known_off)
        self.moved = self._choice.moved and not is_known_off
        if key in self._fixes or len(self._fixes) < SOURCES_MAX:
            last = self._fixes.get(key)
            if last is None or (last.lat_rad, last.lon_rad) != (fix.lat_rad, fix.lon_rad):
                self._changed_us[key] = fix.t_us
            self._fixes[key] = fix
            if len(self._fixes) > 1:
                self._compare(fix, key)
        return lead

    def stand_in(
        self, now_us: int, why: str, expects: Callable[[GpsFix], bool] | None, *, lively: bool = False
    ) -> tuple[int, GpsFix] | None:
        """The position is lost: let the best of the others that speak lead at once, and return its link and newest fix.

        ``why``: what the one before is given up for. ``expects``: whether the vessel may be where a fix says, where the one before is
        known to be wrong; else only one leads that agreed with it. ``lively``: and only one whose place has just changed.
        """
        choice = self._choice
        for key in choice.others(now_us):
            fix = self._fixes.get(key)
            if fix is None or choice.chosen is None:
                continue
            is_sound = expects(fix) if expects is not None else _two(key, choice.chosen) not in self._apart
            if is_sound and not (lively and now_us - self._changed_us[key] > _FRESH_US):
                choice.hand_over(key, why, now_us)
                return key[0], fix
        return None

    def contradicted_by(self, fix: GpsFix) -> str:
        """Name of another receiver that is against a fix of the one used; empty when none is."""
        used = self._choice.chosen
        for other, reference in self._fixes.items():
            if used is None or other == used or abs(fix.t_us - reference.t_us) > _FRESH_US:
                continue
            if _gap(fix, reference, self._between(used[0], other[0], fix.t_us)).is_apart:
                return self._choice.name(other)
        return ""

    @property
    def period_s(self) -> float:
        """How often the receiver that counts speaks; 0 while it is not known."""
        return 0.0 if self._choice.chosen is None else self._choice.period_s(self._choice.chosen)

    def _compare(self, fix: GpsFix, key: Key) -> None:
        """Compare with the one used, and with those that it was apart from: silence is no agreement, and another one used no excuse."""
        used = self._choice.chosen
        assert used is not None
        others = {one if two == key else two for one, two in (*self._since_us, *self._apart) if key in (one, two)}
        for other in sorted(others | {used} - {key}):
            two, reference = _two(key, other), self._fixes.get(other)
            if reference is None or fix.t_us - reference.t_us > _FRESH_US:
                self._miss(two, key, other)
            elif key != used:
                self._judge(two, fix, reference, key=key, used=other)

    def _judge(self, two: _Two, fix: GpsFix, reference: GpsFix, *, key: Key, used: Key) -> None:
        gap = _gap(fix, reference, self._between(key[0], used[0], fix.t_us))
        if gap.is_apart:
            self._part(two, gap.distance_m, key=key, used=used, t_us=fix.t_us)
        elif two not in self._apart:
            self._since_us.pop(two, None)
        elif gap.is_together and self._fits_us.setdefault(two, reference.t_us) != reference.t_us:
            self._agree(two)

    def _part(self, two: _Two, distance_m: float, *, key: Key, used: Key, t_us: int) -> None:
        self._fits_us.pop(two, None)
        if two in self._apart:
            self._apart[two] = distance_m
        elif t_us - self._since_us.setdefault(two, t_us) >= APART_US:
            self._apart[two] = distance_m
            self._tell(distance_m, key, used, t_us)

    def _miss(self, two: _Two, key: Key, silent: Key) -> None:
        """One of two that were apart has fallen silent; the other one speaks."""
        self._since_us.pop(two, None)
        self._fits_us.pop(two, None)
        if two in self._told and two not in self._unheard:
            self._unheard.add(two)
            name, apart_m = self._choice.name, self._apart[two]
            text = f"Positions disagreed: {name(silent)} is silent, it was {_metres(apart_m)} from {name(key)}"
            self._texts.append((Severity.WARNING, text))

    def _between(self, link: int, used: int, t_us: int) -> tuple[float, float, float]:
        """How far a link's antenna is from that of the one used, north and east, and what is not known of it, m."""
        here, there = self._antenna_of(link), self._antenna_of(used)
        if here == there:
            return 0.0, 0.0, 0.0
        apart = (here[0] - there[0], here[1] - there[1], here[2] - there[2])
        attitude, apart_m = self._attitude_at(t_us), math.hypot(*apart)
        if attitude.psi_rad is None:
            return 0.0, 0.0, apart_m
        return *lever(apart, attitude, attitude.psi_rad), _UNSURE_SHARE * apart_m

    def _tell(self, distance_m: float, other: Key, used: Key, t_us: int) -> None:
        if self._said_us is not None and t_us - self._said_us < SAY_EVERY_US:
            return
        self._said_us = t_us
        self._told.add(_two(other, used))
        name = self._choice.name
        text = f"Positions disagree: {name(other)} is {_metres(distance_m)} from {name(used)}, which is used"
        link = self._choice.link(other)
        is_bare = other[0] != used[0] and self._antenna_of(other[0]) == self._antenna_of(used[0])
        if distance_m < _NEAR_M and link and is_bare:
            text += f"; mounted so? set [mounts.{link}.antenna]"
        self._texts.append((Severity.WARNING, text))

    def _agree(self, two: _Two) -> None:
        for kept in (self._since_us, self._fits_us, self._apart):
            kept.pop(two, None)
        self._unheard.discard(two)
        if two in self._told:
            self._told.discard(two)
            name, used = self._choice.name, self._choice.chosen
            first, second = reversed(two) if two[0] == used else two
            self._texts.append((Severity.INFO, f"Receivers {name(first)} and {name(second)} agree again"))


def _two(one: Key, other: Key) -> _Two:
    return (one, other) if one < other else (other, one)


def _metres(distance_m: float) -> str:
    return f"{distance_m:.{int(distance_m < _NEAR_M)}f} m"


class _Gap(NamedTuple):
    """How far apart two fixes are, and what explains it, m."""

    distance_m: float
    allowed_m: float
    """By their accuracy, and by what is not known of their antennas."""
    slack_m: float
    """What the older one may be off, carried on by its course and speed: it grows while a receiver is silent."""

    @property
    def is_apart(self) -> bool:
        return self.distance_m > self.allowed_m + self.slack_m

    @property
    def is_together(self) -> bool:
        """The slack excuses a distance, but it is no sign that there is none."""
        return self.distance_m <= self.allowed_m


def _gap(first: GpsFix, second: GpsFix, between: tuple[float, float, float]) -> _Gap:
    """Compare two fixes at the time of the first.

    ``between``: how far the first one's antenna is from the other, north and east, and what is not known of it, m.
    """
    lat_rad, lon_rad = _place(second)
    north_m, east_m, unsure_m = between
    later_us = first.t_us - second.t_us
    if first.utc_us is not None and second.utc_us is not None and abs(first.utc_us - second.utc_us) <= _FRESH_US:
        later_us = first.utc_us - second.utc_us  # one receiver may tell later than the other
    if second.sog_mps is not None and second.cog_rad is not None:
        moved_m = second.sog_mps * later_us * 1e-6
        north_m += moved_m * math.cos(second.cog_rad)
        east_m += moved_m * math.sin(second.cog_rad)
    lat_rad += north_m / MEAN_RADIUS_M
    lon_rad += east_m / (MEAN_RADIUS_M * max(math.cos(lat_rad), 1e-6))
    distance_m, _ = inverse(*_place(first), lat_rad, lon_rad)
    slack_m = abs(later_us) * 1e-6 * max(first.sog_mps or 0.0, second.sog_mps or 0.0)
    return _Gap(distance_m, _SIGMAS * math.hypot(_accuracy(first), _accuracy(second)) + unsure_m, slack_m)


def _place(fix: GpsFix) -> tuple[float, float]:
    assert fix.lat_rad is not None
    assert fix.lon_rad is not None
    return fix.lat_rad, fix.lon_rad


def _accuracy(fix: GpsFix) -> float:
    return fix.hacc_m if fix.hacc_m is not None else POSITION_ACCURACY_M[fix.fix_type]
