"""A compass that repeats one heading: found by the turn that it hides, and never where a boat truly lies or sails still."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from companion.core.estimate.doubts.repeats import RepeatWatch
from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from companion.core.steer.turned import ModelledTurn
from companion.settings.schema import load_vessel
from mavlink_bridge.language.messages import ActuatorOutput, EulerAngles, FixType, GpsFix
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors import SimulatedSensors
from tests.replay.own_time import timed_lines
from tests.unit.test_sensor_sources import Boat, Talker
from tools.benches.cells.sensor_rig import SensorRig, circle, straight

REPEATS = "repeats one heading"


def said(made: SensorRig, what: str = REPEATS) -> list[str]:
    return [text for _, _, text in made.texts if what in text]


def off_deg(made: SensorRig) -> float:
    assert made.state.psi_rad is not None
    return abs(math.degrees(wrap_pi(made.state.psi_rad - made.truth.psi_rad)))


@pytest.mark.parametrize("also", [(), ("rate_frozen",), ("rate_silent",)])
def test_a_frozen_compass_on_a_circle_is_found_named_and_replaced_by_the_course(also: tuple[str, ...]) -> None:
    made = SensorRig(circle(20.0, 1.5))
    made.run(20.0)
    for name in ("heading_frozen", *also):
        made.suite.faults.set(name, True)
    lost: list[bool] = []
    made.run(12.0, lambda here: lost.append(not here.state.heading_valid))
    assert said(made) == ["Heading: NMEA GPHDT repeats one heading while the vessel turns: not used"]
    assert not any(lost), "the course stands in from the same tick on"
    assert made.state.heading_from_course
    off: list[float] = []
    made.run(20.0, lambda here: off.append(off_deg(here)))
    assert max(off) < 12.0
    for name in ("heading_frozen", *also):
        made.suite.faults.set(name, False)
    made.run(2.0)
    assert not made.state.heading_from_course
    assert off_deg(made) < 3.0
    assert said(made)[-1] == "Heading: NMEA GPHDT no longer repeats one heading"


def test_what_it_taught_of_the_water_is_forgotten() -> None:
    made = SensorRig(circle(20.0, 1.5, (0.0, 0.4)), sensors=SimulatedSensors(rate_hz=0.0))
    made.run(60.0)
    made.suite.faults.heading_frozen = True
    made.run(14.0)
    assert said(made)
    assert made.state.drift_n_mps == pytest.approx(0.0, abs=0.1)
    assert made.state.drift_e_mps == pytest.approx(0.4, abs=0.1)


def test_below_the_speed_of_a_course_a_frozen_compass_is_no_heading() -> None:
    made = SensorRig(circle(5.0, 0.5))
    made.run(10.0)
    made.suite.faults.heading_frozen = True
    made.run(8.0)
    assert said(made)
    assert not made.state.heading_valid


@pytest.mark.parametrize("speed_mps", [0.0, 0.5, 1.5])
def test_a_boat_at_her_berth_or_on_a_calm_line_truly_repeats_a_heading(speed_mps: float) -> None:
    for grade in ("ideal", "standalone"):
        made = SensorRig(straight(speed_mps, 0.4), sensors=SimulatedSensors(grade=grade))
        made.run(5.0)
        made.suite.faults.heading_frozen = True
        made.run(120.0)
        assert said(made) == []
        assert made.state.heading_valid


def hung_in_a_turn(sensors: SimulatedSensors, seconds: float) -> tuple[SensorRig, list[float]]:
    """A compass that repeats its last digits for so long in a turn of 17 deg/s, then is right; how far off the heading is since then."""
    made = SensorRig(circle(5.0, 1.5, (0.0, 0.3)), sensors=sensors)

    def ask(here: SensorRig) -> None:
        here.estimator.note_turn(here.now_us, 0.05, 0.3)

    made.run(20.0, ask)
    made.suite.faults.heading_frozen = True
    made.run(seconds, ask)
    made.suite.faults.heading_frozen = False
    made.run(0.2, ask)
    off: list[float] = []
    for _ in range(80):
        made.run(0.1, ask)
        off.append(off_deg(made))
    return made, off


@pytest.mark.parametrize("seconds", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("rate_hz", [0.0, 10.0])
def test_a_compass_that_hung_in_a_turn_is_believed_when_it_is_right_again(rate_hz: float, seconds: float) -> None:
    made, off = hung_in_a_turn(SimulatedSensors(rate_hz=rate_hz), seconds)
    assert not [text for _, _, text in made.texts if "Heading" in text]
    assert max(off) < 5.0
    assert made.state.drift_n_mps == pytest.approx(0.0, abs=0.2)
    assert made.state.drift_e_mps == pytest.approx(0.3, abs=0.2)


def test_while_it_hangs_the_rate_sensor_carries_the_heading() -> None:
    made = SensorRig(circle(5.0, 1.5))
    made.run(20.0)
    made.suite.faults.heading_frozen = True
    off: list[float] = []
    made.run(3.5, lambda here: off.append(off_deg(here)))
    assert max(off) < 8.0


def test_a_rate_sensor_that_tells_of_turns_that_are_none_moves_no_coarse_compass() -> None:
    """Whole degrees repeat for two seconds here, and 20 deg/s are told meanwhile: found out at the first new degree."""
    boat = Boat()
    boat.run([degrees("GPHDT", 0.5), Talker(lambda t_s: f"TIROT,{1200.0 if t_s > 10.0 else 0.0},A")], 60.0)
    assert None not in boat.yaw_deg[2:]
    settled = [(0.05 * 0.5 * tick, yaw) for tick, yaw in enumerate(boat.yaw_deg) if tick > 300 and yaw is not None]
    assert max(abs(yaw - true) for true, yaw in settled) < 25.0


def degrees(address: str, dps: float) -> Talker:
    """A compass of whole degrees on a boat that turns so fast."""
    return Talker(lambda t_s: f"{address},{round(dps * t_s) % 360:.0f},T")


def test_a_slow_turn_of_whole_degrees_beside_a_rate_sensor_is_no_fault() -> None:
    boat = Boat()
    boat.run([degrees("GPHDT", 0.3), Talker(lambda t_s: "GPROT,18.0,A")], 60.0)
    assert boat.said(REPEATS) == []


def test_a_rate_sensor_that_is_off_by_a_degree_a_second_gives_no_compass_up() -> None:
    boat = Boat()
    boat.run([degrees("GPHDT", 0.0), Talker(lambda t_s: "TIROT,60.0,A")], 120.0)
    assert boat.said(REPEATS) == []


def test_another_compass_steps_in_and_the_first_leads_again_when_it_lives() -> None:
    boat = Boat()
    first = Talker(lambda t_s: f"GPHDT,{4.0 * (30.0 if 30.0 < t_s < 60.0 else t_s) % 360:.2f},T")
    second = Talker(lambda t_s: f"HEHDT,{4.0 * t_s % 360:.2f},T", hz=5.0)
    boat.run([first, second, Talker(lambda t_s: "TIROT,240.0,A")], 110.0)
    found = [text for text in boat.said("Heading") if "reads" not in text and "agree" not in text]
    assert found == [
        "Heading: compass GPHDT repeats one heading while the vessel turns: not used",
        "Heading: compass GPHDT repeats one heading, using compass HEHDT",
        "Heading: compass GPHDT no longer repeats one heading",
        "Heading: using compass GPHDT, no longer compass HEHDT",
    ]
    assert None not in boat.yaw_deg[2:]


def heard(watch: RepeatWatch, seconds: float, asked_radps: float, sog_mps: float = 0.3, psi_rad: float = 0.5) -> str:
    """What a compass that says the same for so long is found to do beside a turn that is asked for."""
    proof = ""
    for number in range(round(20.0 * seconds)):
        t_us = 50_000 * number
        watch.note_fix(GpsFix(t_us, FixType.RTK_FIXED, 0.7, 1e-7 * number, sog_mps=sog_mps), (0.0, 0.0), 1.0)
        watch.note_asked(t_us, 0.05, asked_radps)
        proof = proof or watch.hear("compass", EulerAngles(t_us, psi_rad=psi_rad))
    return proof


def test_on_the_spot_the_turn_that_was_asked_for_proves_it() -> None:
    assert heard(RepeatWatch(), 6.0, 0.3) == "though the vessel should turn"
    assert heard(RepeatWatch(), 60.0, 0.03) == "", "a rudder that stands off asks for so much for ever"


def test_a_boat_that_is_tied_does_not_turn_for_thrust() -> None:
    """Sticks at the berth, and Hold in a breeze on a trailer: her compass was barred, and she could not be armed again."""
    assert heard(RepeatWatch(), 60.0, 0.3, sog_mps=0.05) == ""


def sent_out(share: float) -> ActuatorOutput:
    """Port ahead and starboard astern."""
    return ActuatorOutput(0, share, -share, 0.0, 0.0, "")


def test_what_holds_against_a_wind_asks_for_no_turn() -> None:
    """Port and starboard against a steady push: learnt while the compass lives, no turn once its degrees stay the same."""
    turned, sent = ModelledTurn(load_vessel("otter")), sent_out(0.3)
    for _ in range(1200):
        turned.step(0.05, sent, 0.0, 0.0)
    rates = [turned.step(0.05, sent, 0.0, None) for _ in range(200)]
    assert abs(0.05 * math.fsum(rates)) < math.radians(10.0)
    rates = [turned.step(0.05, sent_out(0.9), 0.0, None) for _ in range(200)]
    assert 0.05 * math.fsum(rates) > math.radians(90.0)


def test_no_recorded_compass_is_taken_for_a_frozen_one(shared_data: Path) -> None:
    compasses = 0
    for path in sorted((shared_data / "nmea").rglob("*")):
        if not path.is_file() or path.suffix not in (".log", ".txt", ".nmea"):
            continue
        reader = NmeaReader(NmeaConfig(earliest_year=2000, checksum_required=False))
        estimator = Estimator(EstimatorConfig(variation_deg=0.0, speed_max_mps=60.0))
        last_us, headings = 0, 0
        for now_us, line in timed_lines(path):
            for item in (*reader.receive(line, now_us), *reader.poll(now_us)):
                estimator.update(item)
                headings += isinstance(item, EulerAngles)
            if now_us - last_us >= 50_000:
                last_us = now_us
                estimator.predict(now_us)
        assert [text for _, text in estimator.drain_texts() if REPEATS in text] == [], path.name
        compasses += headings > 100
    assert compasses >= 5
