"""The vessel's state through its real chain: simulated sensors, NMEA sentences, reader, estimator."""

from __future__ import annotations

import math
import random
from collections import deque

from companion.core.estimate import Estimator, EstimatorConfig
from companion.core.nmea import NmeaConfig, NmeaReader
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import EstimatedState
from sitl.plant import SimVessel, Truth
from sitl.sensors import SensorSuite, SimulatedSensors
from tools.benches.cells.control_loop import ORIGIN_RAD, TICK_S

_TEST_M = 100.0


class SensedState:
    """A state source for ``ControlLoop``: every figure went through a sentence."""

    def __init__(
        self,
        seed: int,
        config: SimulatedSensors | None = None,
        heading_bias_deg: float = 0.0,
        *,
        heading_late_s: float = 0.0,
        told: NmeaConfig = NmeaConfig(),  # noqa: B008 - frozen
    ) -> None:
        """``heading_late_s``: heading and turn rate are so old when they are sent; ``told``: what the settings say of it."""
        config = config or SimulatedSensors(depth_hz=0.0)
        self.sensors = SensorSuite(config, random.Random(f"sensors {seed}"))
        self.sensors.faults.heading_bias_deg = heading_bias_deg
        self.estimator = Estimator(EstimatorConfig(heading_late_s=told.heading_latency_s))
        self._reader = NmeaReader(told)
        self._bow: deque[tuple[float, float]] = deque(maxlen=round(heading_late_s / TICK_S) + 1)
        # a plane is enough within the few hundred metres of a test run, and ten times faster
        frame = LocalFrame(*ORIGIN_RAD)
        north, east = frame.to_geodetic(_TEST_M, 0.0), frame.to_geodetic(0.0, _TEST_M)
        self._lat_per_m = (north[0] - ORIGIN_RAD[0]) / _TEST_M
        self._lon_per_m = (east[1] - ORIGIN_RAD[1]) / _TEST_M

    def sense(self, now_us: int, vessel: SimVessel, water_mps: float | None, sway_mps: float = 0.0) -> EstimatedState:
        for sentence in self.sensors.step(now_us, self._truth(now_us, vessel)):
            for measurement in self._reader.receive(sentence, now_us):
                self.estimator.update(measurement)
        for measurement in self._reader.poll(now_us):
            self.estimator.update(measurement)
        self.estimator.note_water_speed(water_mps, sway_mps)
        return self.estimator.predict(now_us)

    def _truth(self, now_us: int, vessel: SimVessel) -> Truth:
        self._bow.append((vessel.psi_rad, vessel.r_radps))
        return Truth(
            t_us=now_us,
            lat_rad=ORIGIN_RAD[0] + vessel.north_m * self._lat_per_m,
            lon_rad=ORIGIN_RAD[1] + vessel.east_m * self._lon_per_m / self._narrowing(vessel.north_m),
            north_m=vessel.north_m,
            east_m=vessel.east_m,
            psi_rad=self._bow[0][0],
            u_mps=vessel.u_mps,
            v_mps=vessel.v_mps,
            r_radps=self._bow[0][1],
            vn_mps=vessel.vn_mps,
            ve_mps=vessel.ve_mps,
            roll_rad=vessel.roll_rad,
            pitch_rad=vessel.pitch_rad,
            heave_m=vessel.heave_m,
        )

    def _narrowing(self, north_m: float) -> float:
        """Meridians draw together: cos(latitude) over that of the origin."""
        return math.cos(ORIGIN_RAD[0] + north_m * self._lat_per_m) / math.cos(ORIGIN_RAD[0])


LATE_S = 0.25


def late_eyes(seed: int, told: NmeaConfig = NmeaConfig()) -> SensedState:  # noqa: B008 - frozen
    """A compass 0.25 s late, and a receiver without corrections that tells once a second; ``told``: what the settings say of it."""
    sensors = SimulatedSensors(depth_hz=0.0, grade="standalone", fix_hz=1.0)
    return SensedState(seed, sensors, heading_late_s=LATE_S, told=told)
