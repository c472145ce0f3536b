"""The simulated sensors: the sentences, their rates and errors, and each fault as a receiver would show it."""

from __future__ import annotations

import itertools
import math
import random
import statistics
from collections import Counter
from dataclasses import replace

import pytest

from companion.core.hull.geometry import HullGeometry
from companion.core.nmea.line import LineReader
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, FixType, GpsFix
from mavlink_bridge.language.units import wrap_pi
from sitl.plant.truth import SIM_UTC_START_US
from sitl.sensors.talkers import SensorFaults, SensorSuite, SimulatedSensors
from tools.benches.cells.sensor_rig import SensorRig, circle, straight, truth_at

REST = straight(0.0, 0.5)


def lines(
    seconds: float, config: SimulatedSensors | None = None, seed: int = 1, step_us: int = 10_000, **faults: object
) -> list[bytes]:
    suite = SensorSuite(config or SimulatedSensors(), random.Random(seed), HullGeometry(transducer_m=0.2))
    for name, value in faults.items():
        suite.faults.set(name, value)
    sent: list[bytes] = []
    for now_us in range(step_us, round(seconds * 1e6) + 1, step_us):
        sent += suite.step(now_us, truth_at(REST, now_us))
    return sent


def measurements(sent: list[bytes]) -> list[object]:
    reader = NmeaReader(NmeaConfig())
    return [item for line in sent for item in reader.receive(line, 0)]


def kinds(sent: list[bytes]) -> Counter[str]:
    return Counter(line[1:6].decode() for line in sent)


def test_the_default_is_the_seeds_epoch_at_5_hz_heading_rate_and_depth_at_10() -> None:
    sent = lines(10.0)
    counted = kinds(sent)
    assert counted["GPHDT"] == pytest.approx(150, abs=1)
    assert counted["GPROT"] == counted["SDDPT"] == 101  # one at the very start
    assert all(counted[name] == pytest.approx(50, abs=1) for name in ("GPZDA", "GPGGA", "GPRMC", "GPVTG"))
    names = [line[1:6] for line in sent]
    first = names.index(b"GPZDA")
    assert names[first : first + 5] == [b"GPZDA", b"GPGGA", b"GPRMC", b"GPVTG", b"GPHDT"]
    assert all(line.endswith(b"\r\n") for line in sent)


def test_every_sentence_passes_a_strict_reader() -> None:
    sent = lines(
        5.0, SimulatedSensors(attitude_sentence="PASHR", variation_deg=-3.2, sentences="ZDA,GGA,RMC,VTG,GST,HDT")
    )
    assert len(LineReader().receive(b"".join(sent))) == len(sent)
    reader = NmeaReader(NmeaConfig())
    reader.receive(b"".join(sent), 0)
    counters = reader.counters
    assert counters["malformed"] == counters["unknown"] == counters["noise_bytes"] == 0


def test_equal_seeds_give_equal_bytes_and_others_do_not() -> None:
    assert lines(5.0, seed=4) == lines(5.0, seed=4)
    assert lines(5.0, seed=4) != lines(5.0, seed=5)


def test_simulated_utc_starts_at_its_fixed_date() -> None:
    fixes = [item for item in measurements(lines(1.0)) if isinstance(item, GpsFix)]
    assert SIM_UTC_START_US <= fixes[0].utc_us < SIM_UTC_START_US + 200_000


@pytest.mark.parametrize("step_us", [1_000, 10_000, 20_000, 50_000])
def test_positions_leave_exactly_their_latency_after_they_were_true(step_us: int) -> None:
    suite = SensorSuite(SimulatedSensors(grade="ideal"), random.Random(1))
    ages = []
    for now_us in range(step_us, 3_000_001, step_us):
        for line in suite.step(now_us, truth_at(REST, now_us)):
            if line[3:6] == b"GGA":
                seconds = float(line.split(b",")[1][4:])
                ages.append(round(now_us - seconds * 1e6))
    assert len(ages) >= 14
    # A step that does not divide the latency delays the sentence to its next multiple.
    assert set(ages) == {120_000 if step_us != 20_000 else 130_000}


@pytest.mark.parametrize(
    ("grade", "white_m", "heading_deg", "fix_type"),
    [
        ("rtk", 0.03, 0.5, FixType.RTK_FIXED),
        ("sbas", 0.15, 0.7, FixType.DGPS),
        ("standalone", 0.4, 1.0, FixType.FIX_3D),
        ("ideal", 0.0, 0.0, FixType.RTK_FIXED),
    ],
)
def test_white_noise_of_each_class(grade: str, white_m: float, heading_deg: float, fix_type: FixType) -> None:
    found = measurements(lines(100.0, SimulatedSensors(grade=grade)))
    fixes = [item for item in found if isinstance(item, GpsFix)]
    assert {fix.fix_type for fix in fixes} == {fix_type}
    norths = [fix.lat_rad * 6.37e6 for fix in fixes]
    # Differences of neighbours see the white part alone.
    assert spread(norths) == pytest.approx(white_m, rel=0.15, abs=1e-3)
    headings = [math.degrees(item.psi_rad) for item in found if isinstance(item, EulerAngles)]
    assert spread(headings) == pytest.approx(heading_deg, rel=0.15, abs=1e-3)
    rates = [item.r_radps for item in found if isinstance(item, AngularVelocity)]
    assert statistics.pstdev(rates) == pytest.approx(0.0 if grade == "ideal" else 0.003, rel=0.15, abs=1e-5)


def spread(values: list[float]) -> float:
    return statistics.pstdev(b - a for a, b in itertools.pairwise(values)) / math.sqrt(2.0)


def test_the_slow_wander_has_the_stated_size_and_speed() -> None:
    """Over many seeds: a Gauss-Markov process of 1.5 m that forgets in 200 s."""
    starts, laters = [], []
    for seed in range(150):
        suite = SensorSuite(
            SimulatedSensors(grade="standalone", sentences="GGA", heading_hz=0, rate_hz=0, depth_hz=0),
            random.Random(seed),
        )
        norths = []
        for now_us in (120_000, 80_120_000):
            for line in (
                *suite.step(now_us - 120_000, truth_at(REST, now_us)),
                *suite.step(now_us, truth_at(REST, now_us)),
            ):
                minutes = float(line.split(b",")[2][2:])
                norths.append((minutes - 11.100738) * 1852.0)
        starts.append(norths[0])
        laters.append(norths[-1])
    assert statistics.pstdev(starts) == pytest.approx(math.hypot(1.5, 0.4), rel=0.2)
    assert statistics.pstdev(laters) == pytest.approx(math.hypot(1.5, 0.4), rel=0.2)
    assert statistics.correlation(starts, laters) == pytest.approx(
        math.exp(-80 / 200) * 1.5**2 / (1.5**2 + 0.4**2), abs=0.2
    )


def test_the_sounder_measures_from_the_transducer_with_drop_outs_and_false_echoes() -> None:
    found = [item for item in measurements(lines(400.0)) if isinstance(item, Distance)]
    values = [item.value_m for item in found if item.value_m is not None]
    assert statistics.median(values) == pytest.approx(7.8, abs=0.01)
    assert 1.0 - len(values) / len(found) == pytest.approx(0.02, abs=0.01)
    far = [value for value in values if abs(value - 7.8) > 0.5]
    assert len(far) / len(values) == pytest.approx(0.01, abs=0.006)
    near = [value for value in values if abs(value - 7.8) <= 0.5]
    assert statistics.pstdev(near) == pytest.approx(0.05, rel=0.15)


def test_the_sounder_reports_no_bottom_beyond_its_range_and_in_its_blanking() -> None:
    suite = SensorSuite(SimulatedSensors(grade="ideal"), random.Random(1), HullGeometry(transducer_m=0.2))
    cases = ((150.0, None), (0.4, None), (None, None), (5.0, 4.8))
    for second, (depth_m, expected) in enumerate(cases, start=1):
        (line,) = [
            line for line in suite.step(second * 1_000_000, truth_at(REST, 0, depth_m=depth_m)) if line[3:6] == b"DPT"
        ]
        (item,) = measurements([line])
        assert item.value_m == expected


def test_faults_by_name_and_their_refusal() -> None:
    faults = SensorFaults()
    faults.set("heading_bias_deg", 180)
    faults.set("no_fix", True)
    assert (faults.heading_bias_deg, faults.no_fix) == (180.0, True)
    for name, value in (("nonsense", 1), ("no_fix", 1), ("flood", True), ("jump_north_m", "far")):
        with pytest.raises(ValueError, match="fault"):
            faults.set(name, value)


@pytest.mark.parametrize(("tilt_deg", "reads_m"), [(0.0, 7.8), (9.9, 7.8), (20.0, 7.8 / math.cos(math.radians(20.0)))])
def test_a_tilt_inside_the_cone_leaves_the_bottom_straight_below(tilt_deg: float, reads_m: float) -> None:
    suite = SensorSuite(SimulatedSensors(grade="ideal"), random.Random(1), HullGeometry(transducer_m=0.2))
    truth = replace(truth_at(REST, 0), roll_rad=math.radians(tilt_deg))
    (item,) = measurements([line for line in suite.step(1_000_000, truth) if line[3:6] == b"DPT"])
    assert item.value_m == pytest.approx(reads_m, abs=0.06)


def test_silent_gnss_and_heading_and_depth() -> None:
    assert set(kinds(lines(2.0, gnss_silent=True))) == {"GPHDT", "GPROT", "SDDPT"}
    assert "GPHDT" not in kinds(lines(2.0, heading_silent=True))
    assert "SDDPT" not in kinds(lines(2.0, depth_silent=True))
    assert "GPROT" not in kinds(lines(2.0, rate_silent=True))


def test_no_fix_blanks_the_position_and_says_so() -> None:
    fixes = [item for item in measurements(lines(2.0, no_fix=True)) if isinstance(item, GpsFix)]
    assert fixes
    assert all(fix.fix_type == FixType.NONE and not fix.has_position and fix.utc_us for fix in fixes)


def test_dead_reckoning_is_marked() -> None:
    fixes = [item for item in measurements(lines(2.0, dead_reckoning=True)) if isinstance(item, GpsFix)]
    assert fixes
    assert all(fix.dead_reckoning for fix in fixes)


def test_a_frozen_receiver_keeps_time_a_stuck_one_does_not() -> None:
    for name, times in (("frozen", 9), ("stuck", 1)):
        suite = SensorSuite(SimulatedSensors(), random.Random(1))
        for now_us in range(10_000, 1_000_001, 10_000):
            suite.step(now_us, truth_at(circle(20, 2), now_us))
        suite.faults.set(name, True)
        sent: list[bytes] = []
        for now_us in range(1_010_000, 3_000_001, 10_000):
            sent += suite.step(now_us, truth_at(circle(20, 2), now_us))
        fields = [line.split(b",") for line in sent if line[3:6] == b"GGA"][1:]
        assert len({field[2] for field in fields}) == 1
        assert len({field[1] for field in fields}) in (times, times + 1) if times > 1 else True
        assert (len({field[1] for field in fields}) > 1) == (times > 1)


def test_weeks_off_and_blank_time() -> None:
    fixes = [item for item in measurements(lines(2.0, weeks_off=1024)) if isinstance(item, GpsFix)]
    assert fixes
    assert all(fix.utc_us is None and fix.has_position for fix in fixes)
    assert b"$GPZDA,,,,,00,00*" in b"".join(lines(2.0, utc_blank=True))


def test_cut_flipped_lost_and_flooded_lines() -> None:
    whole = b"".join(lines(2.0))
    assert len(b"".join(lines(2.0, cut_share=0.5))) < 0.9 * len(whole)
    assert len(b"".join(lines(2.0, loss_share=0.5))) < 0.7 * len(whole)
    assert len(b"".join(lines(2.0, flood=10))) == 10 * len(whole)
    assert b"\n" not in b"".join(lines(2.0, no_line_end=True))
    good = LineReader().receive(b"".join(lines(5.0, flip_share=1.0)))
    # Only a flip in the line end or of the case of a checksum digit does no harm.
    assert len(good) < 0.15 * len(lines(5.0))


@pytest.mark.parametrize("kind", ["HDT", "THS", "HDG", "HDM"])
def test_heading_sentences_carry_the_heading(kind: str) -> None:
    config = SimulatedSensors(grade="ideal", heading_sentence=kind, variation_deg=-7.0, sentences="RMC")
    angles = [item for item in measurements(lines(1.0, config)) if isinstance(item, EulerAngles)][-1]
    psi = angles.psi_rad if angles.psi_rad is not None else angles.psi_magnetic_rad + angles.variation_rad
    assert wrap_pi(psi - 0.5) == pytest.approx(0.0, abs=math.radians(0.06))


@pytest.mark.parametrize("kind", ["PASHR", "PSAT", "PSXN"])
def test_attitude_sentences_carry_roll_and_pitch(kind: str) -> None:
    rig = SensorRig(straight(1.0, 0.2, roll_rad=0.1), sensors=SimulatedSensors(grade="ideal", attitude_sentence=kind))
    rig.run(5.0)
    assert rig.state.phi_rad == pytest.approx(rig.truth.roll_rad, abs=1e-4)
    assert rig.state.theta_rad == pytest.approx(0.0, abs=1e-4)


def test_a_sentence_the_receiver_cannot_send_is_a_configuration_error() -> None:
    with pytest.raises(ValueError, match="sends no"):
        lines(1.0, SimulatedSensors(sentences="GPXYZ"))
