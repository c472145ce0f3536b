"""``truth.csv``: what the simulated vessel really did, one row for each tick (columns: DESIGN's contract)."""

from __future__ import annotations

from typing import Final, NamedTuple

TRUTH_COLUMNS: Final = (
    "t_s,lat_deg,lon_deg,north_m,east_m,heading_deg,surge_mps,sway_mps,yaw_rate_dps,sog_mps,"
    "thruster_port,thruster_starboard,rudder_port_deg,rudder_starboard_deg,depth_m,altitude_m,mode,armed,item"
)


class Truth(NamedTuple):
    """One row, in the order of the columns."""

    t_s: float
    lat_deg: float
    lon_deg: float
    north_m: float
    east_m: float
    heading_deg: float
    surge_mps: float
    sway_mps: float
    yaw_rate_dps: float
    sog_mps: float
    thruster_port: float
    thruster_starboard: float
    rudder_port_deg: float
    rudder_starboard_deg: float
    depth_m: float
    altitude_m: float
    mode: str
    armed: int
    item: int


_ROW: Final = (
    "%.3f,%.9f,%.9f,%.4f,%.4f,%.4f,%.5f,%.5f,%.5f,%.5f,%.4f,%.4f,%.3f,%.3f,%.3f,%.3f,%s,%d,%d\n"  # one format, one pass
)


def truth_row(truth: Truth) -> bytes:
    """One line of truth.csv."""
    return (_ROW % truth).encode()
