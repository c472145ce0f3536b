"""What the estimator believes when sensors lie, jump, freeze or fall silent (fault matrix rows 21-24, 26, 30-33)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from companion.core.estimate.estimator import EstimatorConfig
from mavlink_bridge.language.messages import EstimatedState, FixType, GpsFix, Severity
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors.config import SensorClass
from sitl.sensors.talkers import SimulatedSensors
from tools.benches.cells.sensor_rig import Motion, Pose, SensorRig, circle, straight


def rig(**options: object) -> SensorRig:
    made = SensorRig(circle(20.0, 1.5), **options)
    made.run(10.0)
    assert made.state.position_valid
    assert made.state.heading_valid
    made.texts.clear()
    return made


def first_time(made: SensorRig, seconds: float, condition: Callable[[SensorRig], bool]) -> float | None:
    """Seconds from now until the condition holds at a tick for the first time."""
    start_us = made.now_us
    found: list[float] = []

    def look(here: SensorRig) -> None:
        if not found and condition(here):
            found.append((here.now_us - start_us) * 1e-6)

    made.run(seconds, look)
    return found[0] if found else None


def heading_error_deg(made: SensorRig) -> float:
    assert made.state.psi_rad is not None
    return abs(math.degrees(wrap_pi(made.state.psi_rad - made.truth.psi_rad)))


def test_row_21_silent_gnss_makes_the_position_invalid_after_one_second() -> None:
    made = rig()
    made.suite.faults.gnss_silent = True
    lost_s = first_time(made, 5.0, lambda here: not here.state.position_valid)
    # The last epoch may be up to 0.2 s and its latency older than the fault.
    assert lost_s is not None
    assert 0.65 <= lost_s <= 1.05
    assert made.state.heading_valid
    assert (made.state.lat_rad, made.state.vx_mps, made.state.sog_mps) == (None, None, None)
    made.suite.faults.gnss_silent = False
    assert first_time(made, 2.0, lambda here: here.state.position_valid) <= 0.45


def test_row_21_a_1_hz_receiver_gets_three_seconds() -> None:
    made = rig(sensors=SimulatedSensors(fix_hz=1.0))
    valid = []
    made.run(20.0, lambda here: valid.append(here.state.position_valid))
    assert all(valid)
    made.suite.faults.gnss_silent = True
    assert 1.8 <= first_time(made, 6.0, lambda here: not here.state.position_valid) <= 3.3


def to_and_fro(most_mps: float, period_s: float) -> Motion:
    """Full astern and full ahead in turn, along a parallel."""

    def pose(t_s: float) -> Pose:
        w = 2.0 * math.pi / period_s
        east_m, ve_mps = most_mps / w * (1.0 - math.cos(w * t_s)), most_mps * math.sin(w * t_s)
        return Pose(0.0, east_m, 0.5 * math.pi, 0.0, ve_mps, u_mps=ve_mps)

    return pose


@pytest.mark.parametrize("phase_s", [0.0, 0.2, 0.4, 0.6, 0.8])
def test_a_crash_stop_is_no_outlier_of_a_1_hz_receiver(phase_s: float) -> None:
    """2 m/s to 2 m/s astern in 4 s: an RTK fix that comes once a second, and 0.12 s late, lies 1 m from where the last speed led."""
    motion = to_and_fro(2.0, 8.0)
    made = SensorRig(lambda t_s: motion(t_s + phase_s), sensors=SimulatedSensors(fix_hz=1.0))
    made.run(5.0)
    errors: list[float | None] = []
    made.run(40.0, lambda here: errors.append(here.error_m()))
    assert None not in errors
    # 1.2 s at 1.6 m/s2, and what the filter keeps of the speed before
    assert max(errors) < 1.5


@pytest.mark.parametrize("fault", ["no_fix", "dead_reckoning"])
def test_row_22_a_lost_fix_is_believed_at_once(fault: str) -> None:
    made = rig()
    setattr(made.suite.faults, fault, True)
    assert first_time(made, 2.0, lambda here: not here.state.position_valid) <= 0.45
    assert made.state.fix_type in (FixType.NONE, FixType.FIX_2D)


def test_row_23_a_position_jump_is_never_followed() -> None:
    made = rig()
    made.suite.faults.jump_east_m = 1000.0
    errors: list[float | None] = []
    made.run(9.0, lambda here: errors.append(here.error_m()))
    held = [error for error in errors if error is not None]
    assert max(held) < 1.0
    assert 1.6 <= 0.05 * len(held) <= 2.05  # two seconds from the last good fix, which is up to 0.35 s old
    assert errors[-1] is None
    assert [text for _, severity, text in made.texts if "jumped" in text and severity == Severity.WARNING]
    made.suite.faults.jump_east_m = 0.0
    made.run(1.0)
    assert made.error_m() < 0.2


def test_row_23_a_jump_that_stays_is_accepted_after_ten_seconds_with_a_text() -> None:
    made = rig()
    made.suite.faults.jump_east_m = 300.0
    back_s = first_time(made, 20.0, lambda here: not here.state.position_valid)
    assert back_s <= 2.5
    made.run(1.0)
    assert made.error_m() == pytest.approx(300.0, abs=0.5)
    assert any("accepted" in text for _, _, text in made.texts)


def test_row_23_a_single_outlier_does_not_move_the_estimate() -> None:
    made = rig()
    made.suite.faults.jump_north_m = 8.0
    made.run(0.2)
    made.suite.faults.jump_north_m = 0.0
    errors: list[float] = []
    made.run(2.0, lambda here: errors.append(here.error_m()))
    assert max(errors) < 0.3


@pytest.mark.parametrize(("grade", "step_m"), [("standalone", 4.0), ("sbas", 2.0), ("rtk", 0.5)])
@pytest.mark.parametrize("fix_hz", [1.0, 2.0, 3.0, 4.0, 5.0])
def test_a_step_of_a_sound_receiver_is_followed_and_no_loss(grade: SensorClass, step_m: float, fix_hz: float) -> None:
    """Another satellite, or float to fixed: up to four fixes a second, the position was lost before the fourth one was believed."""
    made = SensorRig(straight(1.0, 0.4), sensors=SimulatedSensors(fix_hz=fix_hz, grade=grade))
    made.run(20.0)
    made.suite.faults.jump_east_m = step_m
    valid: list[bool] = []
    made.run(4.5, lambda here: valid.append(here.state.position_valid))
    assert all(valid)
    # the estimate went where the receiver says; its own noise is a metre or two
    assert made.error_m() > 0.5 * step_m


def is_frozen(made: SensorRig) -> bool:
    return made.estimator.flags(made.state).position_frozen


def test_row_24_a_frozen_receiver_is_warned_of_and_then_no_position() -> None:
    made = SensorRig(straight(1.5, 0.4))
    made.run(10.0)
    made.suite.faults.frozen = True
    assert 5.0 <= first_time(made, 7.0, is_frozen) <= 5.6
    assert 10.0 <= 7.0 + first_time(made, 7.0, lambda here: not here.state.position_valid) <= 10.6
    made.suite.faults.frozen = False
    made.run(1.0)
    assert not is_frozen(made)
    assert made.state.position_valid


@pytest.mark.parametrize("speed_mps", [0.5, 1.5, 3.0])
@pytest.mark.parametrize("grade", ["rtk", "standalone"])
def test_row_24_a_position_that_stays_about_one_place_while_its_speed_leads_away_is_none(
    grade: SensorClass, speed_mps: float
) -> None:
    """Its last digits change and its speed is true: a boat sailed 200 m past her point, and 50 m out of her fence."""
    sailed = straight(speed_mps, 0.4)
    stays = False

    def seen(t_s: float) -> Pose:
        here, there = sailed(t_s), sailed(10.0)
        return replace(here, north_m=there.north_m, east_m=there.east_m) if stays else here

    made = SensorRig(seen, sensors=SimulatedSensors(grade=grade))
    made.run(10.0)
    stays = True
    lost_s = first_time(made, 40.0, lambda here: not here.state.position_valid)
    assert lost_s is not None
    # so far the speed must lead from a place that varies by so much, and ten seconds more
    assert lost_s <= 11.5 + (5.5 if grade == "rtk" else 11.0) / speed_mps
    assert any("stays about one position" in text for _, _, text in made.texts)
    stays = False
    made.run(15.0)
    assert made.state.position_valid


@pytest.mark.parametrize("speed_mps", [0.2, 0.5, 1.5, 3.0])
@pytest.mark.parametrize("grade", ["rtk", "sbas", "standalone"])
@pytest.mark.parametrize("fix_hz", [1.0, 5.0])
def test_row_24_a_sound_position_does_not_stay(grade: SensorClass, speed_mps: float, fix_hz: float) -> None:
    made = SensorRig(circle(15.0, speed_mps), sensors=SimulatedSensors(grade=grade, fix_hz=fix_hz))
    made.run(120.0)
    assert not [text for _, _, text in made.texts if "one position" in text]


@pytest.mark.parametrize(("grade", "fix_hz"), [("rtk", 5.0), ("standalone", 1.0)])
def test_a_place_that_creeps_away_from_its_own_speed_is_told_of(grade: SensorClass, fix_hz: float) -> None:
    """A boat was led 60 m off by 0.3 m/s, "plan complete" was told, and no other word."""
    sailed = circle(20.0, 1.0)
    creeps_s = [math.inf, math.inf]

    def seen(t_s: float) -> Pose:
        here = sailed(t_s)
        since_s = min(max(t_s - creeps_s[0], 0.0), creeps_s[1])
        return replace(here, east_m=here.east_m + 0.3 * since_s)

    made = SensorRig(seen, sensors=SimulatedSensors(grade=grade, fix_hz=fix_hz))
    made.run(20.0)
    creeps_s[0] = 20.0
    told_s = first_time(made, 100.0, lambda here: any("disagree" in text for _, _, text in here.texts))
    assert told_s is not None
    assert told_s < 80.0
    creeps_s[1] = 100.0
    made.run(120.0)
    told = [text for _, _, text in made.texts if "place and speed" in text]
    assert len(told) == 2, told
    assert "agree again" in told[1]


@pytest.mark.parametrize(("grade", "fix_hz"), [("rtk", 5.0), ("standalone", 1.0)])
@pytest.mark.parametrize("speed_mps", [0.0, 1.5])
def test_a_sound_place_goes_where_its_speed_leads(grade: SensorClass, fix_hz: float, speed_mps: float) -> None:
    made = SensorRig(circle(20.0, speed_mps), sensors=SimulatedSensors(grade=grade, fix_hz=fix_hz))
    made.run(300.0)
    assert not [text for _, _, text in made.texts if "place and speed" in text]


def test_row_24_a_boat_on_her_ropes_whose_thrusters_are_tried_has_a_sound_receiver() -> None:
    """Its place is pinned at rest (static hold): told of, it was none for good, and Auto was refused."""
    made = SensorRig(lambda t_s: Pose(0.0, 0.0, 0.4, 0.0, 0.0, u_mps=1.0 if 10.0 < t_s < 25.0 else 0.0))
    made.suite.faults.frozen = True
    made.run(24.0)
    assert is_frozen(made)
    made.run(10.0)
    assert not is_frozen(made)
    assert made.state.position_valid
    assert not any("moves" in text for _, _, text in made.texts), "it has not"


def test_row_24_a_receiver_that_was_told_of_is_not_sound_because_the_boat_has_stopped() -> None:
    made = SensorRig(lambda t_s: straight(1.5 if t_s < 22.0 else 0.0, 0.4)(min(t_s, 22.0)))
    made.run(10.0)
    made.suite.faults.frozen = True
    made.run(30.0)
    assert is_frozen(made)
    assert not made.state.position_valid


def test_row_24_a_receiver_that_was_frozen_under_way_is_believed_again_at_rest() -> None:
    """Frozen for 60 s, it was none for three minutes after that: its speed had led so far that no boat at rest could catch up."""
    sailed = straight(1.8, 0.4)
    made = SensorRig(
        lambda t_s: replace(sailed(20.0), vn_mps=0.0, ve_mps=0.0, u_mps=0.0) if t_s > 20.0 else sailed(t_s)
    )
    made.run(12.0)
    made.suite.faults.frozen = True
    made.run(60.0)
    assert not made.state.position_valid
    made.suite.faults.frozen = False
    made.run(3.0)
    assert not is_frozen(made)
    assert made.error_m() < 0.2


def test_row_24_a_receiver_that_never_pins_its_place_is_frozen_while_it_repeats_one() -> None:
    """Frozen on station it tells no speed: the boat had hardly stopped for it when it "moved again", and Auto was sailed blind."""
    made = SensorRig(lambda t_s: Pose(0.0, 0.0, 0.4, 0.0, 0.0, u_mps=1.0 if 35.0 < t_s < 47.0 else 0.0))
    made.run(34.0)
    made.suite.faults.frozen = True
    made.run(26.0)
    assert is_frozen(made)
    assert not made.state.position_valid
    made.suite.faults.frozen = False
    made.run(1.0)
    assert not is_frozen(made)


def test_row_24_a_receiver_stuck_in_time_is_frozen_too_even_at_rest() -> None:
    made = SensorRig(straight(0.0, 0.4))
    made.run(10.0)
    made.suite.faults.stuck = True
    assert first_time(made, 12.0, lambda here: not here.state.position_valid) <= 10.6


def test_row_24_rest_is_not_frozen() -> None:
    made = SensorRig(straight(0.0, 0.4), sensors=SimulatedSensors(grade="ideal"))
    made.run(30.0)
    assert made.state.position_valid
    assert not is_frozen(made)


def test_row_25_damaged_sentences_leave_no_trace_in_the_state() -> None:
    clean, damaged = rig(), rig()
    damaged.suite.faults.flip_share = 0.3
    damaged.suite.faults.cut_share = 0.1
    errors: list[float] = []
    damaged.run(30.0, lambda here: errors.append(here.error_m()))
    assert None not in errors
    assert max(errors) < 0.6
    clean.run(30.0)
    assert damaged.reader.counters["bad_checksum"] > 100
    assert any("damaged" in text for _, _, text in damaged.texts)


def test_row_26_a_tenfold_flood_changes_nothing() -> None:
    made = rig()
    made.suite.faults.flood = 10
    errors: list[float] = []
    headings: list[float] = []
    made.run(10.0, lambda here: (errors.append(here.error_m()), headings.append(heading_error_deg(here))))
    assert None not in errors
    assert max(errors) < 0.3
    assert max(headings) < 3.0


def test_row_27_no_line_ends_changes_nothing() -> None:
    made = rig()
    made.suite.faults.no_line_end = True
    made.run(5.0)
    assert made.error_m() < 0.2


def test_row_30_lost_heading_falls_back_to_the_course_above_1_mps() -> None:
    made = rig()
    made.suite.faults.heading_silent = True
    fell_s = first_time(made, 3.0, lambda here: here.state.heading_from_course)
    assert fell_s <= 0.65
    assert made.state.heading_valid
    assert heading_error_deg(made) < 8.0
    made.suite.faults.heading_silent = False
    made.run(0.3)
    assert not made.state.heading_from_course
    assert heading_error_deg(made) < 3.0


def test_row_30_lost_heading_at_low_speed_is_no_heading() -> None:
    made = SensorRig(straight(0.5, 0.4))
    made.run(10.0)
    made.suite.faults.heading_silent = True
    lost_s = first_time(made, 3.0, lambda here: not here.state.heading_valid)
    assert lost_s <= 0.65
    assert made.state.position_valid
    assert (made.state.u_mps, made.state.r_radps) == (None, None)


def test_row_30_a_compass_of_1_hz_is_slow_not_lost() -> None:
    """The seed's own order at 1 Hz: one HDT per epoch, no ROT."""
    made = SensorRig(circle(20.0, 1.5), sensors=SimulatedSensors(fix_hz=1.0, heading_hz=0.0, rate_hz=0.0))
    made.run(15.0)
    seen: list[bool] = []
    errors: list[float] = []
    made.run(30.0, lambda here: (seen.append(here.state.heading_valid), errors.append(heading_error_deg(here))))
    assert all(seen)
    assert not made.state.heading_from_course
    assert max(errors) < 4.0
    made.suite.faults.heading_silent = True
    assert first_time(made, 4.0, lambda here: here.state.heading_from_course) <= 2.3


@pytest.mark.parametrize("bias_deg", [180.0, -90.0, 60.0])
def test_row_31_a_heading_jump_is_held_one_second_then_invalid(bias_deg: float) -> None:
    made = SensorRig(straight(0.5, 0.4))
    made.run(10.0)
    made.suite.faults.heading_bias_deg = bias_deg
    errors: list[float] = []
    valid: list[bool] = []

    def look(here: SensorRig) -> None:
        valid.append(here.state.heading_valid)
        if here.state.heading_valid:
            errors.append(heading_error_deg(here))

    made.run(6.0, look)
    assert max(errors) < 4.0
    assert 0.85 <= 0.05 * sum(valid) <= 1.15
    made.suite.faults.heading_bias_deg = 0.0
    made.run(0.3)
    assert heading_error_deg(made) < 3.0


def test_row_31_a_flip_is_not_accepted_later_while_the_course_contradicts_it() -> None:
    made = SensorRig(straight(1.5, 0.4))
    made.run(10.0)
    made.suite.faults.heading_bias_deg = 180.0
    errors: list[float] = []
    made.run(30.0, lambda here: errors.append(heading_error_deg(here)))
    assert max(errors) < 10.0
    assert made.state.heading_from_course


def test_row_31_a_new_heading_that_stays_and_agrees_with_the_course_is_accepted() -> None:
    made = SensorRig(straight(1.5, 0.4))
    made.run(10.0)
    made.suite.faults.heading_bias_deg = 45.0
    made.run(14.0)
    assert not made.state.heading_from_course
    assert heading_error_deg(made) == pytest.approx(45.0, abs=3.0)
    assert any("accepted" in text for _, _, text in made.texts)


def second_receiver(made: SensorRig, east_m: float) -> None:
    """Let a second receiver see the last fix of the first one, shifted."""
    fix = made.estimator.latest_fix
    assert fix is not None
    lon_rad = fix.lon_rad + east_m / (6.378e6 * math.cos(fix.lat_rad))
    made.estimator.update(GpsFix(t_us=fix.t_us, fix_type=fix.fix_type, lat_rad=fix.lat_rad, lon_rad=lon_rad), source=1)


def carried_then_still(north_mps: float, until_s: float) -> Motion:
    """On a trailer or in tow, thrusters in neutral, then at rest."""

    def pose(t_s: float) -> Pose:
        vn_mps = north_mps if t_s < until_s else 0.0
        return Pose(north_mps * min(t_s, until_s), 0.0, 0.0, vn_mps, 0.0)

    return pose


@pytest.mark.parametrize(("north_mps", "bias_deg"), [(12.0, 180.0), (12.0, 90.0), (2.0, 180.0)])
@pytest.mark.parametrize("fix_hz", [1.0, 5.0])
def test_row_31_a_compass_that_comes_right_at_rest_is_not_refused_for_a_drift_of_the_road(
    north_mps: float, bias_deg: float, fix_hz: float
) -> None:
    """Carried at 12 m/s, that is no drift of the water once she lies still: it made way for ever, which contradicted each compass."""
    made = SensorRig(carried_then_still(north_mps, 60.0), sensors=SimulatedSensors(fix_hz=fix_hz))
    made.suite.faults.heading_bias_deg = bias_deg
    made.run(60.0)
    made.suite.faults.heading_bias_deg = 0.0
    made.run(80.0)
    assert made.state.psi_rad is not None
    assert not made.state.heading_from_course
    assert heading_error_deg(made) < 3.0
    assert math.hypot(made.state.drift_n_mps or 0.0, made.state.drift_e_mps or 0.0) < 0.2


@pytest.mark.parametrize(("fault", "value"), [("heading_bias_deg", 60.0), ("jump_east_m", 90.0)])
def test_what_comes_and_goes_five_times_a_second_is_told_six_times_a_minute(fault: str, value: float) -> None:
    """Two devices that differ told 222 texts in 22 s, and hid the alarm."""
    made = rig()
    for number in range(110):
        made.suite.faults.set(fault, value * (number % 2))
        made.run(0.2)
    texts = [each[-1] for each in made.texts]
    assert any("jumped" in text for text in texts)
    assert len(texts) <= 8, texts


def test_row_32_two_receivers_that_disagree_are_reported_after_five_seconds_and_the_first_is_used() -> None:
    made = rig()
    states: list[bool] = []

    def look(here: SensorRig) -> None:
        second_receiver(here, 10.0)
        states.append(here.estimator.sources_disagree)

    made.run(8.0, look)
    assert 4.5 <= 0.05 * states.count(False) <= 5.5
    assert made.error_m() < 0.2
    assert any("disagree" in text for _, _, text in made.texts)
    made.run(1.0, lambda here: second_receiver(here, 0.05))
    assert not made.estimator.sources_disagree


def test_row_32_the_second_receiver_takes_over_when_the_first_is_silent() -> None:
    made = rig()
    last = made.estimator.latest_fix
    made.suite.faults.gnss_silent = True
    made.run(2.5)
    assert not made.state.position_valid
    fix = GpsFix(made.now_us, last.fix_type, last.lat_rad, last.lon_rad)
    made.estimator.update(fix, source=1)
    assert made.estimator.predict(made.now_us).position_valid


def test_row_33_a_wrong_date_stops_the_clock_not_the_position() -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.suite.faults.weeks_off = 1024
    made.run(5.0)
    assert made.estimator.utc_us(made.now_us) is None
    assert made.error_m() < 0.3


def test_row_58_a_1_km_jump_in_one_fix_is_ignored() -> None:
    made = rig()
    made.suite.faults.jump_north_m = 1000.0
    made.run(0.2)
    made.suite.faults.jump_north_m = 0.0
    errors: list[float | None] = []
    made.run(2.0, lambda here: errors.append(here.error_m()))
    assert None not in errors
    assert max(errors) < 0.3


def test_the_kind_of_fix_is_told_when_it_has_changed_for_two_seconds() -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.run(5.0)
    made.suite.faults.no_fix = True
    made.run(1.0)
    made.suite.faults.no_fix = False
    made.run(3.0)
    made.suite.faults.no_fix = True
    made.run(4.0)
    made.suite.faults.no_fix = False
    made.run(4.0)
    told = [(severity, text) for _, severity, text in made.texts if text.startswith("GNSS")]
    assert told == [
        (Severity.INFO, "GNSS: RTK fixed, 18 satellites"),
        (Severity.WARNING, "GNSS: no fix, 0 satellites"),
        (Severity.INFO, "GNSS: RTK fixed, 18 satellites"),
    ]


def test_simulated_fixes_are_refused_unless_allowed() -> None:
    fix = GpsFix(0, FixType.FIX_3D, 0.7, -0.15, simulated=True)
    for allowed in (False, True):
        made = SensorRig(circle(20.0, 1.5), estimate=EstimatorConfig(accept_simulated=allowed))
        made.estimator.update(fix)
        assert made.estimator.predict(100_000).position_valid == allowed


def test_before_anything_is_measured_everything_is_unknown() -> None:
    made = SensorRig(circle(20.0, 1.5))
    state = made.estimator.predict(1_000_000, 4.2)
    assert state == EstimatedState(1_000_000, alt_m=4.2)
    assert made.estimator.utc_us(0) is None
    assert made.estimator.origin is None
