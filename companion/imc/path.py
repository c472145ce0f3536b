"""The path that the vehicle is on, as IMC tells it, from what its guidance says over MAVLink."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.imc import PathControlState, PathFlags
from mavlink_bridge.language.units import wrap_pi
from mavlink_bridge.mavlink.wire.mapping import degE7_to_rad

from .motion import estimated_state
from .picture import ImcPicture

_UNKNOWN_ETA: Final = 0xFFFF
_SAME_RAD: Final = 2e-7
"""A target that is nearer than about a metre to the last one is the same target."""


class PathTeller:
    """Remembers where the present path began: MAVLink tells its end only."""

    def __init__(self) -> None:
        self._reference = 0
        self._start = (0.0, 0.0)
        self._end: tuple[float, float] | None = None

    def tell(self, picture: ImcPicture, now_us: int) -> PathControlState | None:
        """The path now; None while the vehicle makes for nothing."""
        nav, target = (
            picture.fresh("NAV_CONTROLLER_OUTPUT", now_us),
            picture.fresh("POSITION_TARGET_GLOBAL_INT", now_us),
        )
        state = estimated_state(picture, now_us)
        if nav is None or target is None or state is None:
            self._end = None
            return None
        lat_rad, lon_rad = degE7_to_rad(target.lat_int), degE7_to_rad(target.lon_int)
        if lat_rad is None or lon_rad is None:
            return None
        self._note((lat_rad, lon_rad), (state.lat_rad, state.lon_rad))
        orbit = picture.fresh("ORBIT_EXECUTION_STATUS", now_us)
        speed_mps = math.hypot(state.vx_mps, state.vy_mps)
        flags = PathFlags.NO_Z | (PathFlags.LOITERING if orbit is not None else PathFlags(0))
        if orbit is not None and orbit.radius < 0.0:
            flags |= PathFlags.CCLOCKW
        course_rad = math.atan2(state.vy_mps, state.vx_mps) if speed_mps > 0.0 else state.psi_rad
        return PathControlState(
            path_ref=self._reference,
            start_lat_rad=self._start[0],
            start_lon_rad=self._start[1],
            end_lat_rad=lat_rad,
            end_lon_rad=lon_rad,
            lradius_m=abs(orbit.radius) if orbit is not None else 0.0,
            flags=flags,
            x_m=float(nav.wp_dist),
            y_m=nav.xtrack_error,
            vx_mps=speed_mps,
            course_error_rad=wrap_pi(course_rad - math.radians(nav.target_bearing)),
            eta_s=min(round(nav.wp_dist / speed_mps), _UNKNOWN_ETA) if speed_mps > 0.1 else _UNKNOWN_ETA,
        )

    def _note(self, end: tuple[float, float], here: tuple[float, float]) -> None:
        if self._end is None or max(abs(end[0] - self._end[0]), abs(end[1] - self._end[1])) > _SAME_RAD:
            self._reference += 1
            self._start, self._end = here, end
