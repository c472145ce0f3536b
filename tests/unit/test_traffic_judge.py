"""Risk, roles and clearance towards other vessels; what is told of them, and when."""

from __future__ import annotations

import math
import random
import re
from dataclasses import replace
from itertools import pairwise

import pytest

from companion.core.traffic import TrafficConfig
from companion.core.traffic.clearance import Hull, clearance, hull_of, passed_s, reached_s
from companion.core.traffic.sectors import Duty, duty_of, role_of
from companion.core.traffic.words import situation
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.traffic import TCPA_MOST_S, Danger, Role, Sides
from sitl.traffic import encoder
from sitl.traffic.fleet import hull_distance_m
from sitl.traffic.target import ManoeuvreText, VesselText
from sitl.traffic.transmitter import AisText
from tests.traffic_rig import START_UTC_US, Sea
from tests.unit.test_traffic_mavlink import EXAMPLE

# ---- clearance


def by_steps(
    hull: Hull, place: tuple[float, float], closing: tuple[float, float], heading_rad: float, horizon_s: float
) -> float:
    """The least distance to a stadium, looked for in small steps of time and along its axis."""
    least = math.inf
    for step in range(601):
        at_s = horizon_s * step / 600
        north, east = place[0] + closing[0] * at_s, place[1] + closing[1] * at_s
        for part in range(41):
            along = -hull.stern_m + (hull.bow_m + hull.stern_m) * part / 40
            n = north + along * math.cos(heading_rad) - hull.right_m * math.sin(heading_rad)
            e = east + along * math.sin(heading_rad) + hull.right_m * math.cos(heading_rad)
            least = min(least, math.hypot(n, e))
    return least - hull.half_m


def test_the_clearance_is_the_least_distance_to_the_hull() -> None:
    rng = random.Random(4)
    for _ in range(8):
        hull = Hull(rng.uniform(0, 60), rng.uniform(0, 60), rng.uniform(1, 12), rng.uniform(-6, 6), 100.0)
        place = rng.uniform(-200, 200), rng.uniform(-200, 200)
        closing = rng.uniform(-4, 4), rng.uniform(-4, 4)
        heading_rad = rng.uniform(-math.pi, math.pi)
        found = clearance(*place, closing, (hull, heading_rad), 90.0)
        assert found.distance_m == pytest.approx(by_steps(hull, place, closing, heading_rad, 90.0), abs=1.2)
        assert 0.0 <= found.time_s <= 90.0


def off_m(axis: tuple[Hull, float], at_s: float, north: float, east: float, rate: tuple[float, float]) -> float:
    """The clearance after so long."""
    return clearance(north + rate[0] * at_s, east + rate[1] * at_s, (0.0, 0.0), axis, 0.0).now_m


def test_a_hull_is_reached_when_a_walk_in_small_steps_first_comes_so_near() -> None:
    rng = random.Random(6)
    reached = 0
    for _ in range(200):
        hull = Hull(rng.uniform(0, 90), rng.uniform(0, 90), rng.uniform(1, 12), rng.uniform(-6, 6), 100.0)
        course = (rng.uniform(-200, 200), rng.uniform(-200, 200), (rng.uniform(-4, 4), rng.uniform(-4, 4)))
        axis, reach_m = (hull, rng.uniform(-math.pi, math.pi)), rng.choice((0.0, 10.0, 20.0))

        walked = next((step * 0.25 for step in range(801) if off_m(axis, step * 0.25, *course) <= reach_m), math.inf)
        found = reached_s(*course, axis, reach_m)
        if walked < math.inf:
            reached += 1
            assert walked - 0.25 <= found <= walked
        else:
            assert found > 199.0 or off_m(axis, found, *course) == pytest.approx(
                reach_m, abs=1e-6
            )  # grazed between two steps
    assert reached > 20


def test_of_a_hull_sailed_along_the_near_end_counts() -> None:
    """Her stern is 100 m ahead of us, her bow 300 m; we pass 10 m off, 0.1 degrees nearer to her bow or to her stern."""
    hull = Hull(100.0, 100.0, 10.0, 0.0, 220.0)
    for degrees in (0.1, -0.1):
        closing = -2.0 * math.cos(math.radians(degrees)), 2.0 * math.sin(math.radians(degrees))
        assert passed_s(200.0, 20.0, closing, (hull, 0.0), 20.0) == pytest.approx(50.0, abs=0.2)
    assert math.isinf(passed_s(200.0, 60.0, (-2.0, 0.0), (hull, 0.0), 20.0))


def test_a_bow_is_met_long_before_the_antenna() -> None:
    """An antenna 140 m behind the bow, abeam of us at 120 m when the bow has long crossed our place."""
    hull = hull_of(Sides(bow_m=140, stern_m=40, port_m=15, starboard_m=15), ship=True)
    ahead = clearance(120.0, 0.0, (0.0, 0.0), (hull, math.pi), 180.0)
    assert ahead.distance_m == pytest.approx(-15.0)


@pytest.mark.parametrize(
    ("sides", "ship", "length_m", "half_m"),
    [
        (None, True, 100.0, 8.0),
        (None, False, 12.0, 2.0),
        (Sides(6, 5, 2, 1), False, 11.0, 1.5),
        (Sides(0, 24, 0, 6), False, 24.0, 3.0),
        (Sides(0, 0, 2, 2), False, 12.0, 2.0),
    ],
)
def test_a_hull_from_what_is_said_of_it(sides: Sides | None, ship: bool, length_m: float, half_m: float) -> None:
    hull = hull_of(sides, ship=ship)
    assert (hull.length_m, hull.half_m) == (length_m, half_m)


# ---- roles: own at the origin, heading north at 1.5 m/s


@pytest.mark.parametrize(
    ("north_m", "east_m", "mps", "course_deg", "role"),
    [
        (600, 0, 5, 180, Role.HEAD_ON),
        (300, 300, 1.5, 270, Role.GIVE_WAY),
        (300, -300, 1.5, 90, Role.STAND_ON),
        (-400, 0, 6, 0, Role.OVERTAKEN),
        (200, 0, 0.8, 0, Role.OVERTAKING),
        (-100, 275, 3, 300, Role.GIVE_WAY),
        (-128, 274, 3, 330, Role.OVERTAKEN),
        (600, 0, 5, 190, Role.HEAD_ON),
    ],
)
def test_a_role_by_bearing_and_aspect(north_m: float, east_m: float, mps: float, course_deg: float, role: Role) -> None:
    assert role_of((north_m, east_m), 0.0, 1.5, math.radians(course_deg), mps) is role


def test_every_role_asks_something_or_nothing() -> None:
    assert {role: duty_of(role) for role in Role} == {
        Role.NONE: Duty.NONE,
        Role.OBSTACLE: Duty.NONE,
        Role.HEAD_ON: Duty.GIVE_WAY,
        Role.GIVE_WAY: Duty.GIVE_WAY,
        Role.OVERTAKING: Duty.GIVE_WAY,
        Role.STAND_ON: Duty.STAND_ON,
        Role.OVERTAKEN: Duty.STAND_ON,
    }


@pytest.mark.parametrize(
    ("status", "ship_type", "ais", "owed"),
    [
        (0, 36, "A", "we stand on"),
        (2, 0, "A", "we give way: she is not under command"),
        (3, 0, "A", "we give way: she is restricted"),
        (4, 0, "A", "we do not impede her: she is constrained by draught"),
        (7, 0, "A", "we give way: she is fishing"),
        (8, 0, "A", "we give way: she is sailing"),
        (15, 30, "A", "we give way: she is fishing"),
        (0, 36, "B", "we give way: she is sailing"),
        (0, 37, "B", "we stand on"),
    ],
)
def test_from_port_we_stand_on_towards_who_is_power_driven_only(
    status: int, ship_type: int, ais: str, owed: str
) -> None:
    """Rule 18. Class B sends no status: her type says what she may be at."""
    vessel = VesselText(
        north_m=200, east_m=-200, course_deg=90, speed_mps=1.5, status=status, ship_type=ship_type, ais=ais
    )
    sea = Sea([vessel], own_mps=1.5, ais=AisText(loss_share=0.0))
    sea.run(60)
    (told,) = [text for _, _, text in sea.texts if "crossing from port" in text]
    assert told.endswith(f"; {owed}")


def test_who_overtakes_keeps_clear_whatever_she_is() -> None:
    """Rule 13 stands above rule 18."""
    vessel = VesselText(north_m=-200, course_deg=0, speed_mps=4.0, status=8)
    sea = Sea([vessel], own_mps=1.5, ais=AisText(loss_share=0.0))
    sea.run(60)
    (told,) = [text for _, _, text in sea.texts if "overtaking us" in text]
    assert told.endswith("; we stand on")


def reported(sea: Sea, east_m: float, course_deg: float) -> bytes:
    """A ship abeam as fast as we are."""
    report = encoder.StationReport(244000001, *sea.frame.to_geodetic(sea.north_m, east_m), 63)
    report.sog_mps, report.cog_rad = sea.own_mps, math.radians(course_deg)
    return encoder.sentences(report.class_a(), 0)


@pytest.mark.parametrize("east_m", [30.0, -30.0])
def test_who_keeps_abeam_on_our_course_does_not_cross_until_she_turns_in(east_m: float) -> None:
    """Parallel and as fast: rule 15 speaks of vessels that cross."""
    sea = Sea(own_mps=1.5)
    for _ in range(6):
        sea.hear(reported(sea, east_m, 0.0))
        sea.run(10)
    ((_, severity, text),) = sea.texts
    assert severity is Severity.WARNING
    assert "coming close" in text
    assert not text.endswith(("give way", "stand on"))
    sea.hear(reported(sea, east_m, -math.copysign(40.0, east_m)))
    sea.run(3)
    (ship,) = sea.picture.threats
    assert ship.role is (Role.GIVE_WAY if east_m > 0.0 else Role.STAND_ON)


@pytest.mark.parametrize("faster_mps", [0.1, 0.15, 0.19, 0.3])
@pytest.mark.parametrize("east_m", [25.0, -25.0])
def test_who_overtakes_slowly_is_overtaking_and_stays_so_when_she_turns_in(east_m: float, faster_mps: float) -> None:
    """Rule 13 d: no later change of bearing makes her a crossing vessel, from starboard least of all."""
    sea = Sea(own_mps=1.5)
    ahead_m, roles = -20.0, set()
    while ahead_m < 5.0:
        sea.hear(overtaker(sea, (ahead_m, east_m), 1.5 + faster_mps, 0.0))
        sea.run(3)
        ahead_m += 3.0 * faster_mps
        roles |= {ship.role for ship in sea.picture.threats}
    sea.hear(overtaker(sea, (ahead_m, east_m), 1.5 + faster_mps, -math.copysign(40.0, east_m)))
    sea.run(3)
    roles |= {ship.role for ship in sea.picture.threats}
    assert roles == {Role.OVERTAKEN}


@pytest.mark.parametrize(("ahead_m", "role"), [(30.0, Role.OVERTAKING), (-30.0, Role.NONE)])
def test_who_is_slower_than_we_are_is_overtaken_when_she_is_ahead(ahead_m: float, role: Role) -> None:
    """And astern she falls behind: she neither crosses nor overtakes."""
    sea = Sea(own_mps=1.5)
    sea.hear(overtaker(sea, (ahead_m, 10.0), 1.4, 0.0))
    sea.run(3)
    (ship,) = sea.picture.threats
    assert ship.role is role


def overtaker(sea: Sea, place_m: tuple[float, float], mps: float, course_deg: float) -> bytes:
    """A ship so far ahead and to starboard of us."""
    place = sea.frame.to_geodetic(sea.north_m + place_m[0], place_m[1])
    report = encoder.StationReport(244000001, *place, (START_UTC_US + sea.now_us) // 1_000_000 % 60)
    report.sog_mps, report.cog_rad = mps, math.radians(course_deg)
    return encoder.sentences(report.class_a(), 0)


# ---- told


CLEAN = AisText(loss_share=0.0)


def test_a_meeting_is_told_from_risk_to_past_and_clear() -> None:
    ship = VesselText(name="MV EXAMPLE", north_m=2000.0, course_deg=180.0, speed_mps=5.0, length_m=60.0)
    sea = Sea([ship], ais=CLEAN)
    seen: list[Danger] = []
    sea.run(
        400, lambda: seen.append(sea.vessel().danger) if sea.vessel() and seen[-1:] != [sea.vessel().danger] else None
    )
    assert seen in (
        [Danger.NONE, Danger.RISK, Danger.CLOSE, Danger.NONE],
        [Danger.NONE, Danger.RISK, Danger.CLOSE, Danger.RISK, Danger.NONE],
    )
    words = [text for _, _, text in sea.texts]
    assert re.fullmatch(r"Traffic: MV EXAMPLE head-on, CPA \d+ m in 1\d\d s; we give way", words[0])
    assert words[1].startswith("Traffic: MV EXAMPLE close, CPA ")
    assert words[2] == "Traffic: MV EXAMPLE past and clear"
    assert len(words) == 3
    met_s = 2000.0 / 6.5
    assert sea.said("head-on")[0] < met_s - 120.0


def test_the_role_is_kept_when_bearings_change() -> None:
    """She crosses from starboard, turns towards us and passes astern: still she came from starboard (rule 13 d and 15)."""
    turn = ManoeuvreText(at_s=60.0, turn_deg=-40.0)
    boat = VesselText(
        ais="B", north_m=225.0, east_m=300.0, course_deg=270.0, speed_mps=2.0, manoeuvres=(turn,), interval_s=10
    )
    sea = Sea([boat], ais=CLEAN)
    roles: set[Role] = set()
    sea.run(
        150, lambda: roles.add(sea.vessel().role) if sea.vessel() and sea.vessel().danger is not Danger.NONE else None
    )
    assert roles == {Role.GIVE_WAY}


def test_who_passes_far_off_is_shown_and_not_told() -> None:
    sea = Sea([VesselText(north_m=1300.0, east_m=400.0, course_deg=180.0, speed_mps=5.0)], ais=CLEAN)
    sea.run(400)
    assert sea.texts == []
    assert sea.vessel().range_m > 300.0


def test_a_vessel_with_risk_that_falls_silent_is_told() -> None:
    ship = VesselText(north_m=1300.0, course_deg=180.0, speed_mps=5.0, silent=({"from_s": 100, "to_s": 400},))
    sea = Sea([ship], ais=CLEAN)
    sea.run(160)
    assert sea.said("not heard for")
    assert sea.picture.lost


def test_a_vessel_at_anchor_ahead_is_in_the_way_and_has_no_role() -> None:
    sea = Sea([VesselText(status=1, north_m=400.0, length_m=40.0)], ais=CLEAN)
    sea.run(200)
    assert sea.vessel().role is Role.OBSTACLE
    assert "in the way" in sea.texts[0][2]


def test_in_a_crowd_words_are_few() -> None:
    crowd = [VesselText(north_m=900.0 + 10 * n, course_deg=180.0, speed_mps=4.0 + 0.02 * n) for n in range(60)]
    sea = Sea(crowd, ais=CLEAN)
    sea.run(60)
    assert sum(vessel.danger is not Danger.NONE for vessel in sea.picture.vessels) > 40
    for at_s, _, _ in sea.texts:
        assert sum(at_s - 10.0 < other <= at_s for other, _, _ in sea.texts) <= 10


def anchored(length_m: float, east_m: float) -> VesselText:
    return VesselText(status=1, name="BIG SHIP", north_m=400.0, east_m=east_m, length_m=length_m)


@pytest.mark.parametrize(
    ("vessel", "seconds"),
    [
        (anchored(200.0, 5.0), 300.0),
        (anchored(300.0, 5.0), 300.0),
        (anchored(40.0, 0.0), 300.0),
        (VesselText(north_m=200.0, east_m=3.0, speed_mps=0.51, length_m=100.0), 200.0),
        (VesselText(ais="B", north_m=600.0, course_deg=180.0, speed_mps=5.0, interval_s=10.0), 200.0),
    ],
)
def test_close_is_told_long_before_a_hull_is_hit_and_the_time_told_is_that_of_her_near_end(
    vessel: VesselText, seconds: float
) -> None:
    sea = Sea([vessel], ais=CLEAN)
    hit_s: list[float] = []

    def watch() -> None:
        if not hit_s and hull_distance_m(sea.targets[0], sea.north_m, sea.east_m) <= 0.0:
            hit_s.append(sea.time_s)

    sea.run(seconds, watch)
    assert 15.0 < hit_s[0] - sea.said(" close, CPA 0 m in ")[0] < 60.0
    told = [(at_s, text) for at_s, _, text in sea.texts if " CPA 0 m in " in text]
    for at_s, text in told:
        assert at_s + int(re.search(r" in (\d+) s", text)[1]) == pytest.approx(hit_s[0], abs=15.0)
    assert [severity for _, severity, _ in sea.texts].count(Severity.CRITICAL) == 1


def test_a_ship_that_draws_slowly_nearer_alongside_is_close_while_she_is_alongside() -> None:
    ship = VesselText(name="LONG SHIP", east_m=27.0, course_deg=359.0, speed_mps=1.5, length_m=200.0, beam_m=30.0)
    sea = Sea([ship], ais=CLEAN)
    dangers: list[Danger] = []
    sea.run(60, lambda: dangers.append(sea.vessel().danger) if sea.vessel() and sea.vessel().sides else None)
    assert set(dangers[10:]) == {Danger.CLOSE}
    assert re.search(r" close, .*\d+ m off", sea.texts[-1][2])


def test_who_sways_about_the_limit_of_close_is_told_once() -> None:
    """A ship overtakes us as we drift at a few centimetres a second: which end of her comes nearest is a matter of chance."""
    ship = VesselText(north_m=-300.0, east_m=17.0, speed_mps=2.6, length_m=100.0, beam_m=16.0, interval_s=2.0)
    sea, rng = Sea([ship], ais=CLEAN, own_mps=0.05, dt_s=0.1), random.Random(1)
    dangers: list[Danger] = [Danger.NONE]

    def drift() -> None:
        sea.own_rad = rng.uniform(-math.pi, math.pi)
        if sea.vessel() and sea.vessel().danger is not dangers[-1]:
            dangers.append(sea.vessel().danger)

    sea.run(250, drift)
    assert dangers == [Danger.NONE, Danger.RISK, Danger.CLOSE, Danger.RISK, Danger.NONE]
    assert [severity for _, severity, _ in sea.texts] == [Severity.WARNING, Severity.CRITICAL, Severity.INFO]


def test_the_last_of_many_that_come_at_once_is_told_too() -> None:
    """Fourteen from all sides, all close within some seconds: none is left out as noise."""
    bearings = [index * math.tau / 14 for index in range(14)]
    fleet = [
        VesselText(
            name=f"BOAT {index}",
            north_m=120.0 * math.cos(bearing),
            east_m=120.0 * math.sin(bearing),
            course_deg=(math.degrees(bearing) + 180.0) % 360.0,
            speed_mps=4.0,
            interval_s=2.0,
        )
        for index, bearing in enumerate(bearings)
    ]
    sea = Sea(fleet, ais=CLEAN, own_mps=0.0)
    sea.run(25)
    told = {text.partition(" close")[0] for _, severity, text in sea.texts if severity is Severity.CRITICAL}
    assert len(told) == 14


@pytest.mark.parametrize("own_mps", [0.0, 1.5])
def test_who_has_passed_goes_away_and_comes_no_closer(own_mps: float) -> None:
    ship = VesselText(name="PASSED", north_m=250.0, east_m=25.0, course_deg=180.0, speed_mps=2.0, length_m=30.0)
    sea = Sea([ship], ais=CLEAN, own_mps=own_mps)
    behind: set[str] = set()

    def listen() -> None:
        vessel = sea.vessel()
        if vessel and vessel.danger is not Danger.NONE and sea.targets[0].north_m < sea.north_m - 25.0:
            behind.add(situation(vessel).partition(";")[0])

    sea.run(200, listen)
    assert behind == {"PASSED going away, not yet clear"}
    assert sea.said("PASSED past and clear")


def test_who_lies_near_a_boat_at_rest_neither_comes_nor_goes() -> None:
    sea = Sea([VesselText(status=1, north_m=20.0, length_m=10.0, name="NEAR")], ais=CLEAN, own_mps=0.0)
    sea.run(10)
    assert re.fullmatch(r"NEAR in the way, CPA \d+ m now", situation(sea.vessel()))


def test_no_time_is_told_of_what_is_twenty_minutes_ahead() -> None:
    told = replace(EXAMPLE, danger=Danger.RISK, cpa_m=13.0, tcpa_s=TCPA_MOST_S)
    assert situation(told) == "MV EXAMPLE coming close, CPA 13 m"
    assert situation(replace(told, tcpa_s=170.0)) == "MV EXAMPLE coming close, CPA 13 m in 170 s"


def test_a_forged_ship_on_top_of_us_is_told_and_breaks_nothing() -> None:
    sea = Sea([VesselText(north_m=30.0, course_deg=180.0, speed_mps=15.0, length_m=200.0)], ais=CLEAN)
    sea.run(20)
    assert sea.picture.close or sea.said("close")


# ---- the receiver


def test_a_receiver_that_falls_silent_is_told_and_back_again() -> None:
    sea = Sea()
    sea.run(100)
    assert sea.texts == []  # nobody has a receiver: nothing is missed
    sea.hear(b"!AIVDM,1,1,,A,13`l7@001swH9JPGT?l:V`M5P000,0*55\r\n")
    sea.run(70)
    assert sea.said("AIS silent for 60 s: traffic unknown")
    assert sea.picture.silent
    sea.hear(b"!AIVDM,1,1,,A,B3rl@;h0<on2AN5q4Nhr;wV40000,0*60\r\n")
    sea.run(1)
    assert sea.said("AIS is heard again")
    assert not sea.picture.silent


def moored_and_heard(*, loss_share: float) -> Sea:
    """Alone with a moored vessel that reports each three minutes."""
    ship = VesselText(status=5, north_m=300.0)
    return Sea([ship], own_mps=0.0, dt_s=1.0, ais=AisText(loss_share=loss_share))


def test_a_receiver_that_hears_only_who_lies_at_anchor_is_not_silent_between_her_reports() -> None:
    sea = moored_and_heard(loss_share=0.0)
    sea.run(3600)
    assert not sea.said("AIS")
    assert not sea.picture.silent


def test_a_receiver_that_loses_a_report_now_and_then_is_told_at_most_every_ten_minutes() -> None:
    sea = moored_and_heard(loss_share=0.5)
    sea.run(4 * 3600)
    told_s = sea.said("AIS silent for 200 s: traffic unknown")
    assert len(told_s) > 1
    assert all(later - sooner >= 600.0 for sooner, later in pairwise(told_s))
    assert 0 <= len(told_s) - len(sea.said("AIS is heard again")) <= 1


def test_a_receiver_that_falls_silent_beside_who_lies_at_anchor_is_told_once() -> None:
    sea = moored_and_heard(loss_share=0.0)
    sea.run(60)
    sea.air.clear()
    sea.targets.clear()
    sea.run(1800)
    assert len(sea.said("AIS silent for 200 s: traffic unknown")) == 1
    assert sea.picture.silent


def test_a_receiver_that_is_required_is_missed_from_the_start() -> None:
    sea = Sea(config=TrafficConfig(required=True))
    sea.run(70)
    assert sea.said("AIS silent")


def test_what_a_receiver_says_of_itself_is_told_once() -> None:
    sea = Sea()
    for _ in range(5):
        sea.hear(b"$AITXT,01,01,60,AIS: Internal GNSS not in use*28\r\n")
        sea.hear(b"$AIALR,000000.00,001,A,V,AIS: Tx malfunction*5C\r\n")
        sea.run(10)
    assert [text for _, _, text in sea.texts] == [
        "AIS receiver: Internal GNSS not in use",
        "AIS receiver: Tx malfunction",
    ]
