"""How far a vessel still runs: coasting (closed form, ``vessel.stopping_distance_m``) and with full astern thrust.

Both through the water, in metres, without any reaction time; whoever uses them adds that.
"""

from __future__ import annotations

from .left import WHOLE, Shares
from .statics import Statics
from .thrust import ThrustLaw
from .vessel_file import VesselConfig

_STEPS = 16
"""Simpson's rule with so many is exact to a millimetre for drag of first and second order."""


def braking_distance_m(vessel: VesselConfig, speed_mps: float, shares: Shares = WHOLE) -> float:
    """Way made from ``speed_mps`` to rest under full astern thrust, m; ``shares``: what each thruster gives of its own.

    Integral of m11 u du / (F + (Xu + Xuu u) u) by Simpson's rule; the thrusters' spin-up counts as coasting at full
    speed for one time constant. Water that comes from ahead takes nothing from thrust astern.
    """
    speed = abs(speed_mps)
    sides, m11, drag_n = ThrustLaw(vessel).sides, vessel.hull.m11_kg, Statics(vessel).drag_n
    force_n = shares[0] * sides[0].astern_n + shares[1] * sides[1].astern_n
    width = speed / _STEPS
    inner = 0.0
    for i in range(1, _STEPS):
        mps = i * width
        inner += (4.0 if i % 2 else 2.0) * (m11 * mps / (force_n + drag_n(mps)))
    last = m11 * speed / (force_n + drag_n(speed))
    return vessel.stopping_factor * ((inner + last) * width / 3.0 + speed * vessel.thruster.lag_s)
