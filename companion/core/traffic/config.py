"""Settings of the traffic watch."""

from __future__ import annotations

from pydantic import Field

from ..config import Config, param


class TrafficConfig(Config):
    """Other vessels by AIS."""

    enabled: bool = param(True, "AIS_ENABLE", "Watch other vessels where a sensor link carries AIS")
    own_mmsi: int = Field(0, ge=0, le=999_999_999)
    """The number of a transponder on board: its reports are us. 0: none; one that moves with us for a minute is found and told."""
    required: bool = param(False, "TRAF_REQUIRED", "Warn while no AIS receiver is heard at all")
    ship_distance_m: float = param(
        40.0, "TRAF_DIST_SHIP", "Wanted clearance to the hull of a vessel of 20 m and more", unit="m", ge=1, le=1000
    )
    small_distance_m: float = param(
        20.0, "TRAF_DIST_SMALL", "Wanted clearance to the hull of a smaller vessel", unit="m", ge=1, le=1000
    )
    look_ahead_s: float = param(180.0, "TRAF_TIME", "How far ahead risk is looked for", unit="s", ge=30, le=600)
    shown_range_m: float = param(
        2000.0, "TRAF_RANGE", "Vessels farther away are not shown as ADSB_VEHICLE", unit="m", ge=100, le=50_000
    )
    show_as_adsb: bool = param(True, "TRAF_ADSB", "Show vessels to QGroundControl, as ADSB_VEHICLE")
    track_life_s: float = param(
        600.0, "TRAF_TRACK_LIFE", "A vessel not heard for so long is forgotten", unit="s", ge=60, le=7200
    )
