"""The echo sounders: one is used, the others are compared with it, each transducer taken for where it lies below the waterline."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import Distance

from ..hull.geometry import HullGeometry
from .sources import Choice, Texts

_APART_M: Final = 0.5
"""Two sounders over one bottom: their noise and what the boat's list makes of it."""
_APART_SHARE: Final = 0.1
"""Two transducers stand over different bottom: on a slope of 1 in 10, this much for each metre that they lie apart."""


class Sounders:
    """All that tell a depth."""

    def __init__(self, texts: Texts, geometry: HullGeometry) -> None:
        """``geometry``: where the transducers lie."""
        self.choice = Choice("Depth", texts, least_s=2.0, most_s=6.0, figure="{:.1f} m".format)
        self.latest: Distance | None = None
        """The newest of the one that counts."""
        self._geometry = geometry
        self._depth: tuple[float, int] | None = None
        """Of the water, below the waterline: transducers lie at different depths."""

    def at(self, now_us: int) -> Distance | None:
        """The newest sounding; one without a value when the sounder has fallen silent, None when there never was one."""
        found = self.latest
        if found is None or now_us - found.t_us <= self.choice.patience_us:
            return found
        return Distance(found.t_us, None, source=found.source)

    def age_s(self, now_us: int) -> float | None:
        """Of the newest sounding."""
        return None if self.latest is None else (now_us - self.latest.t_us) * 1e-6

    def update(self, distance: Distance, link: int) -> bool:
        """Take a sounding; True when its sounder counts. One that finds no bottom does not lead: another that finds one does."""
        value_m, below_m = distance.bottom_m, self._geometry.transducer_of(link)
        if value_m is None:
            if not self.choice.is_chosen(distance.source, link):
                return False
        elif not self.choice.leads(distance.source, link, distance.t_us):
            limit_m = max(_APART_M, _APART_SHARE * value_m)
            self.choice.compare_newest(distance, link, value=value_m + below_m, used=self._depth, limit=limit_m)
            return False
        else:
            self._depth = (value_m + below_m, distance.t_us)
        self.latest = distance if value_m is not None else Distance(distance.t_us, None, source=distance.source)
        return True
