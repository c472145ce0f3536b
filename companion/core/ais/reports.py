"""What AIS stations say, in SI units and radians; None wherever the standard's "not available" stands (ITU-R M.1371 annex 8)."""

from __future__ import annotations

from enum import Enum

from mavlink_bridge.language.traffic import Sides
from mavlink_bridge.language.value import value


class StationClass(Enum):
    """How a position was sent; it decides how often and how exactly."""

    CLASS_A = "class A"
    """Types 1 to 3."""
    CLASS_B = "class B"
    """Types 18 and 19."""
    SAR_AIRCRAFT = "search and rescue aircraft"
    """Type 9."""
    LONG_RANGE = "long range"
    """Type 27: to a tenth of a minute, for a picture only."""


class FixState(Enum):
    """What the seconds field says instead of a second."""

    GOOD = "good"
    """A second of a fix."""
    NO_TIME = "no time stamp"
    """60."""
    MANUAL = "manual input"
    """61."""
    DEAD_RECKONING = "dead reckoning"
    """62."""
    INOPERATIVE = "inoperative"
    """63."""


@value
class PositionReport:
    """Types 1, 2, 3, 9, 18, 19 and 27."""

    mmsi: int
    repeat: int
    """How often relays have sent it on, 0-3."""
    sent: StationClass
    lat_rad: float | None
    """Latitude and longitude are known or unknown together."""
    lon_rad: float | None
    sog_mps: float | None
    cog_rad: float | None
    """From north, [0, 2 pi)."""
    heading_rad: float | None = None
    """From north, [0, 2 pi)."""
    second: int | None = None
    """UTC second of the fix, 0-59."""
    fix: FixState = FixState.NO_TIME
    accurate: bool = False
    """Better than 10 m."""
    raim: bool = False
    sog_is_least: bool = False
    """That fast or faster."""
    status: int | None = None
    """Navigational status, 0-15, numbers of ITU-R M.1371; class B has none."""
    turn_radps: float | None = None
    """Rate of turn, to starboard positive."""
    turn_sign: int = 0
    """+1 or -1: turns to starboard or port faster than 5 degrees in 30 s, without a value."""
    altitude_m: int | None = None
    """Of an aircraft; 4094: that or higher."""
    carrier_sense: bool | None = None
    """Class B: waits for a gap before it sends (CS) instead of keeping slots (SO)."""
    late: bool = False
    """Type 27: the position is older than 5 s."""

    @property
    def has_position(self) -> bool:
        return self.lat_rad is not None


@value
class StaticReport:
    """Types 5, 19, 24 A and 24 B: what does not change under way. None: this message does not say."""

    mmsi: int
    repeat: int
    kind: int
    """Type of the message, for what it leaves out: 5, 19 or 24."""
    name: str | None = None
    """Empty: said to be unknown."""
    callsign: str | None = None
    ship_type: int | None = None
    """Type of ship and cargo, 0-255, numbers of ITU-R M.1371 table 53; 0: not said."""
    dimensions: Sides | None = None
    imo: int | None = None
    draught_m: float | None = None
    """Static, at most 25.5 (that or more)."""
    destination: str | None = None
    fix_type: int | None = None
    """Kind of positioning device, 0-15; 0: not said."""
    vendor: str | None = None
    mothership: int | None = None
    """MMSI of the ship that a craft belongs to."""
    class_b: bool = False


@value
class BaseStation:
    """Type 4: a station on shore, never a vessel."""

    mmsi: int
    repeat: int
    lat_rad: float | None
    lon_rad: float | None
    accurate: bool
    utc: tuple[int, int, int, int, int, int] | None
    """Year, month, day, hour, minute, second."""


@value
class AidToNavigation:
    """Type 21: a buoy, a beacon, or one that is only broadcast."""

    mmsi: int
    repeat: int
    aid_type: int
    """0-31, numbers of ITU-R M.1371 table 74."""
    name: str
    lat_rad: float | None
    lon_rad: float | None
    accurate: bool
    dimensions: Sides | None
    second: int | None
    off_position: bool | None
    """Away from its place; None: cannot say (fixed, or without a time)."""
    virtual: bool
    """There is nothing in the water."""


@value
class SafetyText:
    """Type 14: a safety message to everybody."""

    mmsi: int
    repeat: int
    text: str


AisReport = PositionReport | StaticReport | BaseStation | AidToNavigation | SafetyText
