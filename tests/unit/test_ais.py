"""What AIS sentences say, and what must never come out of them."""

from __future__ import annotations

import math

import pytest

from companion.core.ais import AidToNavigation, PositionReport, SafetyText, StaticReport
from companion.core.ais.decode import turn_of
from companion.core.ais.identity import MmsiKind, station_of
from companion.core.ais.reports import FixState, StationClass
from mavlink_bridge.language.traffic import Sides
from mavlink_bridge.language.units import KNOT_MPS
from tests.property.test_ais_fuzz import Ear, line


def only(body: str):
    (received,) = Ear().hear(line(body))
    return received.report


def test_a_class_a_report() -> None:
    report = only("AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000,0")
    assert isinstance(report, PositionReport)
    assert report.mmsi == 244123456
    assert report.sent is StationClass.CLASS_A
    assert math.degrees(report.lat_rad) == pytest.approx(41.1852, abs=1e-6)
    assert math.degrees(report.lon_rad) == pytest.approx(-8.7060, abs=1e-6)
    assert report.sog_mps == pytest.approx(12.3 * KNOT_MPS)
    assert math.degrees(report.cog_rad) == pytest.approx(271.4)
    assert math.degrees(report.heading_rad) == pytest.approx(270.0)
    assert (report.second, report.fix, report.status, report.accurate) == (34, FixState.GOOD, 0, True)
    assert (report.turn_radps, report.turn_sign) == (0.0, 0)


def test_everything_not_available_is_none() -> None:
    report = only("AIVDM,1,1,,A,13`l7@?P?w<tSF0l4Q@>4?wqP000,0")
    for name in ("lat_rad", "lon_rad", "sog_mps", "cog_rad", "heading_rad", "second", "turn_radps"):
        assert getattr(report, name) is None, name
    assert report.status == 15
    assert not report.has_position


def test_faster_than_the_field_holds_and_turning_without_a_value() -> None:
    report = only("AIVDM,1,1,,A,13`l7@7OwvOH9JPGT?l>3h1oP000,0")
    assert report.sog_is_least
    assert report.sog_mps == pytest.approx(102.2 * KNOT_MPS)
    assert (report.turn_radps, report.turn_sign) == (None, 1)
    assert (report.heading_rad, report.second) == (0.0, 59)


@pytest.mark.parametrize(("raw", "deg_min"), [(10, 4.46), (126, 708.7), (-10, -4.46), (0, 0.0)])
def test_a_rate_of_turn(raw: int, deg_min: float) -> None:
    radps, sign = turn_of(raw)
    assert sign == 0
    assert math.degrees(radps) * 60.0 == pytest.approx(deg_min, abs=0.05)


def test_class_b_with_its_static_parts() -> None:
    report = only("AIVDM,1,1,,A,B3rl@;h0<on2AN5q4Nhr;wV40000,0")
    assert (report.sent, report.mmsi, report.carrier_sense) == (StationClass.CLASS_B, 263000111, True)
    assert report.heading_rad is None
    part_a = only("AIVDM,1,1,,A,H3rl@;iHDhDU8t00000000000000,0")
    assert isinstance(part_a, StaticReport)
    assert (part_a.name, part_a.callsign, part_a.ship_type) == ("VELEIRO", None, None)
    part_b = only("AIVDM,1,1,,A,H3rl@;lT00000003CHIi000h5210,0")
    assert (part_b.name, part_b.callsign, part_b.ship_type) == (None, "CSXY1", 36)
    assert part_b.dimensions == Sides(6, 5, 2, 1)


def test_class_b_extended_is_a_position_and_a_name() -> None:
    position, static = Ear().hear(line("AIVDM,1,1,,A,C3rl@WP0?Wn2jh5q0r06T60PP:V628NT000000000000?0P21100,0"))
    assert position.report.sog_mps == pytest.approx(6.2 * KNOT_MPS)
    assert (static.report.name, static.report.ship_type) == ("PESCADOR", 30)
    assert static.report.dimensions == Sides(8, 4, 2, 2)


def test_a_virtual_buoy_and_an_aircraft_in_whole_knots() -> None:
    buoy = only("AIVDM,1,1,,A,E>jap6N62Td7Rah;P0000000000?d2b0;j1l000000N01000000000000000,4")
    assert isinstance(buoy, AidToNavigation)
    assert (buoy.name, buoy.aid_type, buoy.virtual, buoy.off_position) == ("LEIXOES W", 28, True, None)
    aircraft = only("AIVDM,1,1,,A,91b6u6@UQOOH;;0GTjP721h00000,0")
    assert (aircraft.sent, aircraft.altitude_m) == (StationClass.SAR_AIRCRAFT, 150)
    assert aircraft.sog_mps == pytest.approx(95 * KNOT_MPS)


def test_long_range_is_known_as_such() -> None:
    report = only("AIVDM,1,1,,A,K3`l7@8OcW3121Rl,0")
    assert (report.sent, report.status) == (StationClass.LONG_RANGE, 1)
    assert report.sog_mps == pytest.approx(3 * KNOT_MPS)


# ---- what must give nothing


def test_a_report_that_was_cut_gives_no_position() -> None:
    """The sum is right; another decoder makes latitude 11.9 of it instead of 47.6."""
    assert Ear().hear(line("AIVDM,1,1,,B,177KQJ5000G?tO`K>RA,0")) == []


PART_1 = "AIVDM,2,1,3,A,53`kBd@0000044444404i0P40000000000000016<Pj::0000<TSm51DQ0CH,0"
PART_2 = "AIVDM,2,2,3,A,PESp0PPPPPP,2"


def test_parts_of_two_ships_are_never_one() -> None:
    ear = Ear()
    assert ear.hear(line(PART_1), 0) == []
    assert ear.hear(line(PART_2), 60_000_000) == []
    assert ear.hear(line(PART_1), 61_000_000) == []
    assert len(ear.hear(line(PART_2), 61_100_000)) == 1


@pytest.mark.parametrize(
    "other", [PART_2.replace(",A,", ",B,"), PART_2.replace(",3,", ",4,"), PART_2.replace("VDM", "VDO")]
)
def test_parts_of_other_channels_sets_and_stations_do_not_fit(other: str) -> None:
    ear = Ear()
    assert ear.hear(line(PART_1) + line(other)) == []


def test_a_wrong_sum_an_illegal_character_and_impossible_fields_give_nothing() -> None:
    good = line("AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000,0")
    assert Ear().hear(good.replace(b"*55", b"*56")) == []
    for body in (
        "AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5PX00,0",
        "AIVDM,1,2,,A,13`l7@001swH9JPGT?l:V`M5P000,0",
        "AIVDM,0,1,,A,13`l7@001swH9JPGT?l:V`M5P000,0",
        "AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000,7",
        "AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000",
        "AIVDM,1,1,,A,,0",
    ):
        ear = Ear()
        assert ear.hear(line(body)) == []
        assert ear.receiver.damaged == 1


def test_a_tag_block_a_sentence_between_and_a_further_field_are_all_right() -> None:
    position = b"\\s:rORBCOMM000,c:1354204860*7A\\" + line("AIVDM,1,1,1,,13`l7@001swH9JPGT?l:V`M5P000,0,0")
    assert len(Ear().hear(position)) == 1
    between = b"$GPHDT,92.40,T*07\r\n"
    assert len(Ear().hear(line(PART_1) + between + line(PART_2))) == 1


@pytest.mark.parametrize(
    ("mmsi", "station"),
    [
        (244123456, MmsiKind.SHIP),
        (2442000, MmsiKind.COAST),
        (24420001, MmsiKind.GROUP),
        (111263001, MmsiKind.SAR_AIRCRAFT),
        (992639001, MmsiKind.AID),
        (982441234, MmsiKind.CRAFT),
        (970263001, MmsiKind.SART),
        (972263001, MmsiKind.MAN_OVERBOARD),
        (974263001, MmsiKind.EPIRB),
        (0, MmsiKind.UNKNOWN),
        (123456789, MmsiKind.UNKNOWN),
        (111111111, MmsiKind.UNKNOWN),
        (12345678, MmsiKind.UNKNOWN),
    ],
)
def test_who_a_number_is(mmsi: int, station: MmsiKind) -> None:
    assert station_of(mmsi) is station


def test_a_safety_text() -> None:
    report = only("AIVDM,1,1,,A,>5?Per18=HB1U:1@E=B0m<L,2")
    assert isinstance(report, SafetyText)
    assert report.text == "RCVD YR TEST MSG"
