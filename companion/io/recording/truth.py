"""``truth.csv``: what the simulated vessel really did, one row for each tick (columns: DESIGN's contract)."""

from __future__ import annotations

from typing import Final

TRUTH_COLUMNS: Final = (
    "t_s,lat_deg,lon_deg,north_m,east_m,heading_deg,surge_mps,sway_mps,yaw_rate_dps,sog_mps,"
    "thruster_port,thruster_starboard,rudder_port_deg,rudder_starboard_deg,depth_m,altitude_m,mode,armed,item"
)


_F = float
TruthRow = tuple[_F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, _F, bytes, int, int]
"""One row, in the order of the columns; a plain tuple, which the format takes as it is."""
_ROW: Final = b"%.3f,%.9f,%.9f,%.4f,%.4f,%.4f,%.5f,%.5f,%.5f,%.5f,%.4f,%.4f,%.3f,%.3f,%.3f,%.3f,%b,%d,%d\n"  # one pass


def truth_row(row: TruthRow) -> bytes:
    """One line of truth.csv."""
    return _ROW % row
