"""Truth to sentences to estimate: within 1 cm plus the sentences' own resolution, anywhere and at any speed and rate."""

from __future__ import annotations

import math
import random

from hypothesis import given, settings, strategies as st

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.geodesy import LocalFrame, inverse
from mavlink_bridge.language.units import wrap_pi
from mavlink_bridge.mavlink.wire.mapping import rad_to_degE7
from sitl.sensors import nmea_writer as write
from sitl.sensors.talkers import SensorSuite, SimulatedSensors
from tools.benches.cells.sensor_rig import Motion, circle, straight, truth_at

RESOLUTION_M = 2e-4
"""1e-7 minute is 0.19 mm."""


def worst(
    motion: Motion, frame: LocalFrame, config: SimulatedSensors, step_us: int, seconds: float
) -> tuple[float, float, float]:
    """Largest error of position (m), heading (rad) and velocity (m/s) once the filters have settled."""
    suite, reader = (
        SensorSuite(config, random.Random(1)),
        NmeaReader(NmeaConfig(position_latency_s=config.fix_latency_s)),
    )
    estimator = Estimator(EstimatorConfig())
    position_m = heading_rad = velocity_mps = 0.0
    for now_us in range(step_us, round(seconds * 1e6) + 1, step_us):
        truth = truth_at(motion, now_us, frame)
        for line in suite.step(now_us, truth):
            for item in reader.receive(line, now_us):
                estimator.update(item)
        for item in reader.poll(now_us):
            estimator.update(item)
        if now_us % 50_000 or now_us < 4_000_000:
            continue
        state = estimator.predict(now_us)
        position_m = max(position_m, inverse(state.lat_rad, state.lon_rad, truth.lat_rad, truth.lon_rad)[0])
        heading_rad = max(heading_rad, abs(wrap_pi(state.psi_rad - truth.psi_rad)))
        velocity_mps = max(velocity_mps, math.hypot(state.vx_mps - truth.vn_mps, state.vy_mps - truth.ve_mps))
    return position_m, heading_rad, velocity_mps


_corners = [(0.0, 0.0002), (0.0, 180.0), (-45.0, -180.0), (41.185, -8.7062), (59.9999, 179.99999)]
_anywhere = st.tuples(st.floats(-80.0, 80.0), st.floats(-180.0, 180.0)) | st.sampled_from(_corners)
# what a receiver writes as 0 N 0 E is no fix
_places = _anywhere.filter(lambda place: max(map(abs, place)) > 1e-4)


@given(_places, st.floats(0.0, 6.0), st.floats(-math.pi, math.pi))
@settings(max_examples=15, deadline=None)
def test_straight_ahead_anywhere(place: tuple[float, float], speed_mps: float, course_rad: float) -> None:
    frame = LocalFrame(math.radians(place[0]), math.radians(place[1]))
    position_m, heading_rad, velocity_mps = worst(
        straight(speed_mps, course_rad), frame, SimulatedSensors(grade="ideal"), 50_000, 8.0
    )
    assert position_m <= 0.01 + RESOLUTION_M
    assert heading_rad <= math.radians(0.01)
    assert velocity_mps <= 0.01


@given(
    st.floats(8.0, 60.0),
    st.floats(0.3, 2.5),
    st.sampled_from([1.0, 2.0, 5.0, 10.0, 20.0]),
    st.sampled_from([0.0, 0.05, 0.12, 0.25]),
    st.sampled_from([10_000, 50_000]),
)
@settings(max_examples=15, deadline=None)
def test_round_a_circle_at_any_rate_and_latency(
    radius_m: float, speed_mps: float, fix_hz: float, latency_s: float, step_us: int
) -> None:
    frame = LocalFrame(math.radians(41.185), math.radians(-8.7062))
    config = SimulatedSensors(grade="ideal", fix_hz=fix_hz, fix_latency_s=latency_s, rate_hz=20.0, heading_hz=20.0)
    position_m, heading_rad, _ = worst(circle(radius_m, speed_mps), frame, config, step_us, 12.0)
    assert position_m <= 0.01 + RESOLUTION_M
    assert heading_rad <= math.radians(0.05)


@given(st.integers(-900_000_000, 900_000_000), st.integers(-1_800_000_000, 1_800_000_000))
@settings(max_examples=500, deadline=None)
def test_a_sentence_reaches_the_ground_station_to_the_last_1e7th_of_a_degree(lat_e7: int, lon_e7: int) -> None:
    lat_rad, lon_rad = math.radians(lat_e7 / 1e7), math.radians(lon_e7 / 1e7)
    sentence = write.gga("GP", "120000.00", write.fix_text(lat_rad, lon_rad, 0.0, None), 4, 12, 0.8, 1.0, 52.0)
    reader = NmeaReader(NmeaConfig())
    (fix,) = [*reader.receive(sentence, 0), *reader.poll(1_000_000)]
    assert (rad_to_degE7(fix.lat_rad, 0), rad_to_degE7(fix.lon_rad, 0)) == (lat_e7, lon_e7)
