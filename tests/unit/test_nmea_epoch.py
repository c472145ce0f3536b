"""Epochs: which sentences belong together, when a fix is published, and what the calendar makes of it."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.line import frame
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import EulerAngles, FixType, GpsFix, Severity
from sitl.sensors import nmea_writer as write

LAT, LON = math.radians(41.1850123), math.radians(-8.7062154)
START_US = 1_767_268_800_000_000


class Talker:
    """A receiver on a line: writes one epoch at a time, remembers the fixes that count."""

    def __init__(self, **options: object) -> None:
        self.reader = NmeaReader(NmeaConfig(**options))
        self.estimator = Estimator(EstimatorConfig())
        self.now_us = 10_000_000
        self.fixes: list[GpsFix] = []
        self.others: list[object] = []
        self.texts: list[tuple[Severity, str]] = []

    def send(self, *sentences: bytes, gap_us: int = 2_000) -> None:
        for sentence in sentences:
            self.now_us += gap_us
            self._keep(self.reader.receive(sentence, self.now_us))

    def wait(self, us: int) -> None:
        end_us = self.now_us + us
        while self.now_us < end_us:
            self.now_us = min(end_us, self.now_us + 50_000)
            self._keep(self.reader.poll(self.now_us))
            self.texts += self.reader.drain_texts()

    def _keep(self, found: list) -> None:
        for item in found:
            if not self.estimator.update(item):
                continue
            (self.fixes if isinstance(item, GpsFix) else self.others).append(item)


def epoch(utc_us: int, kinds: str = "ZDA GGA RMC VTG HDT", north_rad: float = 0.0, talker: str = "GP") -> list[bytes]:
    time = write.time_fields(utc_us)
    lat = LAT + north_rad
    fix = write.fix_text(lat, LON, 1.5, 0.3)
    made = {
        "ZDA": write.zda(talker, time),
        "GGA": write.gga(talker, time[0], fix, 4, 12, 0.8, 2.1, 52.3),
        "RMC": write.rmc(talker, time, fix, None, "R"),
        "VTG": write.vtg(talker, fix, "R"),
        "HDT": write.heading(talker, "HDT", 0.3, None),
        "GLL": frame(f"{talker}GLL,{write.position(lat, LON)},{time[0]},A,R"),
        "GST": write.gst(talker, time[0], 0.05, 0.1),
        "GSA": frame(f"{talker}GSA,A,3,01,02,,,,,,,,,,,2.0,1.0,1.7"),
    }
    return [made[kind] for kind in kinds.split()]


def test_g4_an_epoch_is_published_at_its_last_sentence_once_the_order_is_learned() -> None:
    talker = Talker()
    for second in range(5):
        talker.send(*epoch(START_US + second * 1_000_000))
        published = len(talker.fixes)
        talker.wait(990_000)
    assert published == 5
    assert len(talker.fixes) == 5
    assert [fix.utc_us for fix in talker.fixes] == [START_US + second * 1_000_000 for second in range(5)]
    assert talker.fixes[-1].complete


def test_g4_the_configured_order_says_from_the_first_epoch_on_which_sentence_is_last() -> None:
    talker = Talker(sentences="GPZDA, GPGGA, GPRMC, GPVTG, GPHDT")
    talker.send(*epoch(START_US))
    assert len(talker.fixes) == 1


@pytest.mark.parametrize("lost", ["ZDA", "GGA", "RMC", "VTG"])
def test_g4_a_lost_sentence_costs_only_itself_and_epochs_do_not_mix(lost: str) -> None:
    talker = Talker()
    for second in range(6):
        kinds = "ZDA GGA RMC VTG HDT" if second != 4 else "ZDA GGA RMC VTG HDT".replace(lost, "").replace("  ", " ")
        talker.send(*epoch(START_US + second * 1_000_000, kinds.strip(), north_rad=second * 1e-6))
        talker.wait(990_000)
    assert [fix.utc_us for fix in talker.fixes] == [START_US + second * 1_000_000 for second in range(6)]
    for second, fix in enumerate(talker.fixes):
        assert fix.lat_rad == pytest.approx(LAT + second * 1e-6, abs=1e-10)
    damaged = talker.fixes[4]
    assert damaged.sog_mps == pytest.approx(1.5, abs=1e-3)
    assert damaged.complete == (lost != "VTG")


def test_g4_an_unfinished_epoch_is_published_after_a_quarter_second() -> None:
    talker = Talker(sentences="ZDA,GGA,RMC,VTG")
    talker.send(*epoch(START_US, "ZDA GGA"))
    talker.wait(200_000)
    assert talker.fixes == []
    talker.wait(100_000)
    assert len(talker.fixes) == 1
    assert not talker.fixes[0].complete
    assert talker.fixes[0].sog_mps is None


def test_g4_the_tail_of_a_lost_epoch_does_not_join_the_next_one() -> None:
    """Only VTG of one epoch survives; the next one comes 0.2 s later."""
    for learned in (True, False):
        talker = Talker()
        if learned:
            for tick in range(5):
                talker.send(*epoch(START_US + tick * 200_000, "GGA VTG"))
                talker.wait(196_000)
        before = len(talker.fixes)
        talker.send(frame("GPVTG,92.40,T,,M,9.0,N,,K,A"))
        talker.wait(198_000)
        talker.send(*epoch(START_US + 1_200_000, "GGA VTG"))
        talker.wait(400_000)
        (fix,) = talker.fixes[before:]
        assert fix.sog_mps == pytest.approx(1.5, abs=1e-3)
        assert talker.now_us - 400_000 - 120_000 - fix.t_us <= 10_000


def test_g6_heading_stamps_are_its_own() -> None:
    talker = Talker()
    talker.send(*epoch(START_US, "GGA HDT RMC"), gap_us=20_000)
    (angles,) = talker.others
    assert isinstance(angles, EulerAngles)
    assert angles.t_us == 10_040_000


def test_the_time_of_validity_is_the_first_byte_less_the_latency() -> None:
    talker = Talker(sentences="ZDA,GGA,RMC,VTG", position_latency_s=0.3)
    talker.send(*epoch(START_US), gap_us=10_000)
    assert talker.fixes[0].t_us == 10_010_000 - 300_000


def test_a_slow_zda_neither_delays_nor_loses_a_fix() -> None:
    talker = Talker()
    for tenth in range(40):
        kinds = "GGA VTG ZDA" if tenth % 10 == 0 else "GGA VTG"
        talker.send(*epoch(START_US + tenth * 100_000, kinds))
        talker.wait(90_000)
    assert len(talker.fixes) == 40
    steps = [after.t_us - before.t_us for before, after in zip(talker.fixes, talker.fixes[1:], strict=False)]
    assert max(steps) - min(steps) <= 10_000
    assert all(fix.utc_us is not None for fix in talker.fixes[2:])


def test_fast_receivers_are_published_at_their_rate() -> None:
    talker = Talker()
    for tick in range(100):
        talker.send(*epoch(START_US + tick * 50_000, "GGA RMC"), gap_us=500)
        talker.wait(49_000)
    assert len(talker.fixes) == 100


def test_an_epoch_without_any_time_is_still_a_fix() -> None:
    talker = Talker()
    for _ in range(4):
        talker.send(
            frame(f"GPGGA,,{write.position(LAT, LON)},4,12,0.8,2.1,M,52.3,M,,"), frame("GPVTG,1.0,T,,M,1.0,N,,K,A")
        )
        talker.wait(990_000)
    assert len(talker.fixes) == 4
    assert all(fix.has_position and fix.utc_us is None and fix.sog_mps is not None for fix in talker.fixes)


def test_blank_sentences_before_the_first_fix_say_no_fix() -> None:
    talker = Talker()
    for _ in range(3):
        talker.send(frame("GPGGA,,,,,,0,,,,M,,M,,"), frame("GPRMC,,V,,,,,,,,,,N"), frame("GPVTG,,T,,M,,N,,K,N"))
        talker.wait(990_000)
    assert len(talker.fixes) == 3
    assert all(fix.fix_type == FixType.NONE and not fix.has_position for fix in talker.fixes)


def test_accuracy_and_dilution_come_with_the_fix() -> None:
    talker = Talker()
    talker.send(*epoch(START_US, "GGA GSA GST RMC"))
    talker.wait(300_000)
    (fix,) = talker.fixes
    assert fix.hacc_m == pytest.approx(0.05, abs=1e-3)
    assert (fix.hdop, fix.vdop, fix.satellites) == (0.8, 1.7, 12)


def test_rmc_alone_keeps_the_quality_of_the_last_gga() -> None:
    talker = Talker()
    bare = frame(f"INRMC,120001,A,{write.position(LAT, LON)},5.2,77.3,010126,,")
    talker.send(*epoch(START_US, "GGA"))
    talker.wait(900_000)
    talker.send(bare)
    talker.wait(900_000)
    talker.send(bare.replace(b"120001", b"120001"))
    talker.wait(6_000_000)
    talker.send(bare)
    talker.wait(900_000)
    assert [fix.fix_type for fix in talker.fixes] == [FixType.RTK_FIXED] * 3 + [FixType.FIX_2D]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("2026-01-01T23:59:59", "2026-01-02T00:00:00"),
        ("2027-02-28T23:59:59", "2027-03-01T00:00:00"),
        ("2028-02-28T23:59:59", "2028-02-29T00:00:00"),
        ("2026-12-31T23:59:59", "2027-01-01T00:00:00"),
    ],
)
def test_midnight_month_and_year_without_a_date_in_the_epoch(before: str, after: str) -> None:
    """Only the first epoch carries a date; the next one has a time of day alone."""
    first_us, second_us = utc(before), utc(after)
    talker = Talker()
    talker.send(*epoch(first_us, "ZDA GGA VTG"))
    talker.wait(996_000)
    talker.send(*epoch(second_us, "GGA VTG"))
    talker.wait(300_000)
    assert [fix.utc_us for fix in talker.fixes] == [first_us, second_us]


def test_a_zda_just_before_midnight_and_a_late_one_after_it() -> None:
    talker = Talker()
    start_us = utc("2026-06-30T23:59:57")
    for second in range(6):
        talker.send(*epoch(start_us + second * 1_000_000, "GGA VTG ZDA" if second < 1 else "GGA VTG"))
        talker.wait(993_000)
    assert [fix.utc_us for fix in talker.fixes[1:]] == [start_us + second * 1_000_000 for second in range(1, 6)]


def test_a_leap_second_is_the_midnight_after_it() -> None:
    talker = Talker()
    talker.send(*epoch(utc("2026-12-31T23:59:59"), "ZDA GGA"))
    talker.wait(996_000)
    sentence = frame(f"GPGGA,235960.00,{write.position(LAT, LON)},4,12,0.8,2.1,M,52.3,M,,")
    talker.send(frame("GPZDA,235960.00,31,12,2026,00,00"), sentence)
    talker.wait(996_000)
    talker.send(*epoch(utc("2027-01-01T00:00:00"), "ZDA GGA"))
    talker.wait(300_000)
    assert [fix.utc_us for fix in talker.fixes] == [
        utc(t) for t in ("2026-12-31T23:59:59", *["2027-01-01T00:00:00"] * 2)
    ]
    assert all(fix.has_position for fix in talker.fixes)


@pytest.mark.parametrize("years_off", [1024 * 7 / 365.2425, 46.0, -1024 * 7 / 365.2425])
def test_row_33_a_date_1024_weeks_off_or_1980_is_not_used_but_the_position_is(years_off: float) -> None:
    wrong_us = START_US - round(years_off * 365.2425) * 86_400 * 10**6
    talker = Talker()
    for second in range(3):
        talker.send(*epoch(wrong_us + second * 1_000_000))
        talker.wait(990_000)
    assert [fix.utc_us for fix in talker.fixes] == [None] * 3
    assert all(fix.has_position for fix in talker.fixes)
    assert [text for severity, text in talker.texts if "date" in text and severity == Severity.WARNING]
    talker.send(*epoch(START_US + 3_000_000))
    talker.wait(300_000)
    assert talker.fixes[-1].utc_us == START_US + 3_000_000


def test_row_58_time_going_back_gives_fixes_all_the_same() -> None:
    talker = Talker()
    for second in (0, 1, 2, 1, 0, 1):
        talker.send(*epoch(START_US + second * 1_000_000))
        talker.wait(990_000)
    assert [round((fix.utc_us - START_US) / 1e6) for fix in talker.fixes] == [0, 1, 2, 1, 0, 1]


def test_row_58_two_receivers_interleaved_are_never_mixed_and_the_operator_is_told() -> None:
    """GP and GN in turn, ten metres apart, sentence by sentence."""
    talker = Talker()
    for second in range(6):
        utc_us = START_US + second * 1_000_000
        pairs = zip(epoch(utc_us, "GGA RMC VTG"), epoch(utc_us, "GGA RMC VTG", 10 / 6.371e6, "GN"), strict=True)
        for first, other in pairs:
            talker.send(first, other)
        talker.wait(980_000)
    late = [fix for fix in talker.fixes if (fix.utc_us or 0) >= START_US + 2_000_000]
    assert len(late) == 4
    assert len({round(fix.lat_rad, 9) for fix in late}) == 1
    for fix in talker.fixes:
        assert min(abs(fix.lat_rad - LAT), abs(fix.lat_rad - LAT - 10 / 6.371e6)) < 1e-10
    assert any("two receivers" in text for _, text in talker.texts)


def test_a_configured_talker_decides_between_two_receivers() -> None:
    talker = Talker(talkers=("GN",))
    for second in range(3):
        utc_us = START_US + second * 1_000_000
        talker.send(*epoch(utc_us), *epoch(utc_us, north_rad=10 / 6.371e6, talker="GN"))
        talker.wait(970_000)
    assert len(talker.fixes) == 3
    assert all(fix.lat_rad == pytest.approx(LAT + 10 / 6.371e6, abs=1e-10) for fix in talker.fixes)


def test_the_second_receiver_takes_over_when_the_first_falls_silent() -> None:
    talker = Talker()
    for second in range(10):
        utc_us = START_US + second * 1_000_000
        if second < 4:
            talker.send(*epoch(utc_us))
        talker.send(*epoch(utc_us, talker="GN"))
        talker.wait(970_000)
    assert round((talker.fixes[-1].utc_us - START_US) / 1e6) == 9
    assert talker.reader.counters["other_talker"] > 0


def test_one_receiver_may_mix_talkers() -> None:
    """Many receivers send GPGGA beside GNRMC, and turn from GP to GN when they see other constellations."""
    talker = Talker()
    for second in range(8):
        utc_us = START_US + second * 1_000_000
        talker.send(*epoch(utc_us, "GGA VTG", talker="GP" if second < 4 else "GN"), *epoch(utc_us, "RMC", talker="GN"))
        talker.wait(990_000)
    assert len(talker.fixes) == 8
    assert not any("receivers" in text for _, text in talker.texts)


def test_the_operator_hears_of_damage_silence_and_garbage_once_each() -> None:
    talker = Talker()
    for second in range(40):
        sentences = epoch(START_US + second * 1_000_000)
        if 10 <= second < 20:
            sentences = [sentence.replace(b"*", b"*0") for sentence in sentences[:2]] + sentences[2:]
        if 25 <= second < 32:
            sentences = sentences[:-1]
        talker.send(*sentences)
        talker.wait(990_000)
    texts = [text for _, text in talker.texts]
    assert sum("damaged" in text for text in texts) == 1
    assert sum("clean" in text for text in texts) == 1
    assert [text for text in texts if "HDT silent" in text] == ["NMEA: GPHDT silent for 5 s"]
    assert sum("GPHDT is back" in text for text in texts) == 1
    garbage = Talker()
    for _ in range(12):
        garbage.send(bytes(range(128, 228)))
        garbage.wait(990_000)
    assert [severity for severity, _ in garbage.texts] == [Severity.WARNING]


def test_a_sound_sentence_with_a_value_that_cannot_be_is_no_matter_of_the_cable() -> None:
    talker = Talker()
    for second in range(40):
        sentences = epoch(START_US + second * 1_000_000)
        talker.send(*sentences, frame(f"SDDPT,{-3.0 if 10 <= second < 20 else 3.0},0.0,"))
        talker.wait(990_000)
    texts = [text for _, text in talker.texts]
    assert not any("damaged" in text for text in texts)
    assert sum("SDDPT among them, say what cannot be: check that device's settings" in text for text in texts) == 1
    assert sum("values are possible again" in text for text in texts) == 1


def test_ages_and_counters_show_each_sentence() -> None:
    talker = Talker()
    talker.send(*epoch(START_US))
    talker.wait(2_000_000)
    ages = talker.reader.sentence_ages(talker.now_us)
    assert set(ages) == {"GPZDA", "GPGGA", "GPRMC", "GPVTG", "GPHDT"}
    assert ages["GPHDT"] == pytest.approx(2.0, abs=0.01)
    assert talker.reader.counters["GPGGA"] == 1


def test_the_relay_for_a_plotter_holds_the_good_sentences_within_bounds() -> None:
    sent = epoch(START_US)
    for relay, expected in ((True, b"".join(sent)), (False, b"")):
        reader = NmeaReader(NmeaConfig(relay=relay))
        reader.receive(b"garbage" + b"".join(sent) + b"$GPGGA,broken*00\r\n", 0)
        assert reader.take_relay() == expected
        assert reader.take_relay() == b""
    flooded = NmeaReader(NmeaConfig(relay=True))
    for _ in range(1000):
        flooded.receive(b"".join(sent), 0)
    assert len(flooded.take_relay()) < 20_000


def utc(text: str) -> int:
    return round(datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp()) * 1_000_000


def test_the_sentences_of_a_receiver_that_falls_silent_are_one_text() -> None:
    """The compass goes on; the receiver of the same line does not."""
    talker = Talker()
    for second in range(30):
        talker.send(*epoch(START_US + second * 1_000_000, "GGA RMC VTG HDT" if not 10 <= second < 20 else "HDT"))
        talker.wait(990_000)
    told = [text for _, text in talker.texts if "silent" in text or "back" in text]
    assert told == ["NMEA: GPGGA, GPRMC, GPVTG silent for 3 s", "NMEA: GPGGA, GPRMC, GPVTG are back"]
