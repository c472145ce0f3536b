"""Which of several sensors of one quantity counts: ranked, one used at a time, the others compared with it and told.

Every link, and on a link every talker and sentence, is a source of its own: two compasses on one line are two sources. The
choice is sticky. It moves on when the chosen one falls silent, and back only after a better one has been steady for 30 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, Severity, Source

Key = tuple[int, str]
"""A source: number of its link in the settings, address."""
Texts = list[tuple[Severity, str]]

_SETTLE_US: Final = 5_000_000
"""After the first value of a quantity the other sources have this long to show that there is a better one."""
_STEADY_US: Final = 30_000_000
"""A source that comes and goes never takes over from one that stays."""
SAY_EVERY_US: Final = 60_000_000
"""One condition is told at most so often: a stream of texts hides the alarm that matters."""
_SWITCH_EVERY_US: Final = 10_000_000
"""Two sources that fail in turn are told at most so often."""
_AGREE_US: Final = 10_000_000
"""Steadily together again for so long,"""
APART_US: Final = 5_000_000
"""and steadily apart for so long, before anybody is told."""
_AGAIN: Final = 2.0
"""Told anew when it has grown to so many times what was told: 9 degrees that have become 120 are another matter."""
_MEAN_US: Final = 3e6
"""Time constant of the mean difference: longer than a wave."""
_AGREE_SHARE: Final = 0.6
"""Together again well inside the limit, so that a difference at the limit does not chatter."""
_COMPARE_US: Final = 1_000_000
"""Values further apart in time are not compared: a boat turns 30 degrees in it."""
SOURCES_MAX: Final = 16
"""A line that invents talkers fills no memory."""
UNLABELLED: Final = Source()


def source_name(label: Source, link: int) -> str:
    """How texts name a source of a link."""
    return f"{label.link} {label.name or label.address}".strip() or f"sensor {link + 1}"


class _Heard:
    """How a source has been heard."""

    __slots__ = ("fault", "label", "last_us", "name", "order", "period_us", "since_us")

    def __init__(self, label: Source, link: int, t_us: int) -> None:
        self.relabel(label, link)
        self.since_us = self.last_us = t_us
        self.period_us = 0.0
        self.fault = ""
        """What it is given up for, in words."""

    def relabel(self, label: Source, link: int) -> None:
        """Take a source's name and rank, which may change while it stays the same source."""
        self.label = label
        self.name = source_name(label, link)
        self.order = (label.rank[0], link, *label.rank[1:])


class _Apart:
    """How far one source has been off the one used, and what the operator knows of it."""

    __slots__ = ("agree_us", "apart_us", "known", "last_us", "mean", "said", "said_us", "told")

    def __init__(self, off: float, t_us: int) -> None:
        self.mean = off
        self.last_us = t_us
        self.apart_us: int | None = None
        self.agree_us: int | None = None
        self.said = 0.0
        """The figure that was told last."""
        self.said_us: int | None = None
        self.known = self.told = False


class Choice:
    """The sources of one quantity. Silent means: not heard for two of its periods and ``least_s``, at most ``most_s``."""

    def __init__(
        self,
        what: str,
        texts: Texts,
        *,
        least_s: float,
        most_s: float,
        figure: Callable[[float], str] = "{:.1f}".format,
        wrap: Callable[[float], float] = float,
    ) -> None:
        """``what`` begins every text; ``figure`` makes words of a difference, such as 20 deg; ``wrap`` keeps it on the circle."""
        self.what = what
        self.chosen: Key | None = None
        self._texts = texts
        self._least_us, self._most_us = least_s * 1e6, most_s * 1e6
        self._heard: dict[Key, _Heard] = {}
        self._pairs: dict[tuple[Key, Key], _Apart] = {}
        self._figure, self._wrap = figure, wrap
        self._settle_until_us = 0
        self._told_us: int | None = None
        self._before: Key | None = None
        self.moved = False
        """True while ``leads`` has just moved to another source: what it reads is no jump, unless it was known to be off."""

    def leads(self, source: Source | None, link: int, t_us: int, *, trusted: bool = True) -> bool:
        """Note that a source gave a value; True when it is the one that counts.

        One that is not ``trusted`` steps in for a silent one, but never takes over from one that speaks.
        """
        self.moved = False
        label = UNLABELLED if source is None else source
        key = (link, label.address)
        heard = self._heard.get(key)
        if heard is None:
            if len(self._heard) >= SOURCES_MAX:
                return False
            heard = self._heard[key] = _Heard(label, link, t_us)
        else:
            if label is not heard.label:
                heard.relabel(label, link)
            self._note(heard, t_us)
        if heard.fault:
            return False
        if key == self.chosen:
            return True
        if self.chosen is None:
            self.chosen, self._settle_until_us = key, t_us + _SETTLE_US
            return True
        return self._takes_over(key, heard, t_us, trusted)

    def undo(self, source: Source | None, link: int) -> bool:
        """Go back to the source before, if this is it: what stepped in for it was not believed. True when that is so."""
        key = (link, "" if source is None else source.address)
        if key != self._before or key == self.chosen or self._heard[key].fault:
            return False
        self._before, self.chosen = self.chosen, key
        return True

    def bar(self, fault: str) -> None:
        """Give the chosen source up for a fault, in words: as if it were silent, until ``lift``."""
        if self.chosen is not None:
            self._heard[self.chosen].fault = fault

    def lift(self, key: Key, t_us: int) -> None:
        """The fault of a source is over."""
        heard = self._heard[key]
        heard.fault, heard.since_us = "", t_us

    def is_barred(self, source: Source | None, link: int) -> bool:
        """Whether a source is given up for a fault."""
        heard = self._heard.get((link, "" if source is None else source.address))
        return heard is not None and bool(heard.fault)

    def is_chosen(self, source: Source | None, link: int) -> bool:
        """Whether a source is the one that counts; True for all before any has."""
        return self.chosen is None or self.chosen == (link, "" if source is None else source.address)

    def silent(self, t_us: int) -> bool:
        """Whether the chosen source has fallen silent."""
        return self.chosen is None or self._is_silent(self._heard[self.chosen], t_us)

    def settles(self, t_us: int) -> bool:
        """Whether these are the first seconds of the quantity: rank alone says which one counts."""
        return t_us <= self._settle_until_us

    def others(self, t_us: int) -> list[Key]:
        """Those that speak beside the chosen one, the best first; none while the rhythms of the first seconds are not yet known."""
        if self.settles(t_us):
            return []
        live = [(heard.order, key) for key, heard in self._heard.items() if key != self.chosen]
        return [key for _, key in sorted(live) if not self._is_silent(self._heard[key], t_us)]

    def hand_over(self, key: Key, why: str, t_us: int) -> None:
        """Let another source lead at once, for a reason in words; the one before leads again when it has been steady from now on."""
        assert self.chosen is not None
        before = self._heard[self.chosen]
        before.since_us = t_us
        self._say(Severity.WARNING, f"{before.name} {before.fault or why}, using {self.name(key)}", t_us)
        self._before, self.chosen = self.chosen, key

    def is_known_off(self, key: Key) -> bool:
        """Whether a source is known to be off the chosen one, and it is not the chosen one that is known to be wrong."""
        if self.chosen is None or self._heard[self.chosen].fault:
            return False
        pair = self._pairs.get((key, self.chosen))
        return pair is not None and pair.known

    def apart(self, limit: float) -> str:
        """Which two are known to be apart by more than ``limit``, in words; empty where none are. Silence is no agreement."""
        for (key, used), pair in self._pairs.items():
            if pair.known and abs(pair.mean) > limit:
                return self._reads(pair.mean, key, used)
        return ""

    def _reads(self, off: float, key: Key, used: Key) -> str:
        more = f"{self._figure(abs(off))} {'more' if off > 0.0 else 'less'}"
        return f"{self.name(key)} reads {more} than {self.name(used)}"

    def period_s(self, key: Key) -> float:
        """How often a source speaks; 0 while it is not known."""
        return self._heard[key].period_us * 1e-6

    @property
    def patience_us(self) -> float:
        """How long the chosen source may be unheard before it counts as silent."""
        return self._most_us if self.chosen is None else self._patience_us(self._heard[self.chosen])

    @property
    def used(self) -> str:
        """Name of the source that counts; empty before there is one."""
        return "" if self.chosen is None else self.name(self.chosen)

    def name(self, key: Key) -> str:
        return self._heard[key].name

    def link(self, key: Key) -> str:
        """Name of the link of a source in the settings; empty where none is told."""
        return self._heard[key].label.link

    def compare(self, source: Source | None, link: int, off: float, limit: float, t_us: int) -> None:
        """Take how much a source reads more than the one used; told when the mean of 3 s stays beyond ``limit`` for 5 s.

        With the figure, at most once a minute for each pair, and again each time that it has doubled.
        """
        key, used = (link, "" if source is None else source.address), self.chosen
        if used is None or key == used or key not in self._heard:
            return
        pair = self._pairs.get((key, used))
        if pair is None:
            pair = self._pairs[(key, used)] = _Apart(off, t_us)
        share = (t_us - pair.last_us) / _MEAN_US
        pair.mean = self._wrap(pair.mean + min(max(share, 0.0), 1.0) * self._wrap(off - pair.mean))
        pair.last_us = t_us
        if abs(pair.mean) > limit:
            self._disagree(pair, key, used, t_us)
        elif abs(pair.mean) < _AGREE_SHARE * limit:
            self._agree(pair, key, used, t_us)

    def compare_newest(
        self,
        measured: EulerAngles | AngularVelocity | Distance,
        link: int,
        value: float,
        used: tuple[float, int] | None,
        limit: float,
    ) -> None:
        """``compare`` one value with the newest one used and its time, unless that is too old."""
        if used is not None and measured.t_us - used[1] < _COMPARE_US:
            self.compare(measured.source, link, value - used[0], limit, measured.t_us)

    def _disagree(self, pair: _Apart, key: Key, used: Key, t_us: int) -> None:
        pair.agree_us = None
        if pair.apart_us is None:
            pair.apart_us = t_us
        if t_us - pair.apart_us < APART_US:
            return
        pair.known = True
        is_new = pair.said_us is None or t_us - pair.said_us >= SAY_EVERY_US
        if abs(pair.mean) < _AGAIN * abs(pair.said) if pair.told else not is_new:
            return
        pair.told, pair.said, pair.said_us = True, pair.mean, t_us
        self._texts.append((Severity.WARNING, f"{self.what}: {self._reads(pair.mean, key, used)}, which is used"))

    def _agree(self, pair: _Apart, key: Key, used: Key, t_us: int) -> None:
        pair.apart_us = None
        if pair.agree_us is None:
            pair.agree_us = t_us
        if t_us - pair.agree_us < _AGREE_US:
            return
        pair.known = False
        if (used, key) in self._pairs:
            self._pairs[(used, key)].known = False
        if pair.told:
            pair.told = False
            self._texts.append((Severity.INFO, f"{self.what}: {self.name(key)} and {self.name(used)} agree again"))

    def _note(self, heard: _Heard, t_us: int) -> None:
        since_us = t_us - heard.last_us
        if since_us > self._patience_us(heard):
            heard.since_us = t_us
        if 0 < since_us < self._most_us:
            # What comes twice at one moment, as one datagram, is no rhythm.
            heard.period_us += (0.2 if since_us < heard.period_us else 1.0) * (since_us - heard.period_us)
        heard.last_us = t_us

    def _patience_us(self, heard: _Heard) -> float:
        if not heard.period_us:
            return self._most_us  # heard once: its rhythm is not known
        return min(max(self._least_us, 2.0 * heard.period_us + 100_000.0), self._most_us)

    def _is_silent(self, heard: _Heard, t_us: int) -> bool:
        return bool(heard.fault) or t_us - heard.last_us > self._patience_us(heard)

    def _takes_over(self, key: Key, heard: _Heard, t_us: int, trusted: bool) -> bool:
        assert self.chosen is not None
        before = self._heard[self.chosen]
        if self._is_silent(before, t_us):
            live = (other for other in self._heard.values() if not self._is_silent(other, t_us))
            if min(live, key=lambda other: other.order) is not heard:
                return False  # a better one is alive and is going to speak for itself
            self.moved = not self.is_known_off(key)
            self._say(Severity.WARNING, f"{before.name} {before.fault or 'silent'}, using {heard.name}", t_us)
        elif not trusted or heard.order >= before.order:
            return False
        elif not self.settles(t_us):
            if t_us - heard.since_us < _STEADY_US:
                return False
            self.moved = True
            self._say(Severity.INFO, f"using {heard.name}, no longer {before.name}", t_us)
        else:
            self.moved = True
        self._before, self.chosen = self.chosen, key
        return True

    def _say(self, severity: Severity, text: str, t_us: int) -> None:
        if self._told_us is None or t_us - self._told_us >= _SWITCH_EVERY_US:
            self._told_us = t_us
            self._texts.append((severity, f"{self.what}: {text}"))


def degrees(angle_rad: float) -> str:
    """A difference of angles in words."""
    return f"{math.degrees(angle_rad):.0f} deg"


def degrees_a_second(rate_radps: float) -> str:
    """A difference of turn rates in words."""
    return f"{math.degrees(rate_radps):.1f} deg/s"
