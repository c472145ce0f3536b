"""Two small observers beside the estimator: the slow drift of the water, and what kind of fix the operator is told of."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import FixType, GpsFix, Severity

_TELL_AFTER_US: Final = 2_000_000
_FIX_TEXT: Final = {
    FixType.NONE: "no fix",
    FixType.FIX_2D: "2-D fix",
    FixType.FIX_3D: "3-D fix",
    FixType.DGPS: "differential fix",
    FixType.RTK_FLOAT: "RTK float",
    FixType.RTK_FIXED: "RTK fixed",
}


class DriftFilter:
    """Slow mean of (ground velocity - velocity through the water), NED."""

    def __init__(self) -> None:
        self.north_mps: float | None = None
        self.east_mps: float | None = None
        self._seen_s = 0.0

    def step(self, dt_s: float, tau_s: float, north_mps: float, east_mps: float) -> None:
        """Take one sample; a plain mean at first, then a first-order low-pass."""
        if self.north_mps is None or self.east_mps is None:
            self.north_mps, self.east_mps = north_mps, east_mps
        self._seen_s += dt_s
        if dt_s <= 0.0:
            return
        seen_s = self._seen_s if self._seen_s < tau_s else tau_s
        gain = dt_s / (seen_s if seen_s > dt_s else dt_s)
        self.north_mps += gain * (north_mps - self.north_mps)
        self.east_mps += gain * (east_mps - self.east_mps)


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
