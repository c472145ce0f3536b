"""How fast a heading loop may be: the bandwidth that still leaves its margins at a stated delay, worked out from the file.

The loop is PD and integral on a hull of inertia M and damping d, behind one actuator lag and a delay; its frequency
response is scanned. The tuning command checks the result against the whole linearised vessel.
"""

from __future__ import annotations

import cmath
import math

DELAY_S = 0.15
"""Delay that every shipped gain set must bear: sensors, computation, links."""
_PHASE_RAD = math.radians(47.0)
_GAIN = 10.0 ** (9.0 / 20.0)
"""What is asked of the simple model; the whole one may lose a little of it."""
_FREQUENCIES = tuple(0.05 * 1.12**k for k in range(60))


def heading_bandwidth(inertia: float, damping: float, lag_s: float, zeta: float, integral: float, most: float) -> float:
    """Return the greatest bandwidth up to ``most`` (rad/s) with the margins; a fifth of ``most`` where none has them.

    ``inertia`` in kg m², ``damping`` in Nm/(rad/s), ``integral`` as a share of the proportional gain per second.
    """
    for step in range(20, 3, -1):
        omega = most * step / 20.0
        if _holds(damping / inertia, lag_s, omega, zeta, integral):
            return omega
    return 0.2 * most


def _holds(damping: float, lag_s: float, omega: float, zeta: float, integral: float) -> bool:
    """True when the loop, per unit of inertia, keeps both margins."""
    kp = omega * omega
    kd = max(2.0 * zeta * omega - damping, 0.0)
    last_size, last_phase = math.inf, 0.0
    for w in _FREQUENCIES:
        s = complex(0.0, w)
        loop = (kp + kp * integral / s + kd * s) / (s * (s + damping)) / (1.0 + s * lag_s) * cmath.exp(-s * DELAY_S)
        size, phase = abs(loop), cmath.phase(loop)
        phase -= 2.0 * math.pi if phase > 0.0 else 0.0
        if last_size > 1.0 >= size and phase < -math.pi + _PHASE_RAD:
            return False
        if last_phase > -math.pi >= phase and size > 1.0 / _GAIN:
            return False
        last_size, last_phase = size, phase
    return True
