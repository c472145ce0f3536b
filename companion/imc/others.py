"""Other vessels towards the consoles: an AisInfo for each AIS_VESSEL that the vehicle tells; all that are known, to a console that comes.

The place goes out as it was reported, with the time when it was true. AIS' own numbers stand for what she did not say: course 360,
speed 102.3, status 15, sizes 0. Units are those of the message's definition, degrees and knots.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from mavlink_bridge.imc import AisInfo, Asker, Message, Outgoing
from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.units import mps_to_knots
from mavlink_bridge.mavlink.wire.mapping import degE7_to_rad

from .motion import estimated_state
from .picture import HeardMessage, ImcPicture

LABEL: Final = "AIS"
KEPT: Final = 256
"""As many as the vessel tracks."""
_KNOWN_US: Final = 60_000_000
"""The vessel repeats each within 30 s; one that missed two of these is no more told to newcomers."""
_POSITION: Final = "1"
"""Class A's position report: DUNE takes a vessel's motion from 1, 2 and 3 only, and AIS_VESSEL says no type."""
_VALID_COURSE, _VALID_SPEED, _VALID_SIDES = 2, 4, 64
"""AIS_FLAGS (common.xml)."""
_NO_COURSE_DEG: Final = 360.0
_NO_SPEED_KN: Final = 102.3
"""ITU-R M.1371: not available."""


class Others:
    """A part of the system."""

    def __init__(self, picture: ImcPicture) -> None:
        self._picture = picture
        self._known: dict[int, HeardMessage] = {}
        self._news: dict[int, HeardMessage] = {}

    def hear(self, message: Any, now_us: int) -> None:
        """Take in a decoded MAVLink message of the vehicle."""
        if message.get_type() != "AIS_VESSEL":
            return
        heard = HeardMessage(message, now_us)
        self._known.pop(message.MMSI, None)
        self._known[message.MMSI] = self._news[message.MMSI] = heard
        if len(self._known) > KEPT:
            oldest = next(iter(self._known))
            del self._known[oldest]
            self._news.pop(oldest, None)

    def receive(self, message: Message, asker: Asker, now_us: int) -> bool:
        return False

    def heard(self, asker: Asker, now_us: int) -> None: ...

    def met(self, asker: Asker, now_us: int) -> None:
        """A console that comes is told of all."""
        self._known = {mmsi: each for mmsi, each in self._known.items() if now_us - each.at_us <= _KNOWN_US}
        self._news = dict(self._known)

    def entities(self) -> Sequence[str]:
        return (LABEL,)

    def take(self, now_us: int) -> list[Outgoing]:
        news, self._news = self._news, {}
        state = estimated_state(self._picture, now_us) if news else None
        own = None if state is None else (state.lat_rad, state.lon_rad)
        told = [(ais_info(each.message, own), each) for each in news.values()]
        return [
            Outgoing(info, label=LABEL, age_s=each.message.tslc + (now_us - each.at_us) * 1e-6)
            for info, each in told
            if info is not None
        ]


def ais_info(message: Any, own_rad: tuple[float, float] | None) -> AisInfo | None:
    """An AIS_VESSEL as IMC tells it; None where it says no place. ``own_rad``: where we are."""
    lat_rad, lon_rad = degE7_to_rad(message.lat), degE7_to_rad(message.lon)
    if lat_rad is None or lon_rad is None:
        return None
    sides: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    if message.flags & _VALID_SIDES:
        ends = message.dimension_bow, message.dimension_stern
        sides = tuple(map(float, (*ends, message.dimension_port, message.dimension_starboard)))
    known_course, known_speed = message.flags & _VALID_COURSE, message.flags & _VALID_SPEED
    return AisInfo(
        msg_type=_POSITION,
        sensor_class=LABEL,
        mmsi=str(message.MMSI),
        callsign=message.callsign.rstrip("\0"),
        name=message.name.rstrip("\0"),
        nav_status=message.navigational_status,
        type_and_cargo=message.type,
        lat_rad=lat_rad,
        lon_rad=lon_rad,
        course_deg=message.COG * 0.01 if known_course else _NO_COURSE_DEG,
        speed_kn=mps_to_knots(message.velocity * 0.01) if known_speed else _NO_SPEED_KN,
        dist_m=-1.0 if own_rad is None else inverse(*own_rad, lat_rad, lon_rad)[0],
        a_m=sides[0],
        b_m=sides[1],
        c_m=sides[2],
        d_m=sides[3],
    )
