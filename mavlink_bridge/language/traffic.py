"""Other vessels as everybody is shown them: one frozen picture, in SI units and radians; None where nobody knows."""

from __future__ import annotations

from enum import Enum
from typing import Final

from .value import value

TCPA_MOST_S: Final = 1200.0
"""As far ahead as a closest point is looked for: nobody keeps course and speed for longer."""


class VesselKind(Enum):
    """What sends under a number."""

    CLASS_A = "class A"
    CLASS_B = "class B"
    AID = "aid to navigation"
    VIRTUAL_AID = "virtual aid"
    """Broadcast only: there is nothing in the water."""
    SAR_AIRCRAFT = "search and rescue aircraft"
    LONG_RANGE = "long range"
    """Too coarse to judge."""
    PERSON = "person in the water"
    """A beacon 970, 972 or 974: a person, never a vessel."""
    BEACON_TEST = "beacon test"


class Role(Enum):
    """What we are to another vessel (COLREG rules 13 to 15)."""

    NONE = "none"
    HEAD_ON = "head-on"
    GIVE_WAY = "give way"
    """She crosses from starboard."""
    STAND_ON = "stand on"
    """She crosses from port."""
    OVERTAKING = "overtaking"
    """We overtake her and keep clear."""
    OVERTAKEN = "overtaken"
    OBSTACLE = "obstacle"
    """She rests, or nobody knows where she goes."""


class Danger(Enum):
    """How it stands between her and us."""

    NONE = "none"
    RISK = "risk"
    """Our courses would pass within the wanted clearance, or did and are not yet past and clear."""
    CLOSE = "close"
    """Within half of it, or 20 s before that."""


@value
class Sides:
    """Metres from the antenna to each side of the hull. 511 or 63: that much or more.

    ``bow_m`` 0 with a stern: where the antenna is along the hull is unknown, and ``stern_m`` the length.
    """

    bow_m: int
    stern_m: int
    port_m: int
    starboard_m: int


_BEACONS: Final = {970: "SART", 972: "MOB", 974: "EPIRB"}
"""First three digits of a number (ITU-R M.585), and what seamen call its sender."""


def beacon_name(mmsi: int) -> str:
    """What seamen call the distress beacon of a number."""
    return _BEACONS.get(mmsi // 1_000_000, "beacon")


@value
class OtherVessel:
    """One other vessel, as known at a time."""

    mmsi: int
    kind: VesselKind
    t_us: int
    """When she was looked at; ``lat_rad`` and ``lon_rad`` are of then."""
    lat_rad: float
    lon_rad: float
    reported_lat_rad: float
    reported_lon_rad: float
    reported_us: int
    """When she was there, by the vessel's clock."""
    sigma_m: float
    """She is within two of these in 95 of 100 cases."""
    sog_mps: float | None = None
    cog_rad: float | None = None
    heading_rad: float | None = None
    at_rest: bool = False
    turn_radps: float | None = None
    """As reported; to starboard positive."""
    turn_sign: int = 0
    accurate: bool = False
    sog_is_least: bool = False
    status: int | None = None
    ship_type: int = 0
    sides: Sides | None = None
    name: str = ""
    callsign: str = ""
    range_m: float | None = None
    """From us to her antenna; None: we do not know where we are."""
    bearing_rad: float | None = None
    hull_m: float | None = None
    """From us to her hull, now; below 0: inside."""
    cpa_m: float | None = None
    """Least distance to her hull on both courses over ground."""
    tcpa_s: float | None = None
    """Until then; of a hull that we would hit or sail along, until its near end. ``TCPA_MOST_S``: later, if ever."""
    going_away: bool = False
    """With risk still: too near, but the distance to her hull only grows."""
    role: Role = Role.NONE
    danger: Danger = Danger.NONE

    def age_s(self, now_us: int) -> float:
        """Seconds since she was where she said."""
        return max(0.0, (now_us - self.reported_us) * 1e-6)

    @property
    def title(self) -> str:
        """Her name, or her number."""
        return self.name or f"{self.beacon or 'MMSI'} {self.mmsi}"

    @property
    def beacon(self) -> str:
        """What kind of distress beacon sends; empty for all others."""
        if self.kind not in (VesselKind.PERSON, VesselKind.BEACON_TEST):
            return ""
        return beacon_name(self.mmsi)


@value
class TrafficPicture:
    """All that is known of others: persons first, then the most dangerous, then by range."""

    vessels: tuple[OtherVessel, ...] = ()
    heard: bool = False
    """Whether any AIS receiver has been heard."""
    silent: bool = False
    """No AIS receiver is heard now."""
    close: bool = False
    """A vessel is within half the wanted clearance, or about to be."""
    lost: bool = False
    """A vessel with risk has not been heard for three of her intervals."""
    person: bool = False
    """A person's beacon is active; until it knows where it is, it is not among the vessels."""
    range_m: float = 2000.0
    """Vessels farther away are not shown as ADSB_VEHICLE."""
    as_adsb: bool = True

    @property
    def threats(self) -> tuple[OtherVessel, ...]:
        return tuple(vessel for vessel in self.vessels if vessel.danger is not Danger.NONE)


NO_TRAFFIC = TrafficPicture()
"""Nobody, and nobody who could tell."""
