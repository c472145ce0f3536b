"""Sensors without a boat: a known motion, the simulated talkers, the vessel's reader and estimator, in lock-step.

For tests, benchmarks and for trying a sensor setup: ``rig = SensorRig(circle(20.0, 1.5)); rig.run(60.0)``. The motion gives
the truth at any time, so errors of the chain from truth to estimate are the sensors' and the estimator's alone.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from companion.core.estimate import Estimator, EstimatorConfig
from companion.core.hull.geometry import HullGeometry
from companion.core.nmea import NmeaConfig, NmeaReader
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState, Severity
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import Truth
from sitl.sensors import SensorSuite, SimulatedSensors

_ORIGIN: Final = LocalFrame(math.radians(41.1850123), math.radians(-8.7062154))


@dataclass(frozen=True, slots=True)
class Pose:
    """The motion's state at one time: position from the origin, heading, ground velocity, turn rate, water speed."""

    north_m: float
    east_m: float
    psi_rad: float
    vn_mps: float
    ve_mps: float
    r_radps: float = 0.0
    u_mps: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    heave_m: float = 0.0


Motion = Callable[[float], Pose]


def circle(radius_m: float, speed_mps: float, current_mps: tuple[float, float] = (0.0, 0.0)) -> Motion:
    """Clockwise round the origin at a speed through the water, carried by a current (north, east)."""
    rate = speed_mps / radius_m

    def pose(t_s: float) -> Pose:
        angle = rate * t_s
        return Pose(
            north_m=radius_m * math.cos(angle) + current_mps[0] * t_s,
            east_m=radius_m * math.sin(angle) + current_mps[1] * t_s,
            psi_rad=wrap_pi(angle + 0.5 * math.pi),
            vn_mps=-speed_mps * math.sin(angle) + current_mps[0],
            ve_mps=speed_mps * math.cos(angle) + current_mps[1],
            r_radps=rate,
            u_mps=speed_mps,
        )

    return pose


def straight(speed_mps: float, course_rad: float, *, roll_rad: float = 0.0, wave_s: float = 3.0) -> Motion:
    """From the origin on a course; the hull may roll with a period."""

    def pose(t_s: float) -> Pose:
        vn, ve = speed_mps * math.cos(course_rad), speed_mps * math.sin(course_rad)
        roll = roll_rad * math.sin(2.0 * math.pi * t_s / wave_s)
        return Pose(vn * t_s, ve * t_s, course_rad, vn, ve, u_mps=speed_mps, roll_rad=roll)

    return pose


def truth_at(motion: Motion, t_us: int, frame: LocalFrame = _ORIGIN, depth_m: float | None = 8.0) -> Truth:
    """The motion's truth at one time."""
    pose = motion(t_us * 1e-6)
    lat_rad, lon_rad = frame.to_geodetic(pose.north_m, pose.east_m)
    return Truth(
        t_us=t_us,
        lat_rad=lat_rad,
        lon_rad=lon_rad,
        north_m=pose.north_m,
        east_m=pose.east_m,
        psi_rad=pose.psi_rad,
        u_mps=pose.u_mps,
        v_mps=0.0,
        r_radps=pose.r_radps,
        vn_mps=pose.vn_mps,
        ve_mps=pose.ve_mps,
        roll_rad=pose.roll_rad,
        pitch_rad=pose.pitch_rad,
        heave_m=pose.heave_m,
        depth_m=depth_m,
    )


class SensorRig:
    """One vessel's sensor chain under a known motion. ``state`` is the estimate at the last tick."""

    def __init__(
        self,
        motion: Motion,
        *,
        sensors: SimulatedSensors | None = None,
        nmea: NmeaConfig | None = None,
        estimate: EstimatorConfig | None = None,
        hull: HullGeometry | None = None,
        believed: HullGeometry | None = None,
        seed: int = 1,
        step_us: int = 10_000,
        tick_us: int = 50_000,
    ) -> None:
        self.motion = motion
        self.suite = SensorSuite(sensors or SimulatedSensors(), random.Random(seed), hull or HullGeometry())
        self.reader = NmeaReader(nmea or NmeaConfig())
        self.estimator = Estimator(estimate or EstimatorConfig(), believed or hull or HullGeometry())
        self.now_us = 0
        self.state = EstimatedState(0)
        self.truth = truth_at(motion, 0)
        self.texts: list[tuple[float, Severity, str]] = []
        self.knows_water_speed = True
        self._step_us = step_us
        self._tick_us = tick_us

    def run(self, seconds: float, each: Callable[[SensorRig], None] | None = None) -> None:
        """Advance; call ``each`` after every tick."""
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.now_us += self._step_us
            self.truth = truth_at(self.motion, self.now_us)
            for data in self.suite.step(self.now_us, self.truth):
                for item in self.reader.receive(data, self.now_us):
                    self.estimator.update(item)
            if self.now_us % self._tick_us == 0:
                self._tick()
                if each is not None:
                    each(self)

    def error_m(self) -> float | None:
        """Horizontal distance of the estimate from the truth; None without a position."""
        state, origin = self.state, self.estimator.origin
        if state.lat_rad is None or state.lon_rad is None or origin is None:
            return None
        north_m, east_m = _ORIGIN.to_local(state.lat_rad, state.lon_rad)
        return math.hypot(north_m - self.truth.north_m, east_m - self.truth.east_m)

    def _tick(self) -> None:
        for item in self.reader.poll(self.now_us):
            self.estimator.update(item)
        self.estimator.note_water_speed(self.truth.u_mps if self.knows_water_speed else None)
        self.state = self.estimator.predict(self.now_us, None)
        for severity, text in (*self.reader.drain_texts(), *self.estimator.drain_texts()):
            self.texts.append((self.now_us * 1e-6, severity, text))
