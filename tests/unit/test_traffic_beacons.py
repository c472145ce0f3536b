"""Persons' beacons: told at once and for what they are, and never given up for ships."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from companion.core.traffic.table import BEACONS_MAX, TRACKS_MAX
from companion.core.traffic.throttle import TEXTS_MAX
from companion.status.others import person_of
from mavlink_bridge.language.traffic import VesselKind
from sitl.traffic import encoder
from tests.traffic_rig import Sea


def position(mmsi: int, sea: Sea, north_m: float) -> bytes:
    """A report of a vessel at rest."""
    report = encoder.StationReport(mmsi, *sea.frame.to_geodetic(north_m, 0.0), int(sea.time_s) % 60)
    return encoder.sentences(report.class_a(), 0)


def beacon(sea: Sea, mmsi: int, north_m: float, status: int, *, placed: bool = True) -> bytes:
    """A report of a distress beacon; without a fix it sends 91 and 181 degrees."""
    place = sea.frame.to_geodetic(north_m, 0.0) if placed else (math.radians(91.0), math.radians(181.0))
    report = encoder.StationReport(mmsi, *place, int(sea.time_s) % 60 if placed else 63)
    report.status = status
    return encoder.sentences(report.class_a(), 0)


def told(sea: Sea) -> list[str]:
    """What was said of beacons."""
    return [text for _, _, text in sea.texts if " beacon " in text]


def test_a_beacon_that_was_tested_is_a_person_when_it_is_used_in_earnest() -> None:
    """Its text comes each four minutes at best; the switch's own status is in each report."""
    sea = Sea(own_mps=0.0)
    sea.hear(beacon(sea, 972111222, 300.0, 15))
    sea.hear(encoder.sentences(encoder.safety(972111222, "MOB TEST"), 0))
    sea.run(60)
    assert len(sea.texts) == 1
    sea.hear(beacon(sea, 972111222, 300.0, 14))
    sea.run(60)
    sea.hear(beacon(sea, 972111222, 300.0, 14))
    sea.run(3)
    assert sea.picture.person
    assert [(severity.name, text) for _, severity, text in sea.texts] == [
        ("NOTICE", "MOB beacon 972111222 in test: 300 m north"),
        ("ALERT", "MOB beacon 972111222: 300 m north"),
    ]


def test_a_beacon_whose_status_says_test_is_one_whatever_its_text_said_before() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(encoder.sentences(encoder.safety(970111222, "SART ACTIVE"), 0))
    sea.hear(beacon(sea, 970111222, 300.0, 14))
    sea.run(5)
    assert sea.picture.person
    sea.hear(beacon(sea, 970111222, 300.0, 15))
    sea.run(5)
    assert not sea.picture.person
    assert told(sea)[-1] == "SART beacon 970111222 in test: 300 m north"


def test_a_beacon_whose_status_says_nothing_is_what_its_text_says() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(encoder.sentences(encoder.safety(970111222, "SART ACTIVE"), 0))
    sea.hear(beacon(sea, 970111222, 300.0, 0))
    sea.run(5)
    assert sea.picture.person


def test_a_person_whose_beacon_has_no_fix_yet_is_told_and_again_with_the_place() -> None:
    sea = Sea(own_mps=0.0)
    for _ in range(10):
        sea.hear(beacon(sea, 972111222, 0.0, 14, placed=False))
        sea.run(6)
    assert sea.picture.person
    assert sea.traffic.flags.person_in_water
    assert person_of(sea.picture) == "position unknown"
    sea.hear(beacon(sea, 972111222, 400.0, 14))
    sea.run(3)
    assert [(severity.name, text) for _, severity, text in sea.texts] == [
        ("ALERT", "MOB beacon 972111222: position unknown"),
        ("ALERT", "MOB beacon 972111222: 400 m north"),
    ]
    (person,) = sea.picture.vessels
    assert person.kind is VesselKind.PERSON


def test_where_a_beacon_was_tested_is_not_where_it_is_used() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(beacon(sea, 972111222, 30.0, 15))
    sea.run(30)
    sea.hear(beacon(sea, 972111222, 0.0, 14, placed=False))
    sea.run(30)
    assert sea.picture.person
    assert not sea.picture.vessels
    assert sea.texts[-1][2] == "MOB beacon 972111222: position unknown"
    assert len(sea.texts) == 2


@pytest.mark.parametrize("silent_h", [2.0, 7.0], ids=["still shown", "forgotten"])
def test_a_beacon_that_is_used_again_after_hours_is_told_again(silent_h: float) -> None:
    """The same crew's beacon, the next man: the page alone had shown him."""
    sea = Sea(own_mps=0.0)
    sea.hear(beacon(sea, 972111222, 300.0, 14))
    sea.run(5)
    sea.dt_s = 30.0
    sea.run(silent_h * 3600.0)
    sea.dt_s = 0.5
    for _ in range(5):
        sea.hear(beacon(sea, 972111222, 900.0, 14))
        sea.run(10)
    assert told(sea) == ["MOB beacon 972111222: 300 m north", "MOB beacon 972111222: 900 m north"]


def test_a_beacon_that_waves_hide_for_minutes_is_told_once() -> None:
    sea = Sea(own_mps=0.0)
    for _ in range(4):
        sea.hear(beacon(sea, 972111222, 300.0, 14))
        sea.run(600)
    assert len(told(sea)) == 1


def test_a_person_is_taken_and_kept_however_many_ships_are_heard() -> None:
    """All of them nearer, and they come nearer still."""
    sea = Sea(own_mps=0.0, dt_s=0.05)

    def flood(first: int) -> None:
        for number in range(first, first + 300):
            sea.hear(position(244000000 + number, sea, 1500.0 + number))
            sea.step()

    flood(0)
    sea.hear(beacon(sea, 972111222, 2500.0, 14))
    sea.run(2)
    assert sea.picture.person
    flood(1000)
    sea.run(2)
    assert sea.picture.person
    assert sea.traffic.table.count == TRACKS_MAX


def comes(sea: Sea, mmsi: int) -> bytes:
    """A ship on her way to us, 400 m off at first, at 5 m/s."""
    report = encoder.StationReport(mmsi, *sea.frame.to_geodetic(400.0 - 5.0 * sea.time_s, 0.0), int(sea.time_s) % 60)
    report.sog_mps, report.cog_rad = 5.0, math.pi
    return encoder.sentences(report.class_a(), 0)


@pytest.mark.parametrize("off_m", [9000.0, 100.0])
@pytest.mark.parametrize("first", ["the ship", "the beacons"])
def test_forged_beacons_push_out_no_ship_that_comes_at_us(first: str, off_m: float) -> None:
    sea = Sea(own_mps=0.0, dt_s=0.1)
    if first == "the ship":
        sea.hear(comes(sea, 235777777))
        sea.run(2)
    for number in range(300):
        sea.hear(beacon(sea, 972000000 + number, off_m, 14))
        sea.step()
    for _ in range(5):
        sea.hear(comes(sea, 235777777))
        sea.run(2)
    assert 235777777 in {vessel.mmsi for vessel in sea.picture.threats}
    assert sum(vessel.kind is VesselKind.PERSON for vessel in sea.picture.vessels) == BEACONS_MAX


def test_of_too_many_beacons_the_nearest_are_kept() -> None:
    sea = Sea(own_mps=0.0, dt_s=0.1)
    for number in range(100):
        sea.hear(beacon(sea, 972000000 + number, 5000.0 - 10.0 * number, 14))
        sea.step()
    sea.run(2)
    assert {vessel.mmsi for vessel in sea.picture.vessels} == set(range(972000100 - BEACONS_MAX, 972000100))


def test_a_ship_that_comes_at_us_is_kept_though_many_lie_nearer() -> None:
    sea = Sea(own_mps=0.0, dt_s=0.05)
    sea.hear(comes(sea, 235777777))
    sea.run(2)
    for number in range(300):
        sea.hear(position(244000000 + number, sea, 200.0))
        sea.step()
    assert 235777777 in {vessel.mmsi for vessel in sea.picture.threats}


def test_a_flood_of_beacons_is_told_in_few_words_and_all_that_are_kept_in_the_end() -> None:
    sea = Sea(own_mps=0.0, dt_s=0.1)
    for number in range(100):
        sea.hear(beacon(sea, 972000000 + number, 9000.0 + 10.0 * number, 14))
        sea.step()
    sea.run(40)
    times_s = [at_s for at_s, _, text in sea.texts if " beacon " in text]
    assert len(times_s) == BEACONS_MAX
    assert all(later - sooner >= 9.9 for sooner, later in zip(times_s, times_s[TEXTS_MAX:], strict=False))


def test_beacons_in_test_keep_no_person_from_being_told_at_once() -> None:
    sea = Sea(own_mps=0.0, dt_s=0.1)
    for number in range(30):
        sea.hear(beacon(sea, 970000000 + number, 900.0, 15))
    sea.run(2)
    sea.hear(beacon(sea, 972111222, 300.0, 14))
    sea.run(1)
    assert told(sea)[-1] == "MOB beacon 972111222: 300 m north"


def test_a_beacon_that_flaps_between_test_and_earnest_is_told_of_both_once_in_a_minute() -> None:
    sea = Sea(own_mps=0.0)
    for number in range(60):
        sea.hear(beacon(sea, 972111222, 300.0, 14 + number % 2))
        sea.run(2)
    alerts_s = sea.said("beacon 972111222: 300 m north")
    assert len(told(sea)) <= 6
    assert all(later - sooner >= 60.0 for sooner, later in pairwise(alerts_s))


def test_who_is_near_stays_though_she_goes_away_and_ships_far_off_do_not() -> None:
    """A great port: more ships at their berths than there is room for, and a boat close astern that falls behind."""
    sea = Sea(own_mps=1.5, dt_s=0.1)
    sea.hear(position(235777777, sea, -300.0))
    sea.run(5)
    for number in range(400):
        sea.hear(position(244000000 + number, sea, 5000.0 + 10.0 * number))
        sea.step()
    assert 235777777 in {vessel.mmsi for vessel in sea.picture.vessels}
    assert sea.traffic.table.count == TRACKS_MAX
