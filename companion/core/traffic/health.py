"""Whether AIS receivers are heard and in time, and what they say of themselves ($AITXT, $AIALR)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language.messages import Severity

from .table import BELIEVED_AGE_S
from .words import Text

SILENT_US: Final = 60_000_000
"""Receivers that hear nobody say so, or nothing: a minute is six reports of a class A vessel under way."""
_LATE_US: Final = 20_000_000
"""Over the interval of who must report most often: her slot may be late."""
QUIET_US: Final = 600_000_000
"""No vessel for so long is normal on a lake, and worth a word at sea."""
_AGAIN_US: Final = 600_000_000
"""The same word again at most every ten minutes."""
_AGES: Final = 8
"""So many reports in a row that are late, or in time again, are no chance: one vessel with a wrong clock among others is not told."""
_AGES_AGREE_S: Final = 6.0
"""Late by a network, or seen by a clock that is off, all are late alike."""
_AHEAD_S: Final = 60.0 - BELIEVED_AGE_S
"""An age is known below a minute only: above this the fix is ahead of our clock, which is some seconds behind, and nothing is late."""
_TEXTS_KEPT: Final = 16
"""Texts whose time is remembered; a receiver that invents them fills no memory."""


class ReceiverHealth:
    """Texts when the condition of the receivers changes; memory is bounded."""

    def __init__(self) -> None:
        self.heard = False
        self.silent = False
        self._told_silent = False
        self._told_us = -_AGAIN_US
        """When silence was last told."""
        self._line_us = 0
        """When a line that has carried AIS last brought a byte."""
        self._report_us = 0
        self._quiet = False
        self._said: dict[str, int] = {}
        self._ages_s: list[float] = []
        self._are_late = False
        self._started_us: int | None = None
        self.texts: list[Text] = []

    def sentence(self, now_us: int) -> None:
        """An AIS sentence has come."""
        self.heard = True
        self._line_us = self._report_us = now_us

    def fix_age(self, age_s: float) -> None:
        """A report has come whose fix is so old by its UTC second: late ones cannot be told from a clock that is off, and are not used."""
        ages_s = self._ages_s = [*self._ages_s[1 - _AGES :], age_s if age_s <= _AHEAD_S else age_s - 60.0]
        if len(ages_s) < _AGES:
            return
        in_time = max(ages_s) <= BELIEVED_AGE_S
        late = min(ages_s) > BELIEVED_AGE_S and max(ages_s) - min(ages_s) <= _AGES_AGREE_S
        if late and not self._are_late:
            told = f"AIS reports come {min(ages_s):.0f} s late, or a clock is off: vessels are farther on than shown"
            self.texts.append((Severity.WARNING, told))
        elif in_time and self._are_late:
            self.texts.append((Severity.INFO, "AIS reports come in time again"))
        self._are_late = late or (self._are_late and not in_time)

    def line_alive(self, now_us: int) -> None:
        """A line that carries AIS has brought something."""
        self._line_us = now_us

    def receiver_text(self, fields: Sequence[str], now_us: int) -> None:
        """$--TXT (total, number, identifier, text) or $--ALR (time, number, condition, acknowledged, text)."""
        if fields[0].endswith("ALR"):
            if len(fields) < 6 or fields[3] != "A":
                return
            severity, text = Severity.WARNING, fields[5]
        else:
            severity, text = Severity.INFO, fields[4] if len(fields) > 4 else ""
        text = text.removeprefix("AIS: ").strip()[:60]
        if not text or now_us - self._said.get(text, -_AGAIN_US) < _AGAIN_US:
            return
        self._said.pop(text, None)
        self._said[text] = now_us
        if len(self._said) > _TEXTS_KEPT:
            del self._said[next(iter(self._said))]
        self.texts.append((severity, f"AIS receiver: {text}"))

    def step(self, now_us: int, *, required: bool, every_s: Callable[[], float] = lambda: 0.0) -> None:
        """Look for silence; once a tick. ``every_s``: the interval of who must report most often of all that are known, else 0."""
        if self._started_us is None:
            self._started_us = self._line_us = self._report_us = now_us
        silent_us = now_us - self._line_us
        limit_us = SILENT_US
        if silent_us > SILENT_US:  # alone with who lies at anchor three minutes without a word are as they should be
            limit_us = max(SILENT_US, round(every_s() * 1e6) + _LATE_US)
        silent = self.silent = (self.heard or required) and silent_us > limit_us
        self._tell_silence(now_us, limit_us)
        quiet = self.heard and not silent and now_us - self._report_us > QUIET_US
        if quiet and not self._quiet:
            self.texts.append((Severity.INFO, f"AIS: no vessel heard for {QUIET_US // 60_000_000} min"))
        self._quiet = quiet

    def _tell_silence(self, now_us: int, limit_us: int) -> None:
        """Who is heard once in three minutes and is lost now and then makes no text each time."""
        silent = self.silent
        if silent == self._told_silent or (silent and now_us - self._told_us < _AGAIN_US):
            return
        self._told_silent = silent
        if silent:
            self._told_us = now_us
            self.texts.append((Severity.WARNING, f"AIS silent for {limit_us // 1_000_000} s: traffic unknown"))
        else:
            self.texts.append((Severity.INFO, "AIS is heard again"))
