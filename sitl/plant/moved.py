"""A hull that is taken along: its heading and speed follow a table, whatever its actuators do.

The seed's task Navigation/Waypoints tried the control law so: the states come as a list and do not answer to what the law asks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pydantic import Field

from companion.core.config import Config
from companion.core.hull import VesselConfig
from mavlink_bridge.language.units import wrap_pi

from .hull import SimVessel
from .water import Conditions


class Motion(Config):
    """Where the table stands at one time; between two times it is straight, after the last it stays."""

    t_s: float = Field(ge=0)
    """Seconds from the start."""
    heading_deg: float = Field(ge=-720, le=720)
    """Counted on through north, so that the table says which way round."""
    speed_mps: float = Field(ge=-10, le=10)
    """Ahead, through the water."""


class MovedVessel(SimVessel):
    """A hull whose actuators move and whose heading and speed are given."""

    def __init__(self, config: VesselConfig, table: Sequence[Motion]) -> None:
        super().__init__(config)
        self._table = sorted(table, key=lambda row: row.t_s)
        self._t_s = 0.0
        self._take()

    def _sail(self, dt_s: float, water: Conditions) -> None:
        """Move the hull along the table."""
        self._t_s += dt_s
        self._take()
        self.vn_mps, self.ve_mps = self.ground_velocity(water)
        self.north_m += self.vn_mps * dt_s
        self.east_m += self.ve_mps * dt_s

    def _take(self) -> None:
        rows, now_s = self._table, self._t_s
        after = next((at for at, row in enumerate(rows) if row.t_s > now_s), len(rows))
        before, then = rows[max(after - 1, 0)], rows[min(after, len(rows) - 1)]
        span_s = then.t_s - before.t_s
        share = (now_s - before.t_s) / span_s if span_s > 0.0 and now_s > before.t_s else 0.0
        turned_deg = then.heading_deg - before.heading_deg
        self.psi_rad = wrap_pi(math.radians(before.heading_deg + share * turned_deg))
        self.u_mps = before.speed_mps + share * (then.speed_mps - before.speed_mps)
        self.r_radps = math.radians(turned_deg) / span_s if span_s > 0.0 and now_s >= before.t_s else 0.0
        self.v_mps = 0.0
