"""Several sensors of one quantity, as they are on boats: one is used, the others are compared and told."""

from __future__ import annotations

import math
import random
import re
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from pydantic import ValidationError

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.estimate.receivers import FixChoice
from companion.core.nmea.line import frame
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import Distance, FixType, GpsFix, Severity, Source
from mavlink_bridge.language.units import wrap_pi
from tests.replay.own_time import timed_lines

TICK_US = 50_000


@dataclass
class Talker:
    """One device: sends a sentence at a rate, between two times."""

    sentence: Callable[[float], str]
    hz: float = 10.0
    on: tuple[tuple[float, float], ...] = ((0.0, 1e9),)
    link: int = 0
    late_s: float = 0.0
    """Where in its period it speaks."""

    def due(self, t_s: float) -> bool:
        number = math.floor((t_s - self.late_s) * self.hz + 1e-6)
        before = math.floor((t_s - 0.005 - self.late_s) * self.hz + 1e-6)
        return number > before and any(start <= t_s < end for start, end in self.on)


def heading(address: str, deg: float, sigma_deg: float = 0.0, seed: int = 1) -> Callable[[float], str]:
    rng = random.Random(seed)

    def sentence(t_s: float) -> str:
        value = (deg + rng.gauss(0.0, sigma_deg)) % 360.0
        return {"HDT": f"{address},{value:.2f},T", "HDM": f"{address},{value:.2f},M"}.get(
            address[2:], f"{address},{value:.2f},,,0.0,E"
        )

    return sentence


class Boat:
    """Links, readers and estimator at 20 Hz in virtual time."""

    def __init__(self, *configs: NmeaConfig, estimate: EstimatorConfig | None = None) -> None:
        names = ["compass", "second", "third"]
        self.readers = [
            NmeaReader(config, name) for config, name in zip(configs or (NmeaConfig(),), names, strict=False)
        ]
        self.estimator = Estimator(estimate or EstimatorConfig(variation_deg=0.0))
        self.t_us = 0
        self.texts: list[tuple[float, Severity, str]] = []
        self.yaw_deg: list[float | None] = []
        self.rate_dps: list[float | None] = []
        self.depths: list[float | None] = []

    def run(self, talkers: Sequence[Talker], until_s: float) -> None:
        while self.t_us < until_s * 1e6:
            self.t_us += 5_000
            t_s = self.t_us * 1e-6
            for talker in talkers:
                if talker.due(t_s):
                    self.feed(talker.link, frame(talker.sentence(t_s)))
            if self.t_us % TICK_US == 0:
                self.tick()

    def feed(self, link: int, data: bytes) -> None:
        for item in self.readers[link].receive(data, self.t_us):
            if self.estimator.update(item, link) and isinstance(item, Distance):
                self.depths.append(item.value_m)

    def tick(self) -> None:
        for link, reader in enumerate(self.readers):
            for item in reader.poll(self.t_us):
                self.estimator.update(item, link)
            self.texts += [(self.t_us * 1e-6, *said) for said in reader.drain_texts()]
        state = self.estimator.predict(self.t_us)
        self.texts += [(self.t_us * 1e-6, *said) for said in self.estimator.drain_texts()]
        self.yaw_deg.append(None if state.psi_rad is None else math.degrees(state.psi_rad) % 360.0)
        self.rate_dps.append(None if state.r_radps is None else math.degrees(state.r_radps))

    def said(self, what: str) -> list[str]:
        return [text for _, _, text in self.texts if what in text]

    def yaw_off(self, deg: float, since_s: float = 0.0) -> list[float]:
        """How far the yaw was off, at every tick that had one."""
        known = self.yaw_deg[round(since_s * 20) :]
        return [math.degrees(wrap_pi(math.radians(yaw - deg))) for yaw in known if yaw is not None]


@cache
def noise_alone(address: str, sigma_deg: float, seconds: float) -> tuple[float, float]:
    """RMS of yaw and of turn rate that the chosen source has when it is alone on the line."""
    boat = Boat()
    boat.run([Talker(heading(address, 100.0, sigma_deg))], seconds)
    return statistics.pstdev(boat.yaw_off(100.0, 3.0)), statistics.pstdev(
        [r for r in boat.rate_dps[60:] if r is not None]
    )


@pytest.mark.parametrize("off_deg", [1.0, 5.0, 20.0, 180.0])
@pytest.mark.parametrize(
    ("first", "second"),
    [("HEHDT", "GPHDT"), ("GPHDT", "HEHDT"), ("HCHDG", "IIHDG"), ("HCHDG", "IIHDM"), ("GPHDT", "HCHDG")],
)
def test_two_compasses_on_one_line_steer_by_one(first: str, second: str, off_deg: float) -> None:
    boat = Boat()
    boat.run(
        [Talker(heading(first, 100.0, 0.3)), Talker(heading(second, 100.0 + off_deg, 0.3, seed=2), late_s=0.04)], 30.0
    )
    used = min((100.0, 100.0 + off_deg), key=lambda deg: abs(statistics.fmean(boat.yaw_off(deg, 3.0))))
    yaw_rms, rate_rms = noise_alone(first, 0.3, 30.0)
    off = boat.yaw_off(used, 3.0)
    assert len(off) == 540
    assert statistics.pstdev(off) <= 1.2 * yaw_rms
    assert max(map(abs, off)) < 1.0
    assert statistics.pstdev([rate for rate in boat.rate_dps[60:] if rate is not None]) <= 1.2 * rate_rms
    told = boat.said("Heading")
    if off_deg == 1.0:
        assert told == []
    else:
        assert len(told) == 1
        assert float(re.search(r"reads ([\d.]+) deg", told[0])[1]) == pytest.approx(off_deg, rel=0.15)
        assert "compass" in told[0]
        assert "is used" in told[0]


def test_a_disagreement_that_comes_and_goes_is_told_at_a_bounded_rate() -> None:
    boat = Boat()

    def wandering(t_s: float) -> str:
        return f"HEHDT,{100.0 + (20.0 if t_s % 30.0 < 12.0 else 0.0):.1f},T"

    boat.run([Talker(heading("GPHDT", 100.0)), Talker(wandering)], 300.0)
    assert 2 <= len(boat.said("reads")) <= 5
    assert len(boat.texts) <= 10


def test_when_the_used_compass_falls_silent_the_other_steps_in_with_a_text_and_does_not_flap() -> None:
    boat = Boat()
    silent = ((0.0, 20.0), (23.0, 26.0), (30.0, 33.0), (40.0, 1e9))
    boat.run([Talker(heading("GPHDT", 100.0), on=silent), Talker(heading("HEHDT", 102.0))], 90.0)
    yaw = boat.yaw_deg
    assert None not in yaw[20:]
    assert yaw[20 * 19] == pytest.approx(100.0, abs=0.2)
    assert all(value == pytest.approx(102.0, abs=0.2) for value in yaw[20 * 22 : 20 * 69])
    assert yaw[20 * 80] == pytest.approx(100.0, abs=0.2)  # steady for 30 s: the preferred one again
    assert boat.said("Heading") == [
        "Heading: compass GPHDT silent, using compass HEHDT",
        "Heading: using compass GPHDT, no longer compass HEHDT",
    ]


def test_the_configuration_names_and_forbids() -> None:
    both = [Talker(heading("GPHDT", 100.0)), Talker(heading("HEHDT", 120.0))]
    for config, used in (
        (NmeaConfig(talkers=("HE",)), 120.0),
        (NmeaConfig(talkers=("GP", "HE")), 100.0),
        (NmeaConfig(talkers=("-GP",)), 120.0),
        (NmeaConfig(sentences="-GPHDT"), 120.0),
        (NmeaConfig(sentences="ZDA, GGA, HEHDT"), 120.0),
        (NmeaConfig(sentences="GPZDA, GPGGA, GPRMC, GPVTG, GPHDT"), 100.0),
    ):
        boat = Boat(config)
        boat.run(both, 5.0)
        assert boat.yaw_deg[-1] == pytest.approx(used, abs=0.1), config
    forbidden = Boat(NmeaConfig(talkers=("-GP",)))
    forbidden.run(both, 20.0)
    assert forbidden.said("Heading") == []
    assert forbidden.readers[0].counters["filtered"] > 100


def test_a_talker_is_two_letters() -> None:
    with pytest.raises(ValidationError, match="two letters"):
        NmeaConfig(talkers=("GPHDT",))


def test_a_named_compass_does_not_take_the_position_away() -> None:
    boat = Boat(NmeaConfig(talkers=("HE",)))
    gga = "GPGGA,{:06.2f},4111.1007,N,00842.3729,W,4,12,0.8,2.1,M,52.3,M,,"
    boat.run([Talker(heading("HEHDT", 120.0)), Talker(lambda t: gga.format(120000 + t % 60), hz=1.0)], 8.0)
    assert boat.estimator.predict(boat.t_us).position_valid


def test_a_true_heading_comes_before_a_magnetic_one_whatever_the_link() -> None:
    boat = Boat(NmeaConfig(), NmeaConfig())
    boat.run([Talker(heading("HCHDG", 90.0)), Talker(heading("GPHDT", 100.0), link=1, late_s=0.05)], 5.0)
    assert boat.yaw_deg[-1] == pytest.approx(100.0, abs=0.2)


def test_a_magnetic_compass_without_any_variation_never_hides_another() -> None:
    boat = Boat(estimate=EstimatorConfig(world_magnetic_model=False))
    boat.run([Talker(lambda t: "HCHDM,90.0,M"), Talker(heading("IIHDG", 100.0), late_s=0.03)], 5.0)
    assert boat.yaw_deg[-1] == pytest.approx(100.0, abs=0.2)


def test_two_links_with_a_compass_each_use_the_first_and_compare() -> None:
    boat = Boat(NmeaConfig(), NmeaConfig())
    boat.run([Talker(heading("GPHDT", 100.0)), Talker(heading("GPHDT", 130.0), link=1)], 30.0)
    assert max(map(abs, boat.yaw_off(100.0, 2.0))) < 0.2
    (text,) = boat.said("Heading")
    assert "second GPHDT reads 30 deg more than compass GPHDT" in text


def test_turn_rates_of_two_sensors_are_not_mixed() -> None:
    boat = Boat()
    talkers = [
        Talker(heading("GPHDT", 100.0)),
        Talker(lambda t: "GPROT,0.0,A"),
        Talker(lambda t: "TIROT,600.0,A", late_s=0.05),
    ]
    boat.run(talkers, 20.0)
    assert max(abs(rate) for rate in boat.rate_dps[40:] if rate is not None) < 0.2
    (text,) = boat.said("Turn rate")
    assert "10.0 deg/s" in text


def test_roll_and_pitch_of_two_sensors_are_not_mixed() -> None:
    boat = Boat()
    talkers = [
        Talker(lambda t: "PSXN,23,1.0,2.0,100.0,0.0"),
        Talker(lambda t: "IIXDR,A,-9.0,D,ROLL,A,-8.0,D,PITCH", late_s=0.05),
    ]
    rolls, pitches = [], []
    for second in range(20):
        boat.run(talkers, second + 1.0)
        state = boat.estimator.predict(boat.t_us)
        rolls.append(math.degrees(state.phi_rad))
        pitches.append(math.degrees(state.theta_rad))
    assert rolls == pytest.approx([1.0] * 20)
    assert pitches == pytest.approx([2.0] * 20)
    assert len(boat.said("Roll")) == len(boat.said("Pitch")) == 1


def test_depths_of_two_sounders_are_not_mixed_and_the_second_steps_in() -> None:
    boat = Boat()
    bow = Talker(lambda t: "SDDBT,,f,8.0,M,,F", hz=2.0, on=((0.0, 20.0),))
    stern = Talker(lambda t: "YXDPT,12.0,0.0", hz=2.0, late_s=0.2)
    boat.run([bow, stern], 20.0)
    assert set(boat.depths[1:]) == {8.0}
    (text,) = boat.said("Depth")
    assert "4.0 m more" in text
    boat.run([bow, stern], 40.0)
    assert boat.depths[-1] == 12.0
    assert boat.said("silent, using")


NO_BOTTOM = ("SDDBT,,f,,M,,F", "SDDBT,0.0,f,0.0,M,0.0,F", "SDDPT,0.0,0.0", "SDDBS,,f,0.0,M,,F", "SDDBK,,f,0.0,M,,F")


@pytest.mark.parametrize("word", NO_BOTTOM)
def test_a_sounder_that_finds_no_bottom_has_no_reading(word: str) -> None:
    """Many say 0 then: the depth guard did not believe it, but it was shown."""
    boat = Boat()
    boat.run([Talker(lambda t: word.replace("0.0", "8.0", 1) if t < 10.0 else word, hz=2.0)], 20.0)
    found = boat.estimator.distance_at(boat.t_us)
    assert found is not None
    assert found.value_m is None


@pytest.mark.parametrize("word", NO_BOTTOM)
def test_a_sounder_that_finds_no_bottom_gives_way_to_one_that_does(word: str) -> None:
    boat = Boat()
    blind = Talker(lambda t: "SDDBT,,f,8.0,M,,F" if t < 10.0 else word, hz=2.0)
    boat.run([blind, Talker(lambda t: "YXDPT,12.0,0.0", hz=2.0, late_s=0.2)], 20.0)
    assert boat.depths[-1] == 12.0


def test_the_depth_of_one_sounder_in_several_sentences_is_one_depth() -> None:
    boat = Boat()
    talkers = [
        Talker(lambda t: "SDDPT,8.0,0.0", hz=1.0),
        Talker(lambda t: "SDDBT,,f,8.0,M,,F", hz=1.0, late_s=0.01),
        Talker(lambda t: "SDDBS,,f,8.2,M,,F", hz=1.0, late_s=0.02),
    ]
    boat.run(talkers, 30.0)
    assert len(boat.depths) == 30
    assert boat.texts == []


def test_a_recorded_yacht_with_a_second_compass_on_the_network_steers_by_one(shared_data: Path) -> None:
    """Merrimac's HDG at 10 Hz, and beside it an HDM of another device 7 degrees off, as a plotter would send it."""
    log = shared_data / "nmea" / "vessel" / "signalk_gofree-merrimac.log"
    alone, beside = Boat(NmeaConfig(earliest_year=2000)), Boat(NmeaConfig(earliest_year=2000))
    for t_us, line in timed_lines(log, spread=True):
        for boat in (alone, beside):
            while boat.t_us + TICK_US <= t_us:
                boat.t_us += TICK_US
                boat.tick()
            boat.feed(0, line)
            if boat is beside and line.startswith(b"$SDHDG"):
                boat.feed(0, frame(f"IIHDM,{(float(line.split(b',')[1]) + 7.0) % 360.0:.1f},M"))
    assert beside.yaw_deg == alone.yaw_deg
    assert len([yaw for yaw in alone.yaw_deg if yaw is not None]) > 0.9 * len(alone.yaw_deg) > 2000
    assert len(beside.said("Heading")) == 1


def test_more_receivers_than_are_kept_do_not_end_the_tick():
    """From the seventeenth on a receiver that stood apart was noted and not kept: a key that was missing in the next tick."""
    choice = FixChoice([])
    for second in range(4):
        for number in range(24):
            source = Source("compass", f"G{number:02}", (number,))
            lat_rad = 0.7 if number == 0 else 0.7001
            choice.leads(
                0,
                GpsFix(second * 1_000_000 + number, FixType.FIX_3D, lat_rad, 0.1, hacc_m=1.0, source=source),
            )
    assert choice.used


def turned(address: str, off_deg: float, on: tuple[tuple[float, float], ...] = ((0.0, 1e9),)) -> Talker:
    """A compass that is right until 20 s, and from then on so far off."""
    return Talker(lambda t_s: f"{address},{(100.0 + (off_deg if t_s > 20.0 else 0.0)) % 360.0:.2f},T", on=on)


@pytest.mark.parametrize("off_deg", [60.0, -85.0, 100.0, 170.0])
def test_a_compass_that_comes_back_far_off_the_one_in_use_does_not_lead_again(off_deg: float) -> None:
    """It was told to be off, and led all the same after 30 s: she ran away at full thrust, through a fence."""
    boat = Boat()
    back = turned("GPHDT", off_deg, ((0.0, 20.0), (30.0, 1e9)))
    boat.run([back, Talker(heading("HEHDT", 100.0), late_s=0.05)], 300.0)
    assert None not in boat.yaw_deg[20:]
    assert max(map(abs, boat.yaw_off(100.0, 2.0))) < 1.0
    assert boat.said("no longer") == []
    assert len(boat.said("reads")) >= 1


def test_it_leads_again_once_it_agrees() -> None:
    boat = Boat()
    back = Talker(
        lambda t_s: f"GPHDT,{100.0 if not 30.0 < t_s < 120.0 else 270.0:.2f},T", on=((0.0, 20.0), (30.0, 1e9))
    )
    boat.run([back, Talker(heading("HEHDT", 100.0), late_s=0.05)], 119.0)
    assert boat.said("no longer") == []
    boat.run([back, Talker(heading("HEHDT", 100.0), late_s=0.05)], 160.0)
    assert boat.said("no longer") == ["Heading: using compass GPHDT, no longer compass HEHDT"]


def test_one_that_is_far_off_and_not_yet_known_to_be_does_not_step_in_unchecked() -> None:
    """The first is silent, and back for two seconds when the second falls silent: too short to be told to be off."""
    boat = Boat()
    rate = Talker(lambda t_s: "TIROT,0.0,A")
    back = turned("GPHDT", 170.0, ((0.0, 20.0), (30.0, 1e9)))
    boat.run([back, Talker(heading("HEHDT", 100.0), on=((0.0, 32.0),)), rate], 40.0)
    assert max(map(abs, boat.yaw_off(100.0, 2.0))) < 1.0


@pytest.mark.parametrize("off_deg", [40.0, 90.0, 180.0])
def test_two_compasses_that_disagree_by_more_than_a_jump_are_named_until_they_agree(off_deg: float) -> None:
    """Two positions that disagree bar arming; two compasses 180 degrees apart did not, and she ran away by the wrong one."""
    boat = Boat()
    wrong = Talker(
        lambda t_s: f"HEHDT,{(100.0 + (off_deg if t_s < 60.0 else 0.0)) % 360.0:.2f},T", on=((0.0, 30.0), (40.0, 1e9))
    )
    talkers = [Talker(heading("GPHDT", 100.0)), wrong]
    boat.run(talkers, 10.0)
    named = boat.estimator.compasses_apart
    assert re.fullmatch(rf"compass HEHDT reads {off_deg:.0f} deg (more|less) than compass GPHDT", named)
    boat.run(talkers, 39.0)
    assert boat.estimator.compasses_apart, "silence is no agreement"
    boat.run(talkers, 90.0)
    assert boat.estimator.compasses_apart == ""


def test_two_compasses_that_differ_by_less_than_a_jump_bar_nothing() -> None:
    boat = Boat()
    boat.run([Talker(heading("GPHDT", 100.0)), Talker(heading("HCHDG", 118.0))], 30.0)
    assert boat.said("reads")
    assert boat.estimator.compasses_apart == ""


def test_two_compasses_of_which_one_creeps_away_are_told_again_at_each_doubling() -> None:
    """It was told once, with 9 degrees, and never that they were 120."""
    boat = Boat()
    creeps = Talker(lambda t_s: f"GPHDT,{100.0 + min(max(t_s - 20.0, 0.0), 120.0):.2f},T")
    boat.run([creeps, Talker(heading("HCHDG", 100.0), late_s=0.05)], 200.0)
    told = [float(re.search(r"reads (\d+) deg", text)[1]) for text in boat.said("is used")]
    assert 3 <= len(told) <= 6
    assert told[0] < 15.0
    assert all(after >= 1.9 * before for before, after in pairwise(told))
    assert told[-1] > 60.0


@pytest.mark.parametrize(("hz", "late_s"), [(10.0, 0.05), (5.0, 0.03), (1.0, 0.2)])
def test_two_compasses_under_one_name_are_told(hz: float, late_s: float) -> None:
    """Two of one maker on one line were averaged without a word: 9 degrees off both."""
    boat = Boat()
    boat.run([Talker(heading("GPHDT", 100.0, 0.3)), Talker(heading("GPHDT", 120.0, 0.3), hz=hz, late_s=late_s)], 40.0)
    (told,) = boat.said("in turn")
    assert re.fullmatch(
        r"Heading: compass GPHDT says two in turn, (19|20|21) deg apart: two compasses on one line\? Part them", told
    )


def gga(north_m: float) -> str:
    return f"GPGGA,{{tod}},41{10.0 + north_m / 1852.0:010.7f},N,00842.3729000,W,4,12,0.8,2.1,M,52.3,M,,"


@pytest.mark.parametrize(
    ("apart_m", "hz", "late_s", "sails_mps"),
    [(6.0, 5.0, 0.1, 1.5), (3.0, 5.0, 0.1, 1.5), (3.0, 1.0, 0.5, 0.5), (6.0, 1.0, 0.5, 1.5), (6.0, 1.0, 0.3, 1.0)],
)
def test_two_receivers_under_one_name_are_told(apart_m: float, hz: float, late_s: float, sails_mps: float) -> None:
    """Their epochs interleaved: now one antenna was used, now the other, 6 m away; once a second nobody was told."""

    def at(north_m: float) -> Callable[[float], str]:
        return lambda t_s: gga(north_m + sails_mps * t_s).format(tod=f"12{int(t_s // 60):02}{t_s % 60.0:05.2f}")

    boat = Boat()
    boat.run([Talker(at(0.0), hz=hz), Talker(at(apart_m), hz=hz, late_s=late_s)], 30.0)
    (told,) = boat.said("in turn")
    assert "two receivers on one line" in told


@pytest.mark.parametrize("hz", [1.0, 2.0, 5.0])
def test_an_antenna_on_a_mast_that_rolls_is_one_receiver(hz: float) -> None:
    """1.5 m to either side every 2.1 s, at rest and at 8 m/s."""
    for sails_mps in (0.0, 8.0):

        def at(t_s: float, sails_mps: float = sails_mps) -> str:
            north_m = sails_mps * t_s + 1.5 * math.sin(2.0 * math.pi * t_s / 2.1)
            return gga(north_m).format(tod=f"12{int(t_s // 60):02}{t_s % 60.0:05.2f}")

        boat = Boat()
        boat.run([Talker(at, hz=hz)], 60.0)
        assert boat.said("in turn") == []


def test_a_boat_that_yaws_in_a_sea_has_one_compass() -> None:
    boat = Boat()
    yawing = Talker(lambda t_s: f"GPHDT,{100.0 + 12.0 * math.sin(2.0 * math.pi * t_s / 2.1):.2f},T", hz=1.0)
    boat.run([yawing], 60.0)
    quick = Boat()
    quick.run([Talker(lambda t_s: f"GPHDT,{100.0 + 8.0 * math.sin(2.0 * math.pi * t_s / 1.5):.2f},T")], 60.0)
    assert boat.said("in turn") == quick.said("in turn") == []


def test_two_compasses_under_one_name_that_point_opposite_ways_are_told_as_such() -> None:
    boat = Boat()
    boat.run([Talker(heading("GPHDT", 100.0)), Talker(heading("GPHDT", 280.0), late_s=0.05)], 20.0)
    assert "180 deg apart" in boat.said("in turn")[0]
