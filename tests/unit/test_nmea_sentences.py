"""Single sentences: every kind once with known values, blanks as unknown, and impossible fields refused."""

from __future__ import annotations

import math

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.fields import BadFieldError, coordinate_rad, day_number, time_of_day_us
from companion.core.nmea.line import frame
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from companion.core.nmea.sentences import parse
from mavlink_bridge.language.messages import AngularVelocity, Distance, EulerAngles, FixType, GpsFix

SEED_EPOCH = b"""$GPZDA,102436.00,15,06,2022,00,00*64
$GPGGA,102436.00,4111.1007380,N,00842.3729240,W,2,10,0.9,2.10,M,52.30,M,4.0,0129*5F
$GPRMC,102436.00,A,4111.1007380,N,00842.3729240,W,2.90,92.40,150622,1.9,W,D*03
$GPVTG,92.40,T,94.30,M,2.90,N,5.37,K,D*2D
$GPHDT,92.40,T*3A
$PSAT,HPR,102436.00,92.40,1.20,-0.80,N*39
"""
OLD = NmeaConfig(earliest_year=1980)


def measure(*bodies: str, config: NmeaConfig = OLD) -> list[object]:
    reader = NmeaReader(config, depths_m=(0.2, 0.35))
    found: list[object] = []
    for body in bodies:
        found += reader.receive(frame(body), 1_000_000)
    return found + reader.poll(2_000_000)


def fix_of(*bodies: str) -> GpsFix:
    fixes = [item for item in measure(*bodies) if isinstance(item, GpsFix)]
    assert len(fixes) == 1
    return fixes[0]


def test_the_seeds_epoch_gives_position_speed_time_and_attitude() -> None:
    reader = NmeaReader(OLD)
    found = [*reader.receive(SEED_EPOCH, 5_000_000), *reader.poll(6_000_000)]
    fix = next(item for item in found if isinstance(item, GpsFix))
    assert math.degrees(fix.lat_rad) == pytest.approx(41.1850123, abs=1e-9)
    assert math.degrees(fix.lon_rad) == pytest.approx(-8.7062154, abs=1e-9)
    assert fix.height_ellipsoid_m == pytest.approx(54.40)
    assert fix.height_msl_m == pytest.approx(2.10)
    assert fix.sog_mps == pytest.approx(1.4917, abs=1e-4)
    assert fix.cog_rad == pytest.approx(1.61268, abs=1e-5)
    assert fix.utc_us == 1_655_288_676_000_000
    assert fix.fix_type == FixType.DGPS
    assert fix.t_us == 5_000_000 - 120_000
    angles = [item for item in found if isinstance(item, EulerAngles)]
    assert angles[0].psi_rad == pytest.approx(1.61268, abs=1e-5)
    assert math.degrees(angles[1].theta_rad) == pytest.approx(1.2)
    assert math.degrees(angles[1].phi_rad) == pytest.approx(-0.8)


def test_g1_heading_sentence_alone_yields_attitude_and_g10_no_roll_or_pitch() -> None:
    (angles,) = measure("GPHDT,92.40,T")
    assert isinstance(angles, EulerAngles)
    assert angles.psi_rad == pytest.approx(math.radians(92.4))
    assert angles.phi_rad is None
    assert angles.theta_rad is None


@pytest.mark.parametrize(
    ("quality", "fix_type", "dead_reckoning", "simulated"),
    [
        (0, FixType.NONE, False, False),
        (1, FixType.FIX_3D, False, False),
        (2, FixType.DGPS, False, False),
        (3, FixType.FIX_3D, False, False),
        (4, FixType.RTK_FIXED, False, False),
        (5, FixType.RTK_FLOAT, False, False),
        (6, FixType.FIX_2D, True, False),
        (7, FixType.FIX_3D, False, True),
        (8, FixType.FIX_3D, False, True),
    ],
)
def test_g2_g3_gga_quality(quality: int, fix_type: FixType, dead_reckoning: bool, simulated: bool) -> None:
    fix = fix_of(f"GPGGA,102436.00,4111.1007380,N,00842.3729240,W,{quality},10,0.9,2.10,M,52.30,M,,")
    assert fix.fix_type == fix_type
    assert fix.has_position == (quality != 0)
    assert (fix.dead_reckoning, fix.simulated) == (dead_reckoning, simulated)


@pytest.mark.parametrize("talker", ["GP", "GN", "GL", "GA", "II", "IN", "HE"])
def test_g5_any_talker(talker: str) -> None:
    assert fix_of(f"{talker}GGA,102436.00,4111.1007380,N,00842.3729240,W,4,10,0.9,2.10,M,52.30,M,,").has_position
    assert measure(f"{talker}HDT,92.40,T")


def test_g5_the_order_may_hold_full_names_or_formatters_and_filters() -> None:
    gga = "GNGGA,102436.00,4111.1007380,N,00842.3729240,W,4,10,0.9,2.10,M,52.30,M,,"
    for order in ("GPZDA, GPGGA, GPRMC, GPVTG, GPHDT", "ZDA,GGA,RMC,VTG,HDT", "zda gga".replace(" ", ",")):
        assert measure(gga, config=NmeaConfig(sentences=order, earliest_year=1980))
    assert measure(gga, config=NmeaConfig(sentences="GPHDT")) == []


def test_g7_rmc_gives_speed_course_and_date_without_vtg() -> None:
    fix = fix_of("GPRMC,102436.00,A,4111.1007380,N,00842.3729240,W,2.90,92.40,150622,1.9,W,D")
    assert fix.sog_mps == pytest.approx(2.9 * 1852 / 3600)
    assert fix.cog_rad == pytest.approx(math.radians(92.4))
    assert fix.utc_us == 1_655_288_676_000_000
    assert fix.fix_type == FixType.DGPS


def test_g7_rmc_void_means_no_fix() -> None:
    fix = fix_of(
        "GPGGA,102436.00,4111.1007380,N,00842.3729240,W,1,10,0.9,2.10,M,52.30,M,,",
        "GPRMC,102436.00,V,4111.1007380,N,00842.3729240,W,2.90,92.40,150622,,,N",
    )
    assert fix.fix_type == FixType.NONE
    assert not fix.has_position


def test_g8_a_blank_course_is_unknown_not_north() -> None:
    fix = fix_of(
        "GPGGA,102436.00,4111.1007380,N,00842.3729240,W,1,10,0.9,2.10,M,52.30,M,,", "GPVTG,,T,,M,0.02,N,0.04,K,A"
    )
    assert fix.cog_rad is None
    assert fix.sog_mps == pytest.approx(0.04 / 3.6)


def test_missing_kmh_falls_back_to_knots() -> None:
    fix = fix_of(
        "GPGGA,102436.00,4111.1007380,N,00842.3729240,W,1,10,0.9,2.10,M,52.30,M,,", "GPVTG,92.4,T,,M,2.90,N,,K,A"
    )
    assert fix.sog_mps == pytest.approx(2.9 * 1852 / 3600)


def test_claimed_quality_without_satellites_needs_a_valid_rmc() -> None:
    gga = "GPGGA,102436.00,4111.1007380,N,00842.3729240,W,1,00,0.9,2.10,M,52.30,M,,"
    assert not fix_of(gga).has_position
    assert fix_of(gga, "GPRMC,102436.00,A,4111.1007380,N,00842.3729240,W,2.90,92.40,150622,,,A").has_position


@pytest.mark.parametrize(
    ("modes", "fix_type"),
    [
        ("NN", FixType.NONE),
        ("AN", FixType.FIX_3D),
        ("DA", FixType.DGPS),
        ("AR", FixType.RTK_FIXED),
        ("FA", FixType.RTK_FLOAT),
    ],
)
def test_gns_takes_the_best_constellation(modes: str, fix_type: FixType) -> None:
    fix = fix_of(f"GNGNS,102436.00,4111.1007380,N,00842.3729240,W,{modes},10,0.9,2.10,52.30,,")
    assert fix.fix_type == fix_type


def test_gll_and_gst() -> None:
    fix = fix_of("GPGLL,4111.1007380,S,00842.3729240,E,102436.00,A,D", "GPGST,102436.00,1,,,,0.3,0.4,0.7")
    assert math.degrees(fix.lat_rad) == pytest.approx(-41.1850123, abs=1e-9)
    assert math.degrees(fix.lon_rad) == pytest.approx(8.7062154, abs=1e-9)
    assert fix.hacc_m == pytest.approx(0.5)
    assert fix.vacc_m == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("body", "phi_deg", "theta_deg", "psi_deg"),
    [
        ("GPHDT,359.99,T", None, None, -0.01),
        ("GPHDT,359.99", None, None, -0.01),
        ("HETHS,120.0,A", None, None, 120.0),
        ("HETHS,120.0,E", None, None, 120.0),
        ("PSXN,23,0.30,-0.97,298.57,0.13", 0.3, -0.97, -61.43),
        ("PASHR,085335.000,224.19,T,-01.26,+00.83,+00.00,0.101,0.113,0.267,1,0", -1.26, 0.83, -135.81),
        ("PASHR,085335.0,224.19,T,-01.26,+00.83,+00.00,0.101,0.113,0.267,1,0", -1.26, 0.83, -135.81),
        ("PASHR,085335.000,224.19,T,-01.26,+00.83,+00.00,0.101,0.113,0.267,0,0", -1.26, 0.83, None),
        ("PASHR,085335.000,0.00,T,0.30,0.20,0.00,0.000,0.000,99.999,1,0", 0.3, 0.2, None),
        ("PASHR,085335.000,224.19,T,-01.26,+00.83,+00.00,0.101,0.113,,,", -1.26, 0.83, -135.81),
        ("PASHR,HPR,130533.620,226.93,-1.16,-0.22,0.0004,0.0002,1,1,0,2.0", -0.22, -1.16, -133.07),
        ("PSAT,HPR,102436.00,92.40,1.20,-0.80,N", -0.8, 1.2, 92.4),
        ("PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,3,1.4,16", None, -0.0806, 52.1531),
        ("PTNL,AVR,212405.20,-52.1531,Yaw,-0.0806,Tilt,,,12.575,3,1.4,16", None, -0.0806, -52.1531),
        ("PSTI,036,054314.000,030521,191.69,-16.35,0.00,R", None, -16.35, -168.31),
        ("PSTI,036,054314.000,030521,191.69,-16.35,2.50,F", 2.5, -16.35, -168.31),
        ("PTNTHTM,61.2,N,-2.4,N,10.7,O,59.1,3844", 10.7, -2.4, 61.2),
        ("PTNTHTM,,N,-2.4,N,10.7,N,59.1,3844", 10.7, -2.4, None),
        ("PTNTHTM,14223,N,169,N,-43,N,13641,2454", -43 * 360 / 65536, 169 * 360 / 65536, 14223 * 360 / 65536),
        ("PTNTHTM,61.2,C,-2.4,N,10.7,P,59.1,3844", None, -2.4, None),
        ("PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,2,1.4,16", None, -0.0806, 52.1531),
        ("PTNL,AVR,212604.30,+52.1800,Yaw,,,-0.0807,Roll,12.579,3,1.4,16", -0.0807, None, 52.18),
        ("IIXDR,C,10.6,C,AIRTEMP,A,0.5,D,HEEL,A,-1.3,D,TRIM,P,1.0,B,BARO,A,-4,D,RUDDER", 0.5, -1.3, None),
    ],
)
def test_attitude_sentences(body: str, phi_deg: float | None, theta_deg: float | None, psi_deg: float | None) -> None:
    (angles,) = measure(body)
    assert isinstance(angles, EulerAngles)
    for value, expected in ((angles.phi_rad, phi_deg), (angles.theta_rad, theta_deg), (angles.psi_rad, psi_deg)):
        assert (value is None) == (expected is None)
        if value is not None and expected is not None:
            assert math.degrees(value) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    "body",
    [
        "GPHDT,,T",
        "GPHDT,12.3,M",
        "HETHS,120.0,V",
        "HETHS,120.0,S",
        "GPROT,3.0,V",
        "GPROT,,A",
        "PSTI,036,054314.000,030521,191.69,-16.35,0.00,N",
        "PSTI,030,054314.000,A,2447.0895508,N,12100.5234656,E,94.615,0.00,-0.01,0.04,030521,A,0.999,3.724",
        "PSTI",
        "PTNTHTM,,,,,,,,",
        "PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,0,1.4,16",
        "PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,1,1.4,16",
        "PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,4,1.4,16",
        "PTNL,AVR,212405.20,+52.1531,Yaw,-0.0806,Tilt,,,12.575,,1.4,16",
        "PSXN,20,0,0,0,0",
        "PASHR,ARR,1,3,12,160159.00,123.45",
        "PTNL,GGK,102939.00,051910,5000.97323841,N,00827.62010742,E,5,09,1.9,EHT150.790,M",
        "IIXDR,C,,C,AIRTEMP,A,,D,HEEL",
        "GPGSV,1,1,00",
        "PSAT,GBS,1,2",
        "PASHR",
        "PTNL",
        "PSXN",
        "PSAT",
    ],
)
def test_sentences_that_measure_nothing_yield_nothing(body: str) -> None:
    assert measure(body) == []


def test_magnetic_heading_deviation_and_variation() -> None:
    (angles,) = measure("HCHDG,98.3,2.0,E,12.6,W")
    assert math.degrees(angles.psi_magnetic_rad) == pytest.approx(100.3)
    assert math.degrees(angles.variation_rad) == pytest.approx(-12.6)
    assert angles.psi_rad is None


def test_variation_of_rmc_serves_a_magnetic_compass_without() -> None:
    found = measure("GPRMC,102436.00,A,4111.1007380,N,00842.3729240,W,2.90,92.40,150622,1.9,W,D", "HCHDM,100.0,M")
    angles = next(item for item in found if isinstance(item, EulerAngles))
    assert math.degrees(angles.variation_rad) == pytest.approx(-1.9)


def test_rate_of_turn() -> None:
    (rate,) = measure("GPROT,-30.0,A")
    assert isinstance(rate, AngularVelocity)
    assert rate.r_radps == pytest.approx(math.radians(-0.5))


@pytest.mark.parametrize(
    ("body", "value_m"),
    [
        ("SDDBT,7.7,f,2.3,M,1.3,F", 2.3),
        ("SDDBT,7.7,f,,M,,F", 7.7 * 0.3048),
        ("SDDBT,,f,,M,1.3,F", 1.3 * 1.8288),
        ("SDDBT,,f,,M,,F", None),
        ("SDDPT,5.3,0.4,100", 5.3),
        ("SDDPT,5.3,0.4", 5.3),
        ("SDDPT,,0.4,", None),
        ("SDDBS,,f,5.3,M,,F", 5.1),
        ("SDDBS,,f,,M,2.0,F", 2 * 1.8288 - 0.2),
        ("SDDBK,,f,5.3,M,,F", 5.45),
        ("SDDBK,,f,0.00,M,,F", 0.0),
        ("SDDBS,,f,0.00,M,,F", 0.0),
    ],
)
def test_depth_sentences(body: str, value_m: float | None) -> None:
    (distance,) = measure(body)
    assert isinstance(distance, Distance)
    assert distance.value_m == (None if value_m is None else pytest.approx(value_m))


def test_the_offset_of_dpt_is_carried_not_added() -> None:
    (distance,) = measure("SDDPT,5.3,-0.4,100")
    assert (distance.value_m, distance.offset_m, distance.range_max_m) == (5.3, -0.4, 100.0)


def test_one_depth_source_at_a_time() -> None:
    found = measure("SDDPT,5.3,0.4", "SDDBT,,f,5.4,M,,F", "SDDPT,5.3,0.4", "SDDBS,,f,9.9,M,,F", "SDDBT,,f,5.5,M,,F")
    estimator = Estimator(EstimatorConfig())
    assert [item.value_m for item in found if estimator.update(item)] == [5.3, 5.4, 5.5]


GOOD = ["102436.00", "4111.1007380", "N", "00842.3729240", "W", "4", "10", "0.9", "2.10", "M", "52.30", "M", "", ""]


@pytest.mark.parametrize(
    ("index", "value"),
    [
        (0, "242436.00"),
        (0, "106036.00"),
        (0, "102461.00"),
        (0, "1024"),
        (0, "102436,5"),
        (0, "10:24:36"),
        (1, "9001.0"),
        (1, "4160.0000"),
        (1, "41"),
        (1, "-4111.1"),
        (1, "4111.1e1"),
        (1, "4111.1.1"),
        (2, "X"),
        (2, ""),
        (3, "18100.0"),
        (4, "N"),
        (5, "10"),
        (5, "A"),
        (5, "-1"),
        (6, "300"),
        (7, "nan"),
        (7, "-1"),
        (8, "inf"),
        (8, "1_0"),
        (10, "99999"),
    ],
)
def test_row_58_a_sentence_with_an_impossible_field_is_refused_whole(index: int, value: str) -> None:
    fields = list(GOOD)
    fields[index] = value
    reader = NmeaReader(OLD)
    assert reader.receive(frame("GPGGA," + ",".join(fields)), 0) == []
    assert reader.poll(10_000_000) == []
    assert reader.counters["malformed"] == 1


@pytest.mark.parametrize(
    "body",
    [
        "GPHDT,360.01,T",
        "GPHDT,999,T",
        "GPHDT,-1,T",
        "GPROT,99999,A",
        "GPRMC,102436.00,A,4111.1,N,00842.3,W,5000,92.40,150622,,,A",
        "GPRMC,102436.00,A,4111.1,N,00842.3,W,1,400,150622,,,A",
        "GPRMC,102436.00,A,4111.1,N,00842.3,W,1,40,310622,,,A",
        "GPRMC,102436.00,A,4111.1,N,00842.3,W,1,40,2206-1,,,A",
        "GPRMC,102436.00,A,4111.1,N,00842.3,W,1,40,150622,3,X,A",
        "GPVTG,92.4,X,,M,2.90,N,,K,A",
        "GPZDA,102436.00,32,01,2022,00,00",
        "GNGNS,102436.00,4111.1,N,00842.3,W,Q,10,0.9,2.10,52.30,,",
        "SDDPT,-1,0",
        "SDDPT,99999,0",
        "SDDBT,x,f,1,M,1,F".replace("1,M", ",M"),
        "PSXN,23,x,1,2,3",
    ],
)
def test_row_58_impossible_values_of_other_sentences(body: str) -> None:
    with pytest.raises(BadFieldError):
        parse(body)


def test_heading_360_is_north() -> None:
    (angles,) = measure("GPHDT,360.0,T")
    assert angles.psi_rad == 0.0


@pytest.mark.parametrize("satellites", ["99", "12", ""])
def test_row_58_99_satellites_are_no_reason_to_refuse(satellites: str) -> None:
    fix = fix_of(f"GPGGA,102436.00,4111.1007380,N,00842.3729240,W,4,{satellites},0.9,2.10,M,52.30,M,,")
    assert fix.has_position


def test_an_odd_plotters_two_digit_year() -> None:
    part = parse("GPZDA,195940,16,04,14,-02,00")
    assert part.day == day_number(2014, 4, 16)


@pytest.mark.parametrize(
    ("text", "microseconds"),
    [
        ("000000", 0),
        ("235959.999999", 86_399_999_999),
        ("235960.00", 86_400_000_000),
        ("102436.5", 37_476_500_000),
        ("", None),
    ],
)
def test_times_of_day(text: str, microseconds: int | None) -> None:
    assert time_of_day_us(text) == microseconds


def test_days_agree_with_the_calendar() -> None:
    assert day_number(1970, 1, 1) == 0
    assert day_number(2000, 2, 29) == 11_016
    assert day_number(2026, 1, 1) == 20_454
    with pytest.raises(BadFieldError):
        day_number(2023, 2, 29)
    with pytest.raises(BadFieldError):
        day_number(1900, 2, 29)


def test_coordinates_keep_every_digit() -> None:
    value = coordinate_rad("17959.9999999", "W", "E", "W", 180)
    assert math.degrees(value) == pytest.approx(-(179 + 59.9999999 / 60), abs=1e-13)
    assert coordinate_rad("18000.0", "E", "E", "W", 180) == pytest.approx(math.pi)
    assert coordinate_rad("0000.0", "S", "N", "S", 90) == 0.0
