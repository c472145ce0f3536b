"""The world of other vessels: what they send as a foreign decoder reads it, when, the sets, and what the boat tells over them."""

from __future__ import annotations

import math
import random
import re

import pytest
from pyais.queue import NMEAQueue

from mavlink_bridge.language.geodesy import LocalFrame
from sitl.traffic import encoder
from sitl.traffic.fleet import hull_distance_m
from sitl.traffic.many import failures, judge_all, judge_one, tally_of, worst_of
from sitl.traffic.pictures import make_page
from sitl.traffic.score import true_role
from sitl.traffic.sets import Encounter, by_name, dnv, imazu, random_set
from sitl.traffic.target import ManoeuvreText, Target, VesselText
from sitl.traffic.transmitter import AisText, Transmitter, interval_s
from sitl.traffic.verdict import verdict_of
from sitl.traffic.watch import sail

KNOT = 0.514444


def read(data: bytes) -> list[dict]:
    """What pyais makes of sentences."""
    queue, found = NMEAQueue(), []
    for line in data.splitlines():
        queue.put_line(line)
        message = queue.get_or_none()
        if message is not None:
            assert message.is_valid
            found.append(message.decode().asdict(enum_as_int=True))
    return found


def test_a_position_is_read_by_a_foreign_decoder_as_it_was_meant() -> None:
    rng = random.Random(1)
    for _ in range(50):
        report = encoder.StationReport(
            rng.randrange(201_000_000, 775_999_999), rng.uniform(-1.5, 1.5), rng.uniform(-3.1, 3.1), rng.randrange(60)
        )
        report.sog_mps, report.cog_rad = rng.uniform(0, 40), rng.uniform(-3.1, 3.1)
        report.heading_rad = rng.uniform(0, 6.2)
        for fields, kind in ((report.class_a(), 1), (report.class_b(), 18)):
            (found,) = read(encoder.sentences(fields, 0))
            assert (found["msg_type"], found["mmsi"], found["second"]) == (kind, report.mmsi, report.second)
            assert found["lat"] == pytest.approx(math.degrees(report.lat_rad), abs=2e-6)
            assert found["lon"] == pytest.approx(math.degrees(report.lon_rad), abs=2e-6)
            assert found["speed"] == pytest.approx(report.sog_mps / KNOT, abs=0.06)
            assert (
                found["course"] == pytest.approx(math.degrees(report.cog_rad) % 360, abs=0.06) or found["course"] == 0.0
            )


def test_names_and_sizes_are_read_by_a_foreign_decoder() -> None:
    (a,) = read(encoder.sentences(encoder.static_a(244000001, "MV EXAMPLE", 70, 150.0, 25.0), 3))
    assert (
        a["msg_type"],
        a["shipname"],
        a["ship_type"],
        a["to_bow"] + a["to_stern"],
        a["to_port"] + a["to_starboard"],
    ) == (
        5,
        "MV EXAMPLE",
        70,
        150,
        25,
    )
    b1, b2 = read(
        b"".join(encoder.sentences(part, 0) for part in encoder.static_b(265000001, "VELEIRO", 36, 11.0, 3.0))
    )
    assert (b1["shipname"], b2["ship_type"], b2["to_bow"] + b2["to_stern"]) == ("VELEIRO", 36, 11)
    (text,) = read(encoder.sentences(encoder.safety(970263001, "SART TEST"), 0))
    assert text["text"].rstrip("@ ") == "SART TEST"


@pytest.mark.parametrize(
    ("ais", "knots", "turning", "moored", "seconds"),
    [
        ("A", 0.0, False, True, 180.0),
        ("A", 10.0, False, False, 10.0),
        ("A", 10.0, True, False, 10 / 3),
        ("A", 20.0, False, False, 6.0),
        ("A", 20.0, True, False, 2.0),
        ("A", 30.0, False, False, 2.0),
        ("B", 1.0, False, False, 180.0),
        ("B", 10.0, False, False, 30.0),
    ],
)
def test_vessels_speak_as_often_as_the_standard_says(
    ais: str, knots: float, turning: bool, moored: bool, seconds: float
) -> None:
    assert interval_s(ais, knots * KNOT, turning=turning, moored=moored) == pytest.approx(seconds)


def test_what_is_received_is_late_incomplete_and_silent_as_configured() -> None:
    target = Target(VesselText(speed_mps=5.0, silent=({"from_s": 200, "to_s": 400},)), 0)
    air = Transmitter(target, LocalFrame(0.7, -0.1), AisText(loss_share=0.2, latency_s=2.0), random.Random(4))
    for tick in range(4000):
        target.step(0.25)
        air.due(tick * 0.25, tick * 250_000)
    assert not [at_s for at_s in air.heard_s if 203.0 < at_s < 402.0]
    assert 0.7 < len(air.heard_s) / 80 < 0.9


def test_a_route_and_a_manoeuvre_are_sailed() -> None:
    routed = Target(VesselText(speed_mps=5.0, course_deg=90.0, route=((200.0, 0.0), (200.0, 300.0))), 0)
    turning = Target(VesselText(speed_mps=5.0, manoeuvres=(ManoeuvreText(at_s=10.0, turn_deg=90.0, speed_mps=2.0),)), 0)
    near_m = [math.inf, math.inf]
    for _ in range(480):
        routed.step(0.25)
        for number, point in enumerate(((200.0, 0.0), (200.0, 300.0))):
            near_m[number] = min(near_m[number], math.dist((routed.north_m, routed.east_m), point))
        turning.step(0.25)
    assert max(near_m) < 100.0
    assert math.degrees(turning.course_rad) == pytest.approx(90.0)
    assert turning.speed_mps == 2.0


def test_one_that_obeys_gives_way_and_one_that_does_not_sails_on() -> None:
    crossing = {
        "ais": "B",
        "north_m": 300.0,
        "east_m": -300.0,
        "course_deg": 90.0,
        "speed_mps": 1.5,
        "interval_s": 10.0,
    }
    meeting = Encounter("meeting", "meeting", 600.0, (VesselText(**crossing),))
    obeying = Encounter("obeying", "obeying", 600.0, (VesselText(**crossing, obeys=True),))
    assert sail(meeting).collision
    assert sail(obeying).least_m > 20.0


def test_the_hull_of_the_truth_is_a_stadium() -> None:
    ship = Target(VesselText(length_m=60.0, beam_m=10.0), 0)
    assert hull_distance_m(ship, 40.0, 0.0) == pytest.approx(10.0)
    assert hull_distance_m(ship, 0.0, 25.0) == pytest.approx(20.0)
    assert hull_distance_m(ship, 0.0, 0.0) == pytest.approx(-5.0)


@pytest.mark.parametrize(
    ("north_m", "east_m", "mps", "course_deg", "role", "grey"),
    [
        (600, 0, 5, 180, "head-on", False),
        (300, 300, 1.5, 270, "give way", False),
        (300, -300, 1.5, 90, "stand on", False),
        (-400, 0, 6, 0, "overtaken", False),
        (200, 0, 0.8, 0, "overtaking", False),
        (600, 0, 5, 190, "head-on", True),
        (-128, 274, 3, 330, "overtaken", True),
        (400, 10, 0, 0, "obstacle", False),
    ],
)
def test_the_judge_has_angles_of_its_own(north_m, east_m, mps, course_deg, role, grey) -> None:
    target = Target(VesselText(north_m=north_m, east_m=east_m, speed_mps=mps, course_deg=course_deg), 0)
    assert true_role(target, (0.0, 0.0), 0.0, 1.5) == (role, grey)


def test_imazus_vessels_all_meet_us(shared_data) -> None:
    table = (shared_data / "encounters" / "imazu22.csv").read_text().splitlines()[1:]
    ours = [(n, v) for n, encounter in enumerate(imazu(), 1) for v in encounter.vessels]
    assert len(ours) == len(table)
    for (number, vessel), row in zip(ours, table, strict=True):
        case, _, course, speed, north, east = map(float, row.split(","))
        assert (number, vessel.course_deg, vessel.speed_mps) == (case, course, pytest.approx(1.5 * speed))
        assert vessel.north_m - 450.0 == pytest.approx(450.0 * north, abs=1.0)
        assert vessel.east_m == pytest.approx(450.0 * east, abs=1.0)


def test_dnvs_situations_are_55_with_140_vessels(shared_data) -> None:
    for similar in (False, True):
        found = dnv(shared_data / "encounters" / "dnv55.csv", similar=similar)
        assert (len(found), sum(len(each.vessels) for each in found)) == (55, 140)


def test_a_random_encounter_is_the_same_by_its_seed_alone() -> None:
    many = list(random_set(20, 7))
    (again,) = random_set(1, 7, first=13)
    assert again == many[13]
    assert all(1 <= len(each.vessels) <= 5 or not each.vessels for each in many)


def test_each_failure_is_sailed_again_by_its_name() -> None:
    encounters = [*random_set(2, 1), *random_set(1, 4, channel=True), imazu(factor=4.0)[2]]
    verdicts = judge_all(encounters, 1)
    hit = failures(verdicts)["hit"]
    assert len(hit) == sum(each.tally.collisions for each in verdicts) >= 1
    for verdict in verdicts:
        assert judge_one(by_name(verdict.name)) == verdict
    assert [by_name(name) for name in ("random-1", "random-x-1", "nothing-1-1", "imazu-1-1.5-23", "")] == [None] * 5


# ---- the bars


def held(encounters: list[Encounter], workers: int = 1):
    verdicts = judge_all(encounters, workers)
    tally = tally_of(verdicts)
    assert tally.roles_share >= 0.99, tally
    assert tally.warned_share >= 0.99, [(v.name, v.tally) for v in verdicts if v.tally.warned < v.tally.could_warn]
    # a small boat's report may be half a minute old and her place off by half of what is wanted
    assert tally.closed_share >= 0.9, [(v.name, v.tally) for v in verdicts if v.tally.closed < v.tally.could_close]
    return tally


def test_ships_are_told_as_close_before_they_are_on_us() -> None:
    tally = held(imazu(factor=4.0)[:8])
    assert tally.could_close == tally.closed == sum(len(each.vessels) for each in imazu(factor=4.0)[:8])


def test_who_is_told_as_close_too_late_is_found_by_the_judge() -> None:
    outcome = sail(imazu(factor=4.0)[0])
    (ship,) = outcome.told
    assert ship.close_s < ship.truth.near_s - 10.0
    assert (verdict_of(outcome).tally.could_close, verdict_of(outcome).tally.closed) == (1, 1)
    ship.close_s = ship.truth.near_s - 5.0
    assert (verdict_of(outcome).tally.could_close, verdict_of(outcome).tally.closed) == (1, 0)
    assert failures([verdict_of(outcome)])["close late"] == [outcome.encounter.name]


def test_a_few_encounters_are_told_rightly_and_in_time() -> None:
    encounters = [*imazu()[:3], *random_set(5, 1)]
    tally = held(encounters)
    assert tally.collisions >= 3
    page = make_page("few", judge_all(encounters[:3], 1), encounters)
    assert page.count("<polyline") == sum(1 + len(each.vessels) for each in encounters[:3])


@pytest.mark.soak
def test_imazu_and_dnv_are_told_rightly_and_doing_nothing_hits_in_all(shared_data) -> None:
    path = shared_data / "encounters" / "dnv55.csv"
    assert held([*imazu(), *imazu(factor=4.0)], 2).collisions == 44
    assert held(dnv(path), 2).collisions == 55
    held(dnv(path, similar=True), 2)
    held(imazu(own_mps=2.9), 2)


@pytest.mark.soak
def test_two_thousand_random_encounters() -> None:
    """Doing nothing collides in 656 of the reference's 2000; three standard deviations of such a count are 63."""
    tally = held(list(random_set(2000, 1)), 2)
    assert abs(tally.collisions - 656) <= 63
    assert tally.false_share <= 0.02, tally


def test_the_worst_come_first() -> None:
    verdicts = judge_all(list(random_set(4, 3)), 1)
    worst = worst_of(verdicts)
    tallies = [each.tally for each in worst]
    late = [t.could_warn - t.warned + t.could_close - t.closed + t.roles_wrong for t in tallies]
    assert late == sorted(late, reverse=True)
    assert all(re.fullmatch(r"random-3-\d", each.name) for each in worst)
