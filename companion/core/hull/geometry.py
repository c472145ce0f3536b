"""The vessel's geometry as its parts use it: worked out of the hull file once, configured nowhere else.

Sensor links have numbers in the core and names in the files; a link with a table of its own in the hull file
(``[mounts.NAME]``) is told apart here, so that a second sounder or antenna is measured from where it really sits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from mavlink_bridge.language.value import value

from .vessel_file import VesselConfig

Arm = tuple[float, float, float]
"""Antenna from the vessel's reference point: forward, starboard, down, m."""
STATIONS: Final = "mavlink"
"""The mount of a sounder whose readings a station or another computer sends (DISTANCE_SENSOR, WATER_DEPTH)."""
SENT_LINK: Final = 99
"""The number of the link that those readings count as: they come after every sensor of the vessel's own."""


@value
class HullGeometry:
    """Lengths in m, depths positive down from the waterline."""

    keel_m: float = 0.0
    """Lowest point of the vessel."""
    transducer_m: float = 0.0
    """The sounder of every link without a place of its own."""
    beam_m: float = 0.0
    rudder_max_rad: float = 0.0
    antenna: Arm = (0.0, 0.0, 0.0)
    transducers_m: tuple[float, ...] = ()
    """By number of the sensor link."""
    antennas: tuple[Arm, ...] = ()
    sent_transducer_m: float | None = None
    """Of the readings that come over MAVLink; None = as ``transducer_m``."""

    def transducer_of(self, source: int | None) -> float:
        """Depth of the transducer behind a reading; ``source`` None or ``SENT_LINK``: it came over MAVLink."""
        if source is None or source == SENT_LINK:
            return self.transducer_m if self.sent_transducer_m is None else self.sent_transducer_m
        return self.transducers_m[source] if source < len(self.transducers_m) else self.transducer_m

    def antenna_of(self, source: int) -> Arm:
        """Place of the antenna behind a fix."""
        return self.antennas[source] if source < len(self.antennas) else self.antenna


def geometry_of(vessel: VesselConfig, sources: Sequence[str] = ()) -> HullGeometry:
    """Return a hull file's geometry; ``sources`` are the names of the sensor links in their order."""
    return HullGeometry(
        keel_m=vessel.keel_depth_m,
        transducer_m=vessel.transducer_depth_m,
        beam_m=vessel.hull.beam_m,
        rudder_max_rad=vessel.rudder.max_rad,
        antenna=_arm(vessel, ""),
        transducers_m=tuple(transducer_depth_m(vessel, name) for name in sources),
        antennas=tuple(_arm(vessel, name) for name in sources),
        sent_transducer_m=transducer_depth_m(vessel, STATIONS),
    )


def transducer_depth_m(vessel: VesselConfig, source: str) -> float:
    """Depth of the transducer of a named sensor link below the waterline, m."""
    mount = vessel.mounts.get(source)
    return vessel.transducer_depth_m if mount is None or mount.transducer_depth_m is None else mount.transducer_depth_m


def depths_of(vessel: VesselConfig, source: str) -> tuple[float, float]:
    """Transducer of a named sensor link and keel, below the waterline, m: what its reader needs."""
    return transducer_depth_m(vessel, source), vessel.keel_depth_m


def mounted(vessel: VesselConfig, source: str) -> str:
    """Say in words where a named sensor link sits, as far as it matters."""
    forward_m, starboard_m, down_m = arm = _arm(vessel, source)
    said = f", transducer {transducer_depth_m(vessel, source):g} m below the waterline"
    return said + (f", antenna {forward_m:g} m forward, {starboard_m:g} starboard, {-down_m:g} up" if any(arm) else "")


def strangers(vessel: VesselConfig, sources: Sequence[str]) -> list[str]:
    """Names of mounts that no sensor link has."""
    return sorted(set(vessel.mounts) - {*sources, STATIONS})


def _arm(vessel: VesselConfig, source: str) -> Arm:
    mount = vessel.mounts.get(source)
    antenna = vessel.antenna if mount is None or mount.antenna is None else mount.antenna
    return antenna.forward_m, antenna.starboard_m, -antenna.up_m
