"""How far a vessel still runs: coasting (closed form, ``vessel.stopping_distance_m``) and with full astern thrust.

Both through the water, in metres, without any reaction time; whoever uses them adds that.
"""

from __future__ import annotations

from companion.core.vessel import VesselConfig, drag_n, full_astern_n

_STEPS = 16


def braking_distance_m(vessel: VesselConfig, speed_mps: float) -> float:
    """Way made from ``speed_mps`` to rest under full astern thrust, m.

    Integral of m11 u du / (F + (Xu + Xuu u) u) by Simpson's rule; the thrusters' spin-up counts as coasting at full
    speed for one time constant.
    """
    speed = abs(speed_mps)
    force_n = 2.0 * full_astern_n(vessel)
    width = speed / _STEPS

    def way(u_mps: float) -> float:
        return vessel.hull.m11_kg * u_mps / (force_n + drag_n(vessel, u_mps))

    inner = sum((4.0 if i % 2 else 2.0) * way(i * width) for i in range(1, _STEPS))
    return (inner + way(speed)) * width / 3.0 + speed * vessel.thruster.lag_s
