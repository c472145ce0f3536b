"""What the operator hears about an NMEA line: texts when its condition changes, never a stream of them."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Severity

from .sentences import EPOCH_KINDS

_WINDOW_US: Final = 5_000_000
"""Damage is judged over this: a hundred lines of a usual compass."""
_SILENT_MIN_US: Final = 3_000_000
"""A receiver of 1 Hz that misses two is not silent yet."""
_SILENT_PERIODS: Final = 5
"""Nor is a slower sentence that misses four of its own."""
_SEEN_MIN: Final = 5
"""Fewer give no rhythm."""
_BAD_MIN: Final = 5
"""Fewer bad lines are a plug that was moved."""
_BAD_SHARE: Final = 0.05
"""From one in twenty on the line wants mending."""
_NAMES_MAX: Final = 64
"""A line that invents sentences fills no memory."""


class SentenceRhythm:
    """How often one sentence has come, when last, and how regularly."""

    __slots__ = ("count", "group", "last_us", "period_us", "silent")

    def __init__(self, group: str) -> None:
        self.group = group
        """Addresses that stand in for each other: the sentence of a receiver, whatever its talker is just now."""
        self.count = 0
        self.last_us = 0
        self.period_us = 0.0
        self.silent = False

    def heard(self, now_us: int) -> None:
        """Note one good sentence."""
        if self.count:
            self.period_us += 0.1 * (now_us - self.last_us - self.period_us)
        self.count += 1
        self.last_us = now_us


class NmeaWatch:
    """Learns the rhythm of each sentence and reports silence, damage and other standing conditions on change."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.texts: list[tuple[Severity, str]] = []
        self._rhythms: dict[str, SentenceRhythm] = {}
        self._conditions: dict[str, bool] = {}
        self._any_silent = False
        self._away_us: int | None = None
        """Since when the whole line is silent, as far as the operator knows."""
        self._window_us: int | None = None
        self._good_before = 0
        self._bad_before = 0
        self._bytes_before = 0
        self._impossible, self._impossible_address = 0, ""

    def rhythm(self, address: str) -> SentenceRhythm:
        """The rhythm of an address, e.g. ``GPGGA``; more than 64 addresses are not followed."""
        rhythm = self._rhythms.get(address)
        if rhythm is None:
            rhythm = SentenceRhythm(address[2:] if address[2:] in EPOCH_KINDS else address)
            # A stranger could invent addresses for ever.
            if len(self._rhythms) < _NAMES_MAX:
                self._rhythms[address] = rhythm
        return rhythm

    def counts(self) -> dict[str, int]:
        """Good sentences per address."""
        return {address: rhythm.count for address, rhythm in self._rhythms.items() if rhythm.count}

    def ages_s(self, now_us: int) -> dict[str, float]:
        """Seconds since each sentence was last heard."""
        return {address: (now_us - rhythm.last_us) / 1e6 for address, rhythm in self._rhythms.items() if rhythm.count}

    def set_condition(self, key: str, present: bool, text: str, cleared: str) -> None:
        """Report a standing condition when it begins and when it ends."""
        if present != self._conditions.get(key, False):
            self._conditions[key] = present
            severity = Severity.WARNING if present else Severity.INFO
            self._say(severity, text if present else cleared)

    def impossible(self, address: str) -> None:
        """A sentence that arrived sound says what cannot be: that is no matter of the cable."""
        self._impossible += 1
        self._impossible_address = address

    def check(self, now_us: int, good: int, bad: int, received_bytes: int) -> None:
        """Look for silence at once, and for damage once per window. Totals since the start."""
        self._check_silence(now_us)
        if self._window_us is None:
            self._window_us = now_us
        if now_us - self._window_us < _WINDOW_US:
            return
        new_good, new_bad = good - self._good_before, bad - self._bad_before
        new_bytes = received_bytes - self._bytes_before
        self._good_before, self._bad_before, self._bytes_before = good, bad, received_bytes
        self._window_us = now_us
        self._judge(new_good, new_bad, new_bytes)
        self.set_condition(
            "impossible",
            self._impossible >= _BAD_MIN and self._impossible > _BAD_SHARE * new_good,
            f"{self._impossible} sound sentences, {self._impossible_address} among them, say what cannot be: check that device's settings",
            "values are possible again",
        )
        self._impossible = 0

    def gone(self, now_us: int, reason: str) -> None:
        """The port is closed: one text for it, not one for each sentence that it had brought."""
        if self._away_us is None and any(rhythm.count for rhythm in self._rhythms.values()):
            self._away_us = now_us
            self._say(Severity.WARNING, f"port gone: {reason}")

    def _check_silence(self, now_us: int) -> None:
        """One text for a silent line; a sentence that is missing from a line that speaks is told by itself."""
        if self._away_us is None and not self._any_silent and self._all_fresh(now_us):
            return  # nearly every look ends here
        heard = [rhythm for rhythm in self._rhythms.values() if rhythm.count]
        if not heard:
            return
        newest_us = max(rhythm.last_us for rhythm in heard)
        if self._away_us is not None:
            if newest_us <= self._away_us:
                return
            self._away_us = None
            self._say(Severity.INFO, "sentences again")
        seen = [rhythm.period_us for rhythm in heard if rhythm.count >= _SEEN_MIN]
        limit_us = max(_SILENT_MIN_US, _SILENT_PERIODS * min(seen, default=0.0))
        if seen and now_us - newest_us > limit_us:
            self._away_us = now_us
            self._say(Severity.WARNING, f"nothing heard for {limit_us / 1e6:.0f} s")
            return
        groups: dict[str, int] = {}
        for rhythm in heard:
            groups[rhythm.group] = max(groups.get(rhythm.group, 0), rhythm.last_us)
        changed: dict[bool, list[tuple[str, float]]] = {True: [], False: []}
        for address, rhythm in self._rhythms.items():
            quiet_us = newest_us - groups.get(rhythm.group, newest_us)
            sentence_us = max(_SILENT_MIN_US, _SILENT_PERIODS * rhythm.period_us)
            silent = rhythm.count >= _SEEN_MIN and quiet_us > sentence_us
            if silent != rhythm.silent:
                rhythm.silent = silent
                changed[silent].append((address, sentence_us))
        self._say_changes(changed[True], changed[False])
        self._any_silent = any(rhythm.silent for rhythm in heard)

    def _all_fresh(self, now_us: int) -> bool:
        limit_us = now_us - _SILENT_MIN_US
        for rhythm in self._rhythms.values():  # noqa: SIM110 - a generator costs as much again
            if rhythm.last_us < limit_us:
                return False
        return True

    def _judge(self, good: int, bad: int, received_bytes: int) -> None:
        damaged = bad >= _BAD_MIN and bad > _BAD_SHARE * (good + bad)
        self.set_condition(
            "damaged",
            damaged,
            f"{bad} of {good + bad} sentences damaged: check cable and baud rate",
            "sentences are clean",
        )
        garbage = good == 0 and received_bytes > 100
        self.set_condition("garbage", garbage, "bytes but no sentence: wrong baud rate or protocol?", "sentences again")

    def _say_changes(self, silent: list[tuple[str, float]], back: list[tuple[str, float]]) -> None:
        """One text for all sentences that fell silent together, as those of a receiver do, and one for all that are back."""
        if silent:
            names = ", ".join(address for address, _ in silent)
            self._say(Severity.WARNING, f"{names} silent for {max(limit for _, limit in silent) / 1e6:.0f} s")
        if back:
            names = ", ".join(address for address, _ in back)
            self._say(Severity.INFO, f"{names} {'are' if len(back) > 1 else 'is'} back")

    def _say(self, severity: Severity, text: str) -> None:
        if len(self.texts) < 50:
            self.texts.append((severity, f"{self.name}: {text}"))
