"""Where other vessels are, between their reports and against their tricks."""

from __future__ import annotations

import math
import random

import pytest

from companion.core.traffic import TrafficConfig
from companion.core.traffic.table import TRACKS_MAX
from companion.core.traffic.traffic import LOOKS_A_TICK
from mavlink_bridge.language.traffic import Danger, VesselKind
from sitl.traffic import encoder
from sitl.traffic.target import ManoeuvreText, VesselText
from sitl.traffic.transmitter import AisText
from tests.traffic_rig import START_UTC_US, Sea

FAR = {"north_m": 800.0, "east_m": 500.0}


def straight(rng: random.Random) -> VesselText:
    ais = rng.choice(("A", "B"))
    speed = rng.uniform(0.8, 14.0) if ais == "A" else rng.uniform(1.1, 9.0)
    return VesselText(ais=ais, course_deg=rng.uniform(0, 360), speed_mps=speed, **FAR)


def inside_share(count: int, seed: int) -> float:
    """Share of seconds in which a vessel on a straight course was within two sigmas of where the boat believed her."""
    inside = looked = 0
    rng = random.Random(seed)
    sea = Sea([straight(rng) for _ in range(count)], seed=seed, own_mps=0.0, dt_s=1.0)
    for _ in range(400):
        sea.step()
        for number in range(count):
            vessel, off_m = sea.vessel(number), sea.off_m(number)
            if vessel is not None and off_m is not None:
                looked += 1
                inside += off_m <= 2.0 * vessel.sigma_m
    assert looked > 200 * count
    return inside / looked


def test_a_straight_course_stays_within_two_sigmas() -> None:
    assert inside_share(12, seed=1) >= 0.95


@pytest.mark.soak
def test_a_straight_course_stays_within_two_sigmas_for_hundreds() -> None:
    """As many at once as are looked at in one tick, which is a second here: more would be seen where they were seconds ago."""
    assert sum(inside_share(LOOKS_A_TICK, seed) for seed in range(40)) / 40 >= 0.95


def test_uncertainty_grows_with_silence() -> None:
    sea = Sea([VesselText(speed_mps=5.0, silent=({"from_s": 30, "to_s": 200},), **FAR)], own_mps=0.0)
    sea.run(25)
    sure = sea.vessel().sigma_m
    sea.run(100)
    assert sea.vessel().sigma_m > 2.0 * sure
    assert sea.vessel().age_s(sea.now_us) > 90.0


@pytest.mark.parametrize("ais", ["A", "B"])
def test_an_anchored_vessel_does_not_drift(ais: str) -> None:
    """Her receiver's noise of half a knot would carry her 30 m away in three minutes."""
    vessels = [VesselText(ais=ais, status=1 if ais == "A" else 0, north_m=300.0, east_m=100.0 * n) for n in range(8)]
    sea = Sea(vessels, own_mps=0.0, dt_s=1.0)
    sea.run(1500)
    places = [sea.frame.to_local(sea.vessel(n).lat_rad, sea.vessel(n).lon_rad) for n in range(8)]
    sea.run(500)
    for number, place in enumerate(places):
        vessel = sea.vessel(number)
        assert vessel.at_rest
        now = sea.frame.to_local(vessel.lat_rad, vessel.lon_rad)
        assert math.dist(place, now) <= 15.0
        assert sea.off_m(number) <= 15.0


def test_a_ship_whose_status_was_left_at_anchor_is_under_way() -> None:
    sea = Sea([VesselText(status=1, speed_mps=6.0, **FAR)], own_mps=0.0)
    sea.run(30)
    assert not sea.vessel().at_rest
    assert sea.off_m() < 60.0


def test_a_turn_is_seen_without_a_turn_indicator() -> None:
    """Class A turns at 3 degrees a second and reports every 3.3 s; two courses tell the rate."""
    turn = ManoeuvreText(at_s=30.0, turn_deg=90.0)
    sea = Sea([VesselText(speed_mps=6.0, manoeuvres=(turn,), **FAR)], own_mps=0.0, ais=AisText(loss_share=0.0))
    sea.run(45)
    (entry,) = sea.traffic.table.of(sea.targets[0].mmsi)
    assert math.degrees(entry.track.turn_radps) == pytest.approx(3.0, abs=2.0)
    sea.run(40)
    assert entry.track.turn_radps == 0.0


def test_latency_is_reckoned_by_the_utc_second() -> None:
    late = AisText(latency_s=4.0, loss_share=0.0, position_m=0.0, course_deg=0.0, speed_mps=0.0)
    known = Sea([VesselText(speed_mps=10.0, **FAR)], own_mps=0.0, ais=late)
    blind = Sea([VesselText(speed_mps=10.0, **FAR)], own_mps=0.0, ais=late, knows_utc=False)
    known.run(60)
    blind.run(60)
    assert known.off_m() < 12.0
    assert blind.off_m() > 20.0
    assert blind.off_m() < 2.5 * blind.vessel().sigma_m


@pytest.mark.parametrize(("latency_s", "late"), [(9.0, False), (12.0, True), (30.0, True)])
def test_a_feed_that_is_late_beyond_belief_is_told_once_and_its_end_too(latency_s: float, late: bool) -> None:
    """By the UTC second alone a late network is not told from a clock that is off: the ships stay where they said, and a person is told."""
    sea = Sea([VesselText(speed_mps=8.0, **FAR), VesselText(speed_mps=4.0, **FAR)], own_mps=0.0)
    in_time = AisText(loss_share=0.0)
    for air in sea.air:
        air.config = in_time.model_copy(update={"latency_s": latency_s})
    sea.run(180)
    assert len(sea.said("AIS reports come")) == int(late)
    assert not late or sea.said(f"AIS reports come {latency_s:.0f} s late, or a clock is off")
    for air in sea.air:
        air.config = in_time
    sea.run(180)
    assert len(sea.said("in time again")) == int(late)


@pytest.mark.parametrize("behind_s", [1, 2, 9])
def test_a_clock_some_seconds_behind_makes_no_report_late(behind_s: int) -> None:
    """Her second is ahead of ours: by the minute's second alone that would be an age of 58 s."""
    sea = Sea(own_mps=0.0)
    for _ in range(30):
        second = ((START_UTC_US + sea.now_us) // 1_000_000 + behind_s) % 60
        sea.hear(position(244123456, sea, 500.0, 0.0, second=second))
        sea.run(3)
    assert not sea.said("late")


def position(
    mmsi: int, sea: Sea, north_m: float, east_m: float, *, speed_mps: float | None = 3.0, second: int | None = None
) -> bytes:
    report = encoder.StationReport(mmsi, *sea.frame.to_geodetic(north_m, east_m), 0)
    report.second = (START_UTC_US + sea.now_us) // 1_000_000 % 60 if second is None else second
    report.sog_mps = speed_mps
    report.cog_rad = 0.0 if speed_mps is not None else None
    return encoder.sentences(report.class_a(), 0)


def hear_every(sea: Sea, seconds: float, times: int, make) -> None:
    for number in range(times):
        sea.hear(make(number))
        sea.run(seconds)


def test_a_report_heard_twice_does_not_make_a_vessel_younger() -> None:
    sea = Sea(own_mps=0.0)
    data = position(244123456, sea, 400.0, 0.0)
    sea.hear(data)
    sea.run(20)
    sea.hear(data)
    sea.step()
    (vessel,) = sea.picture.vessels
    assert vessel.age_s(sea.now_us) > 19.0


def test_an_outlier_moves_nobody_and_three_in_a_row_do() -> None:
    sea = Sea(own_mps=0.0)
    hear_every(sea, 10, 5, lambda n: position(244123456, sea, 400.0 + 30 * n, 0.0))
    sea.hear(position(244123456, sea, 5000.0, 5000.0))
    sea.run(10)
    (vessel,) = sea.picture.vessels
    assert vessel.range_m < 700.0
    hear_every(sea, 10, 3, lambda n: position(244123456, sea, 5100.0 + 30 * n, 5000.0))
    (vessel,) = sea.picture.vessels
    assert vessel.range_m > 6000.0


def test_two_vessels_under_one_number_are_both_kept_and_the_nearer_is_shown() -> None:
    sea = Sea(own_mps=0.0)
    hear_every(
        sea, 5, 20, lambda n: position(244123456, sea, *((400.0, 0.0) if n % 2 else (3000.0, 0.0)), speed_mps=0.0)
    )
    assert len(sea.traffic.table.of(244123456)) == 2
    (vessel,) = sea.picture.vessels
    assert vessel.range_m == pytest.approx(400.0, abs=20.0)


def test_a_flood_ends_at_256_tracks_and_the_nearest_stay() -> None:
    sea = Sea(own_mps=0.0, dt_s=0.05)
    sea.hear(position(244000000, sea, 150.0, 0.0))
    for number in range(700):
        sea.hear(position(244000001 + number, sea, 2000.0 + number, 0.0))
        sea.step()
    assert sea.traffic.table.count == TRACKS_MAX
    assert len(sea.picture.vessels) <= TRACKS_MAX
    sea.hear(position(245000000, sea, 100.0, 0.0))
    sea.step()
    numbers = {vessel.mmsi for vessel in sea.picture.vessels}
    assert {244000000, 245000000} <= numbers


def test_silence_ends_a_track_but_not_before_three_intervals() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(position(244123456, sea, 900.0, 0.0))
    sea.run(590)
    assert sea.picture.vessels
    sea.run(20)
    assert not sea.picture.vessels


def test_speed_unknown_is_taken_from_two_places() -> None:
    sea = Sea(own_mps=0.0)
    hear_every(sea, 10, 3, lambda n: position(244123456, sea, 400.0 + 50 * n, 0.0, speed_mps=None))
    (vessel,) = sea.picture.vessels
    assert vessel.sog_mps == pytest.approx(5.0, abs=0.5)


def test_without_a_position_nothing_is_known_and_the_track_ages() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(position(244123456, sea, 400.0, 0.0))
    sea.run(20)
    sea.hear(b"!AIVDM,1,1,,A,13`l7@?P?w<tSF0l4Q@>4?wqP000,0*0F\r\n")
    sea.run(2)
    (vessel,) = sea.picture.vessels
    assert vessel.age_s(sea.now_us) > 20.0


# ---- who is who


def test_the_own_ship_is_never_a_vessel() -> None:
    sea = Sea(config=TrafficConfig(own_mmsi=244000007))
    sea.hear(position(244000007, sea, 5.0, 0.0))
    sea.hear(as_own(position(263999999, sea, 5.0, 0.0)))
    sea.hear(position(263999999, sea, 10.0, 0.0))
    sea.run(3)
    assert sea.picture.vessels == ()


def test_a_transponder_aboard_is_found_out_and_told_once() -> None:
    sea = Sea(own_mps=1.5)
    for _ in range(30):
        sea.hear(position(244123456, sea, sea.north_m + 1.0, sea.east_m, speed_mps=1.5))
        sea.run(10)
    assert sea.picture.vessels == ()
    assert len(sea.said("moves with us")) == 1


def as_own(data: bytes) -> bytes:
    """The same sentence as the receiver's word of its own ship."""
    own = data.replace(b"AIVDM", b"AIVDO")
    return own[:-4] + b"%02X\r\n" % (int(own[-4:-2], 16) ^ ord("M") ^ ord("O"))


@pytest.mark.parametrize("configured", [0, 244123456], ids=["the receiver's word", "configured"])
def test_with_a_known_number_of_our_own_a_vessel_alongside_is_another(configured: int) -> None:
    """A support boat 12 m abeam that will turn in on us: after a minute she was no vessel any more."""
    sea = Sea(own_mps=1.5, config=TrafficConfig(own_mmsi=configured))
    if not configured:
        sea.hear(as_own(position(244123456, sea, 0.0, 0.0)))
    for _ in range(12):
        sea.hear(position(235099999, sea, sea.north_m, sea.east_m + 12.0, speed_mps=1.5))
        sea.run(10)
    assert [vessel.mmsi for vessel in sea.picture.vessels] == [235099999]
    assert not sea.said("moves with us")


def test_a_neighbour_in_the_harbour_is_not_taken_for_us() -> None:
    sea = Sea(own_mps=0.0)
    for _ in range(30):
        sea.hear(position(244123456, sea, 6.0, 4.0, speed_mps=0.0))
        sea.run(10)
    assert len(sea.picture.vessels) == 1
    assert not sea.said("moves with us")


def test_stations_on_land_are_no_vessels_and_a_beacon_is_a_person() -> None:
    sea = Sea(own_mps=0.0)
    for mmsi in (2442000, 992442000):
        sea.hear(position(mmsi, sea, 100.0, 0.0))
    report = encoder.StationReport(972263001, *sea.frame.to_geodetic(300.0, 300.0), 0)
    report.status = 14
    sea.hear(encoder.sentences(report.class_a(), 0))
    sea.run(3)
    (person,) = sea.picture.vessels
    assert person.kind is VesselKind.PERSON
    assert person.danger is Danger.NONE
    ((_, severity, text),) = [each for each in sea.texts if "972263001" in each[2]]
    assert severity.name == "ALERT"
    assert text == "MOB beacon 972263001: 424 m north-east"
    sea.run(3 * 3600.0)
    assert sea.picture.vessels


def test_a_beacon_in_test_alarms_nobody() -> None:
    sea = Sea(own_mps=0.0)
    sea.hear(encoder.sentences(encoder.safety(970263001, "SART TEST"), 0))
    report = encoder.StationReport(970263001, *sea.frame.to_geodetic(300.0, 0.0), 0)
    report.status = 15
    sea.hear(encoder.sentences(report.class_a(), 0))
    sea.run(3)
    assert not sea.picture.person
    assert [text for _, severity, text in sea.texts] == ["SART beacon 970263001 in test: 300 m north"]


def long_range(sea: Sea, mmsi: int, north_m: float, east_m: float) -> bytes:
    """Type 27: a place to a tenth of a minute, 10 knots to the west."""
    lat_rad, lon_rad = sea.frame.to_geodetic(north_m, east_m)
    place = (round(math.degrees(lon_rad) * 600), 18), (round(math.degrees(lat_rad) * 600), 17)
    fields = [(27, 6), (0, 2), (mmsi, 30), (1, 1), (0, 1), (0, 4), *place, (10, 6), (270, 9), (0, 1), (0, 1)]
    return encoder.sentences(fields, 0)


def test_a_coarse_report_takes_no_risk_away_that_finer_ones_have_shown() -> None:
    """A ship on a collision course whose type 27 is heard beside her type 1: 'past and clear' was told, half a minute before the hit."""
    sea = Sea(own_mps=1.5)
    while sea.time_s < 90.0:
        east_m = 500.0 - 5.0 * sea.time_s
        if sea.time_s % 10.0 == 0.0:
            report = encoder.StationReport(235001234, *sea.frame.to_geodetic(150.0, east_m), 63)
            report.sog_mps, report.cog_rad = 5.0, math.radians(270.0)
            sea.hear(encoder.sentences(report.class_a(), 0))
        if sea.time_s in (35.0, 65.0):
            sea.hear(long_range(sea, 235001234, 150.0, east_m))
        sea.step()
        if sea.time_s > 30.0:
            (ship,) = sea.picture.vessels
            assert ship.kind is VesselKind.CLASS_A
            assert ship.danger is not Danger.NONE
    assert not sea.said("past and clear")


def test_who_was_known_coarsely_is_judged_from_her_first_exact_report() -> None:
    sea = Sea(own_mps=1.5)
    sea.hear(long_range(sea, 235001234, 400.0, 500.0))
    sea.run(5)
    (ship,) = sea.picture.vessels
    assert ship.kind is VesselKind.LONG_RANGE
    sea.hear(position(235001234, sea, 400.0, 500.0))
    sea.run(2)
    (ship,) = sea.picture.vessels
    assert ship.kind is VesselKind.CLASS_A


def test_the_same_bytes_give_the_same_picture() -> None:
    texts = [VesselText(ais="B", speed_mps=3.0, course_deg=200.0, **FAR), VesselText(speed_mps=7.0, **FAR)]
    one, other = Sea(texts, seed=4), Sea(texts, seed=4)
    one.run(120)
    other.run(120)
    assert one.picture == other.picture
    assert one.texts == other.texts


# ---- who says that she lies still


def lies(sea: Sea, place_m: tuple[float, float], told_mps: float, status: int, *, ais: str = "A") -> bytes:
    report = encoder.StationReport(244123456, *sea.frame.to_geodetic(*place_m), 0)
    report.second = (START_UTC_US + sea.now_us) // 1_000_000 % 60
    report.sog_mps, report.cog_rad, report.status = told_mps, math.pi, status
    return encoder.sentences(report.class_b() if ais == "B" else report.class_a(), 0)


@pytest.mark.parametrize(
    ("ais", "status", "speed_mps", "told_mps", "interval_s", "start_m"),
    [
        ("A", 5, 1.44, 1.44, 180.0, 500.0),
        ("A", 1, 1.44, 1.44, 10.0, 500.0),
        ("A", 1, 0.8, 0.8, 180.0, 400.0),
        ("A", 1, 0.8, 0.8, 10.0, 400.0),
        ("A", 1, 0.8, 0.0, 10.0, 400.0),
        ("A", 1, 0.25, 0.25, 180.0, 160.0),
        ("B", 0, 0.2, 0.2, 30.0, 80.0),
        ("B", 0, 0.2, 0.0, 30.0, 90.0),
    ],
)
def test_who_comes_although_she_says_that_she_lies_still_is_told_a_minute_before_and_shown_where_she_is(
    ais: str, status: int, speed_mps: float, told_mps: float, interval_s: float, start_m: float
) -> None:
    """Under a status that was left standing, dragging at anchor, or slower than half a knot; her antenna comes over us."""
    sea = Sea(own_mps=0.0)
    sea.run(1.0)
    met_s = start_m / speed_mps
    while sea.time_s < met_s:
        sea.hear(lies(sea, (start_m - speed_mps * sea.time_s, 0.0), told_mps, status, ais=ais))
        sea.run(min(interval_s, met_s - sea.time_s + 0.5))
    half_m = 50.0 if ais == "A" else 6.0
    hit_s = (start_m - half_m) / speed_mps
    told_s = [at_s for at_s, _, text in sea.texts if "CPA 0 m in" in text]
    assert told_s
    assert hit_s - told_s[0] >= 60.0
    (vessel,) = sea.picture.vessels
    assert vessel.danger is Danger.CLOSE
    assert vessel.range_m <= 10.0
    assert not sea.said("not heard for")


def told_while_she_lies(place, *, noise_m: float, interval_s: float, reports: int, seed: int) -> list[str]:
    """What is said of a vessel about 50 m off whose place is ``place(time)``, as her receiver's noise shows it."""
    sea, rng = Sea(own_mps=0.0, dt_s=2.0), random.Random(seed)
    for _ in range(reports):
        north, east = place(sea.time_s)
        noisy = north + rng.gauss(0.0, noise_m), east + rng.gauss(0.0, noise_m)
        sea.hear(lies(sea, noisy, min(0.2, abs(rng.gauss(0.0, 0.1))), 0, ais="B"))
        sea.run(interval_s)
        (vessel,) = sea.picture.vessels
        assert vessel.at_rest
    return [text for _, _, text in sea.texts if "Traffic" in text]


@pytest.mark.parametrize("interval_s", [10.0, 30.0, 180.0])
@pytest.mark.parametrize("noise_m", [6.0, 10.0])
def test_a_moored_vessel_whose_receiver_wanders_lies_still(noise_m: float, interval_s: float) -> None:
    for seed in range(3):
        told = told_while_she_lies(lambda _: (55.0, 0.0), noise_m=noise_m, interval_s=interval_s, reports=60, seed=seed)
        assert told == []


def test_a_vessel_that_swings_at_anchor_lies_still() -> None:
    """Twelve metres to either side in six minutes: that is 0.2 m/s in the middle, and no way."""

    def swing(time_s: float) -> tuple[float, float]:
        return 55.0, 12.0 * math.sin(math.tau * time_s / 360.0)

    for interval_s in (10.0, 30.0, 180.0):
        assert told_while_she_lies(swing, noise_m=2.0, interval_s=interval_s, reports=60, seed=1) == []


def test_a_ship_that_has_come_to_her_berth_lies_still_from_her_next_report() -> None:
    sea = Sea(own_mps=0.0)
    hear_every(sea, 10, 12, lambda _: lies(sea, (400.0 - 1.44 * sea.time_s, 0.0), 1.44, 5))
    assert not sea.picture.vessels[0].at_rest
    berth_m = 400.0 - 1.44 * sea.time_s
    hear_every(sea, 10, 5, lambda _: lies(sea, (berth_m, 0.0), 0.0, 5))
    (vessel,) = sea.picture.vessels
    assert vessel.at_rest
    assert vessel.range_m == pytest.approx(berth_m, abs=2.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_ship_that_drags_is_not_called_still_again_while_she_goes_on(seed: int) -> None:
    ship = VesselText(status=1, course_deg=180.0, speed_mps=0.8, interval_s=10.0, length_m=30.0, north_m=400.0)
    sea, still = Sea([ship], seed=seed, own_mps=0.0, dt_s=1.0), [True]

    def watch() -> None:
        vessel = sea.vessel()
        if vessel is not None and vessel.at_rest is not still[-1]:
            still.append(vessel.at_rest)

    sea.run(480, watch)
    assert still == [True, False]
    assert not sea.said("past and clear")
    assert sea.off_m() <= 25.0
