"""Aids to navigation that speak AIS: shown, and told when they are off their place. A virtual one is no obstacle: nothing is there."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.traffic import OtherVessel, VesselKind

from ..ais.reports import AidToNavigation
from .words import Text

_AIDS_MAX: Final = 64
"""More than one receiver hears on any coast; a forger fills no memory."""
_LIFE_US: Final = 1_200_000_000
"""They report every three minutes (ITU-R M.1371 table 2)."""
_SIGMA_M: Final = 10.0
"""A buoy swings on its chain."""


class Aids:
    """The newest report of each, the 64 heard last."""

    def __init__(self) -> None:
        self._aids: dict[int, tuple[int, AidToNavigation]] = {}
        self._off: set[int] = set()

    def take(self, report: AidToNavigation, now_us: int) -> list[Text]:
        """Take a report; return what is worth a word."""
        self._aids.pop(report.mmsi, None)
        self._aids[report.mmsi] = now_us, report
        if len(self._aids) > _AIDS_MAX:
            self._drop(next(iter(self._aids)))
        if bool(report.off_position) is (report.mmsi in self._off):
            return []
        name = report.name or f"MMSI {report.mmsi}"
        if report.off_position:
            self._off.add(report.mmsi)
            return [(Severity.NOTICE, f"Aid to navigation {name} is off its position")]
        self._off.discard(report.mmsi)
        return [(Severity.INFO, f"Aid to navigation {name} is in its place")]

    def expire(self, now_us: int) -> bool:
        """Forget what is silent; True when something was forgotten."""
        over = [mmsi for mmsi, (at_us, _) in self._aids.items() if now_us - at_us > _LIFE_US]
        for mmsi in over:
            self._drop(mmsi)
        return bool(over)

    def _drop(self, mmsi: int) -> None:
        del self._aids[mmsi]
        self._off.discard(mmsi)

    def vessels(self) -> list[OtherVessel]:
        """Those with a place, as everybody is shown them."""
        return [
            OtherVessel(
                mmsi=mmsi,
                kind=VesselKind.VIRTUAL_AID if report.virtual else VesselKind.AID,
                t_us=at_us,
                lat_rad=report.lat_rad,
                lon_rad=report.lon_rad,
                reported_lat_rad=report.lat_rad,
                reported_lon_rad=report.lon_rad,
                reported_us=at_us,
                sigma_m=_SIGMA_M,
                at_rest=True,
                accurate=report.accurate,
                sides=report.dimensions,
                name=report.name,
            )
            for mmsi, (at_us, report) in sorted(self._aids.items())
            if report.lat_rad is not None and report.lon_rad is not None
        ]
