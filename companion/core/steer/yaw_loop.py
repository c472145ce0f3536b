"""The heading loop of one vessel at one speed, in the frequency domain: the hull's sway and yaw, linear, from the force
model; the actuators that the allocation would use there, each with its own lag; a delay; and a PD with integral.

Margins are read off the exact frequency response and stability off Nyquist's count, so a hull that is unstable by itself
is judged as well as any other. Plain Python: the vessel's own process asks it at start. ``companion tune margins`` works
the same margins out with python-control.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Protocol

from ..hull import ForceModel, VesselConfig
from ..hull.statics import drag_n
from .allocation import Allocator

DELAY_S = 0.15
"""Delay that every shipped gain set must bear: sensors, computation, links."""
_STEP = 1.12
"""20 frequencies a decade: between two the phase moves by less than 5 degrees."""
_FREQUENCIES = tuple(0.03 * 0.25**k for k in range(8, 0, -1)) + tuple(0.03 * _STEP**k for k in range(64))
"""Up to 38 rad/s, where every actuator here has long let go; from so low that a hull's slowest pole is counted."""
_NUDGE = 1e-4
"""Step of the differences by which the force model is made linear, m/s and rad/s and rad."""


@dataclass(frozen=True, slots=True)
class LoopMargins:
    """How far the loop is from losing stability; zero when it has none."""

    gain_db: float
    """Least change of gain, up or down."""
    phase_deg: float


UNSTABLE = LoopMargins(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class YawPlant:
    """Yaw moment asked of the allocation -> yaw rate, at one speed."""

    a: tuple[float, float, float, float]
    """Sway and yaw accelerations per sway and yaw rate: vv, vr, rv, rr."""
    by_rudder: tuple[float, float]
    """Sway and yaw acceleration per Nm asked, through the rudders; zero without."""
    by_thrust: tuple[float, float]
    rudder_lag_s: float
    thruster_lag_s: float

    @property
    def unstable_poles(self) -> int:
        """How many of the hull's two poles lie in the right half plane."""
        vv, vr, rv, rr = self.a
        trace, det = vv + rr, vv * rr - vr * rv
        if det < 0.0:
            return 1
        return 2 if trace > 0.0 else 0

    @property
    def grows_per_s(self) -> float:
        """Real part of the hull's fastest growing, or slowest dying, motion in sway and yaw, 1/s; positive: it turns away by itself."""
        vv, vr, rv, rr = self.a
        half, det = 0.5 * (vv + rr), vv * rr - vr * rv
        return half + math.sqrt(max(0.0, half * half - det))

    def response(self, omega: float, delay_s: float) -> complex:
        """Return yaw rate over moment at a frequency in rad/s."""
        s = complex(0.0, omega)
        vv, vr, rv, rr = self.a
        rudder, thrust = 1.0 / (1.0 + s * self.rudder_lag_s), 1.0 / (1.0 + s * self.thruster_lag_s)
        sway = self.by_rudder[0] * rudder + self.by_thrust[0] * thrust
        yaw = self.by_rudder[1] * rudder + self.by_thrust[1] * thrust
        return (rv * sway + (s - vv) * yaw) / ((s - vv) * (s - rr) - vr * rv) * cmath.exp(-s * delay_s)


def yaw_plant(vessel: VesselConfig, speed_mps: float) -> YawPlant:
    """Return the linear plant at a speed through the water, thrust holding that speed."""
    model = ForceModel(vessel)
    each_n = 0.5 * drag_n(vessel, speed_mps)

    def rates(v: float, r: float, rudder_rad: float, half_n: float) -> tuple[float, float]:
        _, dv, dr = model.rates(
            speed_mps,
            v,
            r,
            thrust_port_n=each_n + half_n,
            thrust_starboard_n=each_n - half_n,
            rudder_port_rad=rudder_rad,
            rudder_starboard_rad=rudder_rad,
        )
        return dv, dr

    def slope(v: float, r: float, rudder_rad: float, half_n: float) -> tuple[float, float]:
        more, less = rates(v, r, rudder_rad, half_n), rates(-v, -r, -rudder_rad, -half_n)
        return (more[0] - less[0]) / (2.0 * _NUDGE), (more[1] - less[1]) / (2.0 * _NUDGE)

    (vv, rv), (vr, rr) = slope(_NUDGE, 0.0, 0.0, 0.0), slope(0.0, _NUDGE, 0.0, 0.0)
    asked_nm = 0.05 * model.lateral_m * each_n + 1e-3
    given = Allocator(vessel, model).allocate(2.0 * each_n, asked_nm, speed_mps)
    by_rudder = by_thrust = (0.0, 0.0)
    if given.angle_rad:
        v_part, r_part = slope(0.0, 0.0, _NUDGE, 0.0)
        per_nm = given.angle_rad / asked_nm
        by_rudder = (v_part * per_nm, r_part * per_nm)
    if model.lateral_m:
        v_part, r_part = slope(0.0, 0.0, 0.0, _NUDGE)
        by_rudder_nm = 0.5 * model.rudder_slope_nm(speed_mps, each_n, each_n) * math.sin(2.0 * given.angle_rad)
        half_per_nm = (given.yaw_nm - by_rudder_nm) / (2.0 * model.lateral_m * asked_nm)
        by_thrust = (v_part * half_per_nm, r_part * half_per_nm)
    return YawPlant((vv, vr, rv, rr), by_rudder, by_thrust, vessel.helm_lag_s, vessel.thruster.lag_s)


class TurnResponse(Protocol):
    """What a loop is judged by: how the yaw rate answers."""

    @property
    def unstable_poles(self) -> int: ...

    def response(self, omega: float, delay_s: float) -> complex: ...


class LoopJudge:
    """One plant's response, kept, so that many gains can be tried on it."""

    def __init__(self, plant: TurnResponse, delay_s: float = DELAY_S) -> None:
        self._turns = 2 + 2 * plant.unstable_poles
        self._samples = [(w, plant.response(w, delay_s)) for w in _FREQUENCIES]

    def margins(self, kp: float, ki: float, kd: float) -> LoopMargins:
        """Return the margins with gains in Nm/rad, Nm/(rad s), Nm/(rad/s).

        Nyquist: from low to high frequency 1 + L turns by a quarter circle for each pole at the origin and by a half for
        each unstable pole of the hull, else the closed loop is unstable.
        """
        turned, last_angle = 0.0, None
        gain, phase = math.inf, math.pi
        origin = 2 if ki > 0.0 else 1
        before: complex | None = None
        for w, rate in self._samples:
            # kp + ki/s + kd s, times 1/s
            loop = complex(kd - ki / (w * w), -kp / w) * rate
            angle = cmath.phase(1.0 + loop)
            if last_angle is not None:
                turned += math.remainder(angle - last_angle, 2.0 * math.pi)
            last_angle = angle
            if before is not None:
                gain, phase = _crossings(before, loop, gain, phase)
            before = loop
        wanted = 0.5 * math.pi * (origin + self._turns - 2)
        if abs(turned - wanted) > 0.5 * math.pi:
            return UNSTABLE
        return LoopMargins(20.0 * math.log10(gain) if gain < math.inf else math.inf, math.degrees(phase))


def _crossings(before: complex, loop: complex, gain: float, phase: float) -> tuple[float, float]:
    """Take the crossings of the negative real axis (gain, as a factor of at least 1) and of the unit circle (phase)."""
    if (before.imag < 0.0) != (loop.imag < 0.0):
        part = before.imag / (before.imag - loop.imag)
        real = before.real + part * (loop.real - before.real)
        if real < 0.0:
            size = -real
            gain = min(gain, size if size > 1.0 else 1.0 / size)
    small, large = abs(before), abs(loop)
    if (small < 1.0) != (large < 1.0):
        part = (1.0 - small) / (large - small)
        crossing = before + part * (loop - before)
        phase = min(phase, math.pi - abs(cmath.phase(crossing)))
    return gain, phase
