"""How good the estimate is: latency, lever arms, offsets, variation, drift, and the accuracy that control needs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.hull.geometry import HullGeometry
from companion.core.nmea.reader import NmeaConfig
from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, FixType, GpsFix, Source
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors.talkers import SimulatedSensors, Truth
from tools.benches.cells.sensor_rig import Motion, Pose, SensorRig, circle, straight

IDEAL = SimulatedSensors(grade="ideal")


def errors(made: SensorRig, seconds: float) -> list[float]:
    found: list[float] = []
    made.run(seconds, lambda here: found.append(here.error_m()))
    assert None not in found
    return found


def rms(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def test_rtk_class_estimate_on_a_circle_of_20_m_at_1_5_mps() -> None:
    made = SensorRig(circle(20.0, 1.5), seed=3)
    made.run(10.0)
    found = errors(made, 90.0)
    assert rms(found) < 0.05
    assert max(found) < 0.15


@pytest.mark.parametrize(("grade", "limit_m"), [("sbas", 2.5), ("standalone", 6.0)])
def test_coarser_classes_add_only_their_own_wander(grade: str, limit_m: float) -> None:
    made = SensorRig(circle(20.0, 1.5), sensors=SimulatedSensors(grade=grade))
    made.run(10.0)
    assert max(errors(made, 60.0)) < limit_m


@pytest.mark.parametrize("latency_s", [0.0, 0.12, 0.5])
def test_known_latency_is_made_up_for(latency_s: float) -> None:
    made = SensorRig(
        circle(20.0, 2.5),
        sensors=IDEAL.model_copy(update={"fix_latency_s": latency_s}),
        nmea=NmeaConfig(position_latency_s=latency_s),
    )
    made.run(10.0)
    assert max(errors(made, 20.0)) < 0.03


def test_latency_that_is_not_told_is_seen_along_the_track() -> None:
    made = SensorRig(straight(2.0, 0.3), sensors=IDEAL, nmea=NmeaConfig(position_latency_s=0.0))
    made.run(10.0)
    assert rms(errors(made, 5.0)) == pytest.approx(0.24, abs=0.02)


def rolling(t_s: float) -> Motion:
    return straight(1.5, 0.4, roll_rad=math.radians(8.0))(t_s)


@pytest.mark.parametrize("motion", [circle(20.0, 1.5), rolling])
def test_antenna_lever_arm(motion: Motion) -> None:
    sensors = IDEAL.model_copy(update={"attitude_sentence": "PASHR"})
    hull = HullGeometry(antenna=(1.2, -0.4, -1.5))
    made = SensorRig(motion, sensors=sensors, hull=hull)
    made.run(10.0)
    assert max(errors(made, 10.0)) < 0.05
    blind = SensorRig(motion, sensors=sensors, hull=hull, believed=HullGeometry())
    blind.run(10.0)
    assert rms(errors(blind, 10.0)) > 1.0


def test_heading_offset_of_the_baseline() -> None:
    sensors = IDEAL.model_copy(update={"heading_mount_deg": 90.0})
    made = SensorRig(circle(20.0, 1.5), sensors=sensors, estimate=EstimatorConfig(heading_offset_deg=90.0))
    made.run(10.0)
    assert wrap_pi(made.state.psi_rad - made.truth.psi_rad) == pytest.approx(0.0, abs=math.radians(0.1))


@pytest.mark.parametrize("kind", ["HDG", "HDM"])
def test_magnetic_compass_with_the_variation_of_its_own_or_of_the_receiver(kind: str) -> None:
    sensors = IDEAL.model_copy(
        update={"heading_sentence": kind, "variation_deg": -12.5, "sentences": "ZDA, GGA, RMC, VTG"}
    )
    made = SensorRig(circle(20.0, 1.5), sensors=sensors)
    made.run(10.0)
    assert wrap_pi(made.state.psi_rad - made.truth.psi_rad) == pytest.approx(0.0, abs=math.radians(0.2))
    assert not made.state.heading_from_course


def magnetic(t_us: int, variation_rad: float | None = None) -> EulerAngles:
    source = Source("compass", "HCHDG", (1,))
    return EulerAngles(t_us, psi_magnetic_rad=1.0, variation_rad=variation_rad, source=source)


def test_magnetic_heading_without_any_variation_is_not_a_heading() -> None:
    estimator = Estimator(EstimatorConfig())
    estimator.update(magnetic(0))
    assert not estimator.predict(0).heading_valid
    configured = Estimator(EstimatorConfig(variation_deg=10.0))
    configured.update(magnetic(0))
    assert configured.predict(0).psi_rad == pytest.approx(1.0 + math.radians(10.0))


def test_a_true_heading_outranks_a_magnetic_one_until_it_is_lost() -> None:
    estimator = Estimator(EstimatorConfig())
    for step in range(20):
        estimator.update(EulerAngles(step * 100_000, psi_rad=0.2, source=Source("compass", "GPHDT")))
        estimator.update(magnetic(step * 100_000, 0.5))
    assert estimator.predict(1_900_000).psi_rad == pytest.approx(0.2, abs=1e-6)
    for step in range(20, 60):
        estimator.update(magnetic(step * 100_000, 0.5))
    # 1.5 rad is a jump from 0.2: after the silence it is a new start, not a refusal.
    assert estimator.predict(5_900_000).psi_rad == pytest.approx(1.5, abs=1e-6)


def test_turn_rate_without_rot_comes_from_the_heading() -> None:
    made = SensorRig(circle(10.0, 1.5), sensors=IDEAL.model_copy(update={"rate_hz": 0.0}))
    made.run(10.0)
    assert made.state.r_radps == pytest.approx(0.15, abs=0.002)


def test_drift_is_the_current_and_can_be_held() -> None:
    made = SensorRig(circle(20.0, 1.5, (0.3, -0.2)))
    made.run(60.0)
    assert made.state.drift_n_mps == pytest.approx(0.3, abs=0.06)
    assert made.state.drift_e_mps == pytest.approx(-0.2, abs=0.06)
    estimator = made.estimator
    before = (made.state.drift_n_mps, made.state.drift_e_mps)
    estimator.note_water_speed(None)
    state = estimator.predict(made.now_us + 50_000)
    assert (state.drift_n_mps, state.drift_e_mps) == before


def test_body_velocity_and_course() -> None:
    made = SensorRig(straight(1.0, 0.0), sensors=IDEAL)
    made.estimator.update(AngularVelocity(0, 0.0))
    made.run(5.0)
    state = made.state
    assert (state.u_mps, state.v_mps) == (pytest.approx(1.0, abs=0.01), pytest.approx(0.0, abs=0.01))
    assert state.sog_mps == pytest.approx(1.0, abs=0.01)
    assert state.cog_rad == pytest.approx(0.0, abs=0.01)


def test_course_is_unknown_at_rest() -> None:
    made = SensorRig(straight(0.0, 1.0), sensors=IDEAL)
    made.run(5.0)
    assert made.state.cog_rad is None
    assert made.state.sog_mps == pytest.approx(0.0, abs=1e-3)


def test_g10_roll_and_pitch_are_unknown_unless_measured_and_age() -> None:
    estimator = Estimator(EstimatorConfig())
    estimator.update(EulerAngles(0, psi_rad=0.1))
    assert estimator.predict(0).phi_rad is None
    estimator.update(EulerAngles(100_000, phi_rad=0.05, theta_rad=-0.02))
    state = estimator.predict(200_000)
    assert (state.phi_rad, state.theta_rad) == (pytest.approx(0.05), pytest.approx(-0.02))
    assert estimator.predict(1_300_000).phi_rad is None
    attitude = estimator.latest_attitude
    assert (attitude.psi_rad, attitude.phi_rad) == (0.1, pytest.approx(0.05))


def test_ages_are_those_of_the_measurements() -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.run(10.0)
    assert 0.1 <= made.state.position_age_s <= 0.4
    assert 0.0 <= made.state.heading_age_s <= 0.15
    assert made.state.depth_age_s <= 0.15
    made.estimator.update(Distance(made.now_us + 500_000, 4.0, source=made.estimator.latest_distance.source))
    assert made.estimator.predict(made.now_us + 600_000).depth_age_s == pytest.approx(0.1)


def test_utc_runs_on_between_fixes() -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.run(10.0)
    made.suite.faults.gnss_silent = True
    made.run(10.0)
    assert made.estimator.utc_us(made.now_us) == pytest.approx(1_767_268_800_000_000 + made.now_us, abs=15_000)


def test_the_origin_never_moves() -> None:
    made = SensorRig(straight(5.0, 0.7))
    made.run(2.0)
    origin = made.estimator.origin
    made.run(30.0)
    assert made.estimator.origin is origin
    assert (made.state.origin_lat_rad, made.state.origin_lon_rad) == (origin.lat_rad, origin.lon_rad)
    assert math.hypot(made.state.x_m, made.state.y_m) == pytest.approx(160.0, abs=2.0)


def test_arrival_jitter_is_taken_out_by_utc() -> None:
    """Fixes that arrive up to 80 ms late at 3 m/s: without their UTC that is 0.24 m along the track."""
    worst = {}
    for align in (True, False):
        estimator = Estimator(EstimatorConfig(align_clock=align))
        found = []
        for step in range(200):
            t_us = step * 200_000
            jitter_us = (step * 37_000) % 80_000
            north_rad = 3.0 * t_us * 1e-6 / 6.357e6
            fix = GpsFix(
                t_us + jitter_us, FixType.RTK_FIXED, north_rad, 0.0, utc_us=t_us + 10**15, sog_mps=3.0, cog_rad=0.0
            )
            estimator.update(fix)
            state = estimator.predict(t_us + 100_000)
            if step > 100:
                found.append(abs(state.lat_rad - 3.0 * (t_us + 100_000) * 1e-6 / 6.357e6) * 6.357e6)
        worst[align] = max(found)
    assert worst[True] < 0.02
    assert worst[False] > 0.05


def test_live_change_of_settings_keeps_the_state() -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.run(5.0)
    made.estimator.configure(EstimatorConfig(position_timeout_s=2.0))
    assert made.estimator.predict(made.now_us + 1_500_000).position_valid


def smoothing(made: SensorRig, tau_s: float) -> SensorRig:
    """Let the receiver smooth the speed that it tells, as marine ones do."""
    step, shown = made.suite.step, [0.0, 0.0]

    def smoothed(now_us: int, truth: Truth) -> list[bytes]:
        share = 0.01 / tau_s
        for axis, mps in enumerate((truth.vn_mps, truth.ve_mps)):
            shown[axis] += share * (mps - shown[axis])
        return step(now_us, replace(truth, vn_mps=shown[0], ve_mps=shown[1]))

    made.suite.step = smoothed  # type: ignore[method-assign]
    return made


LAGS = "Receiver's speed lags by"


@pytest.mark.parametrize(
    ("grade", "fix_hz", "tau_s", "limit_m"),
    [("rtk", 5.0, 2.0, 0.15), ("rtk", 5.0, 8.0, 0.15), ("rtk", 1.0, 2.0, 0.4), ("standalone", 5.0, 5.0, 6.0)],
)
def test_a_speed_that_the_receiver_smooths_is_told_and_leads_nowhere(
    grade: str, fix_hz: float, tau_s: float, limit_m: float
) -> None:
    """The estimate was 0.9 to 2.8 m beside places that were right to 3 cm, and the boat as far beside her track."""
    made = smoothing(SensorRig(circle(10.0, 1.2), sensors=SimulatedSensors(grade=grade, fix_hz=fix_hz)), tau_s)
    made.run(100.0)
    (said,) = [text for _, _, text in made.texts if LAGS in text]
    assert float(said.removeprefix(LAGS).split()[0]) == pytest.approx(tau_s, abs=1.0 + 0.1 * tau_s)
    assert max(errors(made, 60.0)) < limit_m


def test_a_receiver_that_smooths_its_speed_is_not_stuck_where_the_boat_stops() -> None:
    """Of a sound receiver it was said that it stays about one position, and 5 s later it was no position any more."""

    def there_and_rest(t_s: float) -> Pose:
        moved_s = min(t_s, 40.0)
        mps = 1.0 if t_s < 40.0 else 0.0
        return Pose(moved_s, 0.0, 0.0, mps, 0.0, u_mps=1.0)

    made = smoothing(SensorRig(there_and_rest), 10.0)
    made.run(80.0)
    assert not any("stays about" in text for _, _, text in made.texts)
    assert made.state.position_valid


@pytest.mark.parametrize("fix_hz", [1.0, 10.0])
@pytest.mark.parametrize("grade", ["rtk", "standalone"])
def test_a_receiver_that_does_not_smooth_does_not_lag(grade: str, fix_hz: float) -> None:
    made = SensorRig(circle(5.0, 1.0), sensors=SimulatedSensors(grade=grade, fix_hz=fix_hz), seed=2)
    made.run(120.0)
    assert not any(LAGS in text for _, _, text in made.texts)
