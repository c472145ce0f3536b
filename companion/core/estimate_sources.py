"""Several sensor links: which one counts, and whether two receivers agree."""

from __future__ import annotations

import math
from typing import Final

from companion.core.estimate_config import POSITION_ACCURACY_M
from companion.core.geo import inverse
from mavlink_bridge.imc import GpsFix, Severity

_SILENT_US: Final = 2_000_000
_DISAGREE_US: Final = 5_000_000
_SIGMAS: Final = 3.0
_SOURCES_MAX: Final = 8


class SourceChoice:
    """The first configured link that is alive leads; a second receiver is compared with it.

    Disagreement is declared after 5 s beyond three times the joint accuracy (hacc when the receiver gives it).
    """

    def __init__(self, texts: list[tuple[Severity, str]]) -> None:
        self.disagree = False
        self._texts = texts
        self._heard: dict[str, dict[int, int]] = {}
        self._fixes: dict[int, GpsFix] = {}
        self._apart_since_us: int | None = None

    def leads(self, kind: str, source: int, t_us: int) -> bool:
        """True when measurements of this kind from this source count now."""
        heard = self._heard.get(kind)
        if heard is None:
            heard = self._heard[kind] = {}
        if source in heard or len(heard) < _SOURCES_MAX:
            heard[source] = t_us
        if len(heard) == 1:
            return True
        return all(other >= source or t_us - last_us > _SILENT_US for other, last_us in heard.items())

    def leads_fix(self, source: int, fix: GpsFix) -> bool:
        """The same for fixes: a receiver without a fix does not lead, and any two with one are compared."""
        if fix.has_position:
            lead = self.leads("fix", source, fix.t_us)
            if source in self._fixes or len(self._fixes) < _SOURCES_MAX:
                self._fixes[source] = fix
            if len(self._fixes) > 1:
                self._compare(fix, source)
            return lead
        others = self._heard.get("fix", {}).items()
        return all(other == source or fix.t_us - last_us > _SILENT_US for other, last_us in others)

    def _compare(self, fix: GpsFix, source: int) -> None:
        apart = False
        for other, old in self._fixes.items():
            if other != source and fix.t_us - old.t_us < _SILENT_US:
                apart |= _apart(fix, old)
        if not apart:
            self._apart_since_us = None
        elif self._apart_since_us is None:
            self._apart_since_us = fix.t_us
        since_us = self._apart_since_us
        self._declare(since_us is not None and fix.t_us - since_us >= _DISAGREE_US)

    def _declare(self, disagree: bool) -> None:
        if disagree != self.disagree:
            self.disagree = disagree
            if disagree:
                self._texts.append((Severity.WARNING, "Two receivers disagree on the position; using the first"))
            else:
                self._texts.append((Severity.NOTICE, "Receivers agree again"))


def _apart(first: GpsFix, second: GpsFix) -> bool:
    distance_m, _ = inverse(*_place(first), *_place(second))
    between_s = abs(first.t_us - second.t_us) * 1e-6
    moved_m = between_s * max(first.sog_mps or 0.0, second.sog_mps or 0.0)
    return distance_m > _SIGMAS * math.hypot(_accuracy(first), _accuracy(second)) + moved_m


def _place(fix: GpsFix) -> tuple[float, float]:
    assert fix.lat_rad is not None
    assert fix.lon_rad is not None
    return fix.lat_rad, fix.lon_rad


def _accuracy(fix: GpsFix) -> float:
    return fix.hacc_m if fix.hacc_m is not None else POSITION_ACCURACY_M[fix.fix_type]
