"""Other vessels on a MAVLink link: AIS_VESSEL to all, ADSB_VEHICLE for QGroundControl, COLLISION for each threat.

AIS_VESSEL goes out when a vessel has reported, and again within 30 s: MAVProxy's chart forgets her after 60 s. QGroundControl shows
ADSB_VEHICLE only, takes it while ``tslc`` is at most 15 s, and never takes a vehicle off the map: so it gets the place of now,
from vessels within a range and as long as it is sure. What a link has no room for is replaced by what is newer.
"""

from __future__ import annotations

import math
from typing import Final

from ...language.snapshot import Snapshot
from ...language.traffic import Danger, OtherVessel, TrafficPicture, VesselKind
from ...language.units import wrap_2pi
from ..persona import EndpointConfig
from ..wire.codec import dialect
from ..wire.mapping import rad_to_degE7
from ..wire.payload import Packed, message_id, packed
from .outbox import Outbox

_SHOWN: Final = frozenset(
    (
        VesselKind.CLASS_A,
        VesselKind.CLASS_B,
        VesselKind.LONG_RANGE,
        VesselKind.SAR_AIRCRAFT,
        VesselKind.PERSON,
        VesselKind.BEACON_TEST,
    )
)
"""Who goes out as AIS_VESSEL; marks would be drawn as ships."""
_EXACT: Final = _SHOWN - {VesselKind.LONG_RANGE}
_AGAIN_US: Final = 30_000_000
"""ArduPilot repeats as often."""
_GAP_US: Final = 250_000
"""At most four AIS_VESSEL a second on a link: 200 vessels must not fill it."""
_SECOND_US: Final = 1_000_000
_SIGMA_MOST_M: Final = 100.0
"""A wrong mark on a chart that cannot be taken away is worse than none."""
_ADSB_MOST: Final = 20
_TSLC_MOST_S: Final = 15
"""QGroundControl drops what is older."""
_AIS: Final = message_id("AIS_VESSEL")
_ADSB: Final = message_id("ADSB_VEHICLE")
_COLLISION: Final = message_id("COLLISION")

# AIS_FLAGS (common.xml)
_ACCURATE, _VALID_COG, _VALID_SPEED, _HIGH_SPEED, _VALID_TURN, _SIGN_ONLY = 1, 2, 4, 8, 16, 32
_VALID_SIDES, _VALID_CALLSIGN, _VALID_NAME = 64, 2048, 4096
_NINE_BITS: Final = (1 << 9) - 1
_SIX_BITS: Final = (1 << 6) - 1
_LARGE: Final = ((_NINE_BITS, 128), (_NINE_BITS, 256), (_SIX_BITS, 512), (_SIX_BITS, 1024))
"""Bow, stern, port, starboard: the value that means "that much or more", and its flag."""
_NO_STATUS: Final = 15
_NO_HEADING: Final = 65535
_CDEG: Final = 18_000.0 / math.pi
_DDEG_S: Final = 1_800.0 / math.pi

# ADSB_FLAGS, ADSB_EMITTER_TYPE (common.xml)
_ADSB_PLACE, _ADSB_ALTITUDE, _ADSB_HEADING, _ADSB_SPEED, _ADSB_CALLSIGN = 1, 2, 4, 8, 16
_SERVICE_SURFACE: Final = 18

_LEVEL: Final = {Danger.NONE: 0, Danger.RISK: 1, Danger.CLOSE: 2}
"""MAV_COLLISION_THREAT_LEVEL."""
_REPORT: Final = 1
"""MAV_COLLISION_ACTION_REPORT: it is told, nothing is done."""


def ais_vessel(vessel: OtherVessel, now_us: int) -> Packed:
    """AIS_VESSEL: the place as reported, ``tslc`` its age."""
    flags, sides = _ais_flags(vessel)
    turn = vessel.turn_sign if vessel.turn_radps is None else max(-118, min(118, round(vessel.turn_radps * _DDEG_S)))
    return packed(
        dialect.MAVLink_ais_vessel_message(
            MMSI=vessel.mmsi,
            lat=rad_to_degE7(vessel.reported_lat_rad, 0),
            lon=rad_to_degE7(vessel.reported_lon_rad, 0),
            COG=_cdeg(vessel.cog_rad, 0),
            heading=_cdeg(vessel.heading_rad, _NO_HEADING),
            velocity=0 if vessel.sog_mps is None else min(round(vessel.sog_mps * 100.0), 65535),
            turn_rate=turn,
            navigational_status=_NO_STATUS if vessel.status is None else vessel.status,
            type=vessel.ship_type,
            dimension_bow=sides[0],
            dimension_stern=sides[1],
            dimension_port=sides[2],
            dimension_starboard=sides[3],
            callsign=vessel.callsign.encode("ascii", "replace")[:7],
            name=vessel.name.encode("ascii", "replace")[:20],
            tslc=min(int(vessel.age_s(now_us)), 65535),
            flags=flags,
        )
    )


def _ais_flags(vessel: OtherVessel) -> tuple[int, tuple[int, int, int, int]]:
    """The flags of what is known, and the dimensions."""
    flags = _ACCURATE * vessel.accurate + _VALID_COG * (vessel.cog_rad is not None)
    flags += _VALID_SPEED * (vessel.sog_mps is not None) + _HIGH_SPEED * vessel.sog_is_least
    flags += _VALID_TURN * (vessel.turn_radps is not None or vessel.turn_sign != 0) + _SIGN_ONLY * (
        vessel.turn_sign != 0
    )
    flags += _VALID_CALLSIGN * bool(vessel.callsign) + _VALID_NAME * bool(vessel.name)
    if vessel.sides is None:
        return flags, (0, 0, 0, 0)
    sides = vessel.sides.bow_m, vessel.sides.stern_m, vessel.sides.port_m, vessel.sides.starboard_m
    large = [flag for side, (most, flag) in zip(sides, _LARGE, strict=True) if side >= most]
    return flags + _VALID_SIDES + sum(large), sides


def _cdeg(angle_rad: float | None, unknown: int) -> int:
    return unknown if angle_rad is None else round(wrap_2pi(angle_rad) * _CDEG) % 36_000


def adsb_vehicle(vessel: OtherVessel, now_us: int) -> Packed:
    """ADSB_VEHICLE as QGroundControl draws it: the place of now, altitude 0 so that the name shows, eight letters of it."""
    course = vessel.cog_rad if vessel.heading_rad is None else vessel.heading_rad
    flags = _ADSB_PLACE + _ADSB_ALTITUDE + _ADSB_CALLSIGN
    flags += _ADSB_HEADING * (course is not None) + _ADSB_SPEED * (vessel.sog_mps is not None)
    return packed(
        dialect.MAVLink_adsb_vehicle_message(
            ICAO_address=vessel.mmsi,
            lat=rad_to_degE7(vessel.lat_rad, 0),
            lon=rad_to_degE7(vessel.lon_rad, 0),
            altitude_type=1,
            altitude=0,
            heading=_cdeg(course, 0),
            hor_velocity=0 if vessel.sog_mps is None else min(round(vessel.sog_mps * 100.0), 65535),
            ver_velocity=0,
            callsign=_callsign(vessel).encode("ascii", "replace")[:8],
            emitter_type=_SERVICE_SURFACE,
            tslc=min(int(vessel.age_s(now_us)), _TSLC_MOST_S),
            flags=flags,
            squawk=0,
        )
    )


def _callsign(vessel: OtherVessel) -> str:
    """A beacon's number says nothing in eight digits, and a test must not look like the real thing."""
    if vessel.beacon:
        return vessel.beacon if vessel.kind is VesselKind.PERSON else f"TEST {vessel.beacon}"
    return vessel.name or str(vessel.mmsi)


def collision(vessel: OtherVessel) -> Packed:
    """COLLISION: source ADSB, for there is none for AIS; level 0 ends it."""
    return packed(
        dialect.MAVLink_collision_message(
            src=0,
            id=vessel.mmsi,
            action=_REPORT,
            threat_level=_LEVEL[vessel.danger],
            time_to_minimum_delta=vessel.tcpa_s or 0.0,
            altitude_minimum_delta=0.0,
            horizontal_minimum_delta=max(0.0, vessel.cpa_m or 0.0),
        )
    )


class TrafficTeller:
    """What one link has been told of other vessels, and what it is told next."""

    def __init__(self, config: EndpointConfig, outbox: Outbox) -> None:
        self._outbox = outbox
        self._whole = config.profile == "lan"
        self._sent: dict[int, tuple[int, int]] = {}
        """By number: when she had reported, and when she was sent last."""
        self._threats: dict[int, OtherVessel] = {}
        self._picture: TrafficPicture | None = None
        self._next_us = self._next_adsb_us = self._next_threats_us = 0
        self._news = False

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what is due."""
        picture = snapshot.traffic
        if not picture.vessels and not self._threats and not self._sent:
            return
        if picture is not self._picture:
            self._picture, self._news = picture, True
            threats = {vessel.mmsi: vessel for vessel in picture.threats}
            self._changes(threats)
        if self._threats and now_us >= self._next_threats_us:
            self._next_threats_us = now_us + _SECOND_US
            for vessel in self._threats.values():
                self._queue(_COLLISION, vessel.mmsi, collision(vessel))
        if self._whole:
            self._vessels(picture, now_us)

    def _changes(self, threats: dict[int, OtherVessel]) -> None:
        """Tell at once of threats that begin, change or end."""
        for mmsi, vessel in threats.items():
            before = self._threats.get(mmsi)
            if before is None or before.danger is not vessel.danger:
                self._queue(_COLLISION, mmsi, collision(vessel))
        for mmsi in sorted(self._threats.keys() - threats.keys()):
            self._queue(_COLLISION, mmsi, _ended(mmsi))
        self._threats = threats

    def _vessels(self, picture: TrafficPicture, now_us: int) -> None:
        if now_us >= self._next_us and (vessel := self._most_urgent(picture, now_us)) is not None:
            self._next_us = now_us + _GAP_US
            self._sent[vessel.mmsi] = vessel.reported_us, now_us
            self._queue(_AIS, vessel.mmsi, ais_vessel(vessel, now_us))
        if picture.as_adsb and now_us >= self._next_adsb_us:
            self._next_adsb_us = now_us + _SECOND_US
            for vessel in [each for each in picture.vessels if _is_sure(each, picture.range_m)][:_ADSB_MOST]:
                self._queue(_ADSB, vessel.mmsi, adsb_vehicle(vessel, now_us))

    def _most_urgent(self, picture: TrafficPicture, now_us: int) -> OtherVessel | None:
        """Of those with news the first; those that were not told for 30 s come before all but threats."""
        if not self._news and now_us < self._next_us + _SECOND_US:
            return None
        shown = [vessel for vessel in picture.vessels if vessel.kind in _SHOWN]
        if len(self._sent) > len(shown):
            present = {vessel.mmsi for vessel in shown}
            self._sent = {mmsi: sent for mmsi, sent in self._sent.items() if mmsi in present}
        waiting = [(self._wait(vessel, now_us), vessel) for vessel in shown]
        best = max(waiting, key=lambda each: each[0], default=None)
        if best is None or best[0] <= 0.0:
            self._news = False
            return None
        return best[1]

    def _wait(self, vessel: OtherVessel, now_us: int) -> float:
        """How urgent she is; 0 and less: not now."""
        reported_us, sent_us = self._sent.get(vessel.mmsi, (-1, now_us - 2 * _AGAIN_US))
        age = (now_us - sent_us) / _AGAIN_US
        if vessel.reported_us == reported_us and age < 1.0:
            return 0.0
        urgent = vessel.danger is not Danger.NONE or vessel.kind is VesselKind.PERSON
        return age + (2.0 if urgent else 0.0) + 1.0 / (1.0 + (vessel.range_m or 1e6) / 100.0)

    def _queue(self, kind: int, mmsi: int, made: Packed) -> None:
        # one place a vessel and kind: what is newer replaces what still waits
        self._outbox.telemetry({kind << 32 | mmsi: made}, [])


def _ended(mmsi: int) -> Packed:
    message = dialect.MAVLink_collision_message(
        src=0,
        id=mmsi,
        action=_REPORT,
        threat_level=0,
        time_to_minimum_delta=0.0,
        altitude_minimum_delta=0.0,
        horizontal_minimum_delta=0.0,
    )
    return packed(message)


def _is_sure(vessel: OtherVessel, range_m: float) -> bool:
    """Whether she may be drawn where nobody can take her away again."""
    return (
        vessel.kind in _EXACT
        and vessel.range_m is not None
        and (vessel.range_m <= range_m or vessel.kind is VesselKind.PERSON)
        and vessel.sigma_m <= _SIGMA_MOST_M
    )
