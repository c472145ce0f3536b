"""Other vessels as people at the boat see them: on a terminal, on the page, and in what the page is sent."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from companion.commands.status import panel
from companion.commands.status.panel import line
from companion.status.picture import dumps, from_fields, picture_of
from companion.web.live import page_fields
from mavlink_bridge.language.snapshot import Outlook
from mavlink_bridge.language.traffic import Danger, Role, TrafficPicture, VesselKind
from mavlink_bridge.radio.codec.threat import threat_of
from sitl.traffic.target import VesselText
from sitl.traffic.transmitter import AisText
from tests.traffic_rig import Sea
from tests.unit.test_status import snapshot
from tests.unit.test_traffic_mavlink import EXAMPLE

RISK = replace(
    EXAMPLE, danger=Danger.RISK, role=Role.GIVE_WAY, cpa_m=20.0, tcpa_s=95.0, range_m=420.0, bearing_rad=math.pi / 4
)
ANCHORED = replace(EXAMPLE, mmsi=1, name="AT ANCHOR", at_rest=True, sog_mps=0.1, range_m=300.0, bearing_rad=math.pi)
FAR = replace(EXAMPLE, mmsi=2, name="FAR", range_m=9_000.0)
SENTENCE = "MV EXAMPLE crossing from starboard, CPA 20 m in 95 s; we give way"


def picture(*vessels):
    return picture_of(snapshot(t_us=10_000_000, traffic=TrafficPicture(vessels, heard=True)))


def test_risk_is_told_on_a_terminal_with_what_we_owe() -> None:
    shown = {each.label: (each.text, each.colour) for each in panel(picture(RISK, ANCHORED), 120, 24)}
    assert shown["Traffic"] == (f"{SENTENCE}; now 420 m north-east", "yellow")
    assert f"traffic: {SENTENCE}" in line(picture(RISK))


def test_without_risk_the_nearest_is_named_and_without_vessels_nothing() -> None:
    shown = {each.label: each.text for each in panel(picture(EXAMPLE, ANCHORED, FAR), 120, 24)}
    assert shown["Traffic"] == "3 known, nearest AT ANCHOR, 300 m south"
    assert {each.label: each.text for each in panel(picture(FAR), 120, 24)}["Traffic"] == "1 known, none near"
    assert "Traffic" not in {each.label for each in panel(picture(), 120, 24)}


def test_the_page_is_sent_place_course_and_duty() -> None:
    told = json.loads(dumps(picture(RISK, ANCHORED, FAR)))
    first, second = page_fields(told)["others"]
    assert first["sentence"] == SENTENCE
    assert (first["danger"], first["course_deg"], first["range_m"], first["bearing_deg"]) == ("risk", 270.0, 420, 45.0)
    assert first["at"] == pytest.approx([41.1853, -8.7070])
    assert first["speed_mps"] == pytest.approx(6.3)
    assert (second["at_rest"], second["speed_mps"], "course_deg" in second) == (True, 0.0, False)
    assert told["others_known"] == 3
    assert from_fields(told).others[1].title == "AT ANCHOR"


def test_a_crowd_costs_the_page_about_a_kilobyte() -> None:
    crowd = [replace(EXAMPLE, mmsi=number, range_m=100.0 + number) for number in range(200)]
    sent = page_fields(json.loads(dumps(picture(RISK, *crowd))))["others"]
    assert len(json.dumps(sent, separators=(",", ":"))) < 1_700
    assert sent[0]["danger"] == "risk"


def test_a_person_in_the_water_is_named_as_such() -> None:
    person = replace(ANCHORED, mmsi=972_000_001, name="", kind=VesselKind.PERSON)
    (sent,) = page_fields(json.loads(dumps(picture(person))))["others"]
    assert (sent["title"], sent["kind"]) == ("MOB 972000001", "person in the water")


PERSON = replace(ANCHORED, mmsi=972_263_001, name="", kind=VesselKind.PERSON, range_m=60.0, bearing_rad=0.0)
HEADLINE = "PERSON IN THE WATER 60 m north, MOB beacon 972263001"


def test_a_person_stands_before_fourteen_vessels_with_risk_and_keeps_a_place_of_his_own() -> None:
    crowd = [replace(RISK, mmsi=number, range_m=30.0 + number) for number in range(14)]
    seen = picture(PERSON, *crowd)
    sent = page_fields(json.loads(dumps(seen)))["others"]
    assert (sent[0]["sentence"], sent[0]["range_m"], len(sent)) == (HEADLINE, 60, 9)
    assert "at" in sent[0]
    shown = next(each for each in panel(seen, 120, 24) if each.label == "Traffic")
    assert (shown.text, shown.colour) == (HEADLINE, "red")
    assert f"traffic: {HEADLINE}" in line(seen)


def test_the_watch_puts_persons_before_ships_with_risk() -> None:
    beacon = VesselText(mmsi=972_263_001, north_m=60.0, status=14)
    ships = [VesselText(north_m=300.0, east_m=20.0 * n, course_deg=180.0, speed_mps=4.0, length_m=60) for n in range(3)]
    sea = Sea([*ships, beacon], ais=AisText(loss_share=0.0))
    sea.run(20)
    assert len(sea.picture.threats) == 3
    assert sea.picture.vessels[0].kind is VesselKind.PERSON
    assert threat_of(sea.picture).number == sea.picture.threats[0].mmsi & 0xFF


def test_the_failsafes_line_says_where_the_person_is() -> None:
    warned = Outlook("person_in_water", "a person's beacon sends", "warning")
    seen = picture_of(snapshot(outlook=(warned,), traffic=TrafficPicture((PERSON,), heard=True)))
    assert seen.failsafes[0].sentence == "a person's beacon sends, 60 m north: warning"
    assert picture_of(snapshot(outlook=(warned,))).failsafes[0].sentence == "a person's beacon sends: warning"


def test_what_is_told_of_a_vessel_that_has_fallen_silent_says_since_when() -> None:
    silent = picture_of(snapshot(t_us=107_000_000, traffic=TrafficPicture((RISK,), heard=True)))
    shown = {each.label: each.text for each in panel(silent, 140, 24)}
    assert shown["Traffic"] == f"{SENTENCE}; now 420 m north-east; heard 100 s ago"
