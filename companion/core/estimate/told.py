"""What the estimator tells: the kind of fix once it stays, and what comes and goes at a bounded rate, so that it hides no alarm."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import FixType, GpsFix, Severity

_PAUSE_US: Final = 10_000_000
"""Between two beginnings that are told: six a minute are read, two compasses on one line made 222 texts in 22 s."""
_TELL_AFTER_US: Final = 2_000_000
"""A kind of fix that changes back within this is not told."""
_FIX_TEXT: Final = {
    FixType.NONE: "no fix",
    FixType.FIX_2D: "2-D fix",
    FixType.FIX_3D: "3-D fix",
    FixType.DGPS: "differential fix",
    FixType.RTK_FLOAT: "RTK float",
    FixType.RTK_FIXED: "RTK fixed",
}


class ComesAndGoes:
    """Whether to tell that something begins, and that it is over: no beginning soon after the last, no end without its beginning."""

    def __init__(self) -> None:
        self._told_us: int | None = None
        self._is_told = False

    def begins(self, t_us: int) -> bool:
        self._is_told = self._told_us is None or t_us - self._told_us >= _PAUSE_US
        if self._is_told:
            self._told_us = t_us
        return self._is_told

    def ends(self) -> bool:
        was_told, self._is_told = self._is_told, False
        return was_told


class FixText:
    """Says the kind of fix when it has changed and stays so for two seconds."""

    def __init__(self, texts: list[tuple[Severity, str]]) -> None:
        self._texts = texts
        self._told: FixType | None = None
        self._new_us: int | None = None

    def note(self, fix: GpsFix) -> None:
        """Take every fix."""
        if fix.fix_type == self._told:
            self._new_us = None
        elif self._new_us is None:
            self._new_us = fix.t_us
        elif fix.t_us - self._new_us >= _TELL_AFTER_US:
            self._told, self._new_us = fix.fix_type, None
            severity = Severity.WARNING if fix.fix_type == FixType.NONE else Severity.INFO
            used = "" if fix.satellites is None else f", {fix.satellites} satellites"
            self._texts.append((severity, f"GNSS: {_FIX_TEXT[fix.fix_type]}{used}"))
