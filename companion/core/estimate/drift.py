"""Two small observers beside the estimator: the slow drift of the water, and what kind of fix the operator is told of."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import FixType, GpsFix, Severity

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


_JOLT_S: Final = 1.2
"""What the samples say over this time is compared with the mean: longer than a turn's transient of sway lasts at full size."""
_JOLT_MPS: Final = 0.25
"""Beyond this much off the mean the water has changed: more than gusts, waves and turns leave in the samples."""
_QUICK_S: Final = 1.5
"""Time constant of the mean while it has that far to go."""


_TURNING_RADPS: Final = 0.12
"""7 degrees a second: what steering keeps straight in waves turns less."""
_SLIPS_S: Final = 2.5
"""After a turn the slip of the small hulls has died away by then."""
_SLIP_MPS: Final = 0.5
"""For so long after a turn faster than that the hull slips by up to this: that is no change of the water."""


class DriftFilter:
    """Slow mean of (ground velocity - velocity through the water), NED; quick where the water itself has changed.

    Eddies and shear lines change the drift by more, and for longer, than what the mean is slow for.
    """

    def __init__(self) -> None:
        self.north_mps: float | None = None
        self.east_mps: float | None = None
        self._seen_s = 0.0
        self._off_n = self._off_e = 0.0
        self._straight_s = 0.0

    def step(self, dt_s: float, tau_s: float, north_mps: float, east_mps: float, r_radps: float) -> None:
        """Take one sample; a plain mean at first, then a first-order low-pass. ``r_radps``: a turning hull slips sideways."""
        self._straight_s = 0.0 if r_radps * r_radps > _TURNING_RADPS * _TURNING_RADPS else self._straight_s + dt_s
        if self.north_mps is None or self.east_mps is None:
            self.north_mps, self.east_mps = north_mps, east_mps
        self._seen_s += dt_s
        if dt_s <= 0.0:
            return
        seen_s = self._seen_s if self._seen_s < tau_s else tau_s
        off_n, off_e = north_mps - self.north_mps, east_mps - self.east_mps
        share = dt_s / _JOLT_S if dt_s < _JOLT_S else 1.0
        self._off_n += share * (off_n - self._off_n)
        self._off_e += share * (off_e - self._off_e)
        jolt2 = self._off_n * self._off_n + self._off_e * self._off_e
        least_mps = _JOLT_MPS if self._straight_s > _SLIPS_S else _SLIP_MPS
        if jolt2 > least_mps * least_mps and seen_s > _QUICK_S:
            seen_s = _QUICK_S
        gain = dt_s / (seen_s if seen_s > dt_s else dt_s)
        self.north_mps += gain * off_n
        self.east_mps += gain * off_e


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
