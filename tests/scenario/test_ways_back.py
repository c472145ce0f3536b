"""A new check refuses a departure, never a way back: seeded walks with something broken at a random place offshore.

The operator knows the pier on the map and does only what every station offers (arm, modes, go-to) and what the vessel's own texts
offer: a parameter with its value, an order by its name. He must come home each time.
"""

from __future__ import annotations

import math
import os
import random
import re

import pytest

from companion.core.vehicle.voyage import ADRIFT, LANDED_M, Voyage
from companion.io.keeping import MemoryStore
from companion.io.keeping.content import Completion, Record, StoreContent
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Mode, Severity
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.requests import (
    Arm,
    EnableFence,
    Reposition,
    Result,
    SetHomePosition,
    SetMode,
    SetParameter,
    UnlockGuard,
)
from tests.soaked import in_the_soak
from tests.world_station import Helm

HOME_M = 12.0
PATIENCE_S = 400.0
EVENTS = (
    "operator disarms",
    "board starts again",
    "computer starts again",
    "store lost",
    "store foreign",
    "store refuses",
)
AIDS = ("nothing", "small fence", "far plan", "sounder silent", "sounder silent and required")
FIRST_SEED = int(os.environ.get("FIRST_SEED", "100"))
"""Of the two hundred walks: others are had by another number."""
ARM, REPOSITION, SET_MODE, HOLD = 400, 192, 176, 4.0
GUARD = {"sounder silent": [], "sounder silent and required": ["depth.required=true"]}


class Operator:
    """One person with one station."""

    def __init__(self, trip, pier):
        self.trip, self.pier = trip, pier
        self.done = []

    def away_m(self):
        north, east = self.trip.world.surroundings.plant.frame.to_local(*self.pier)
        truth = self.trip.truth
        return math.hypot(truth.north_m - north, truth.east_m - east)

    def try_(self, body, depth=0):
        """Give an order; when it is refused, do what the refusal offers and give it again."""
        reply = self.trip.ask(body)
        self.done.append(f"{body}: {reply.result.value} {reply.reason}")
        if reply.result is Result.ACCEPTED or depth > 3:
            return reply.result is Result.ACCEPTED
        for offer in self.offers(reply.reason, body):
            if self.try_(offer, depth + 1):
                return type(offer) is type(body) or self.try_(body, depth + 1)
        return False

    @staticmethod
    def offers(text, body):
        if isinstance(body, Arm) and "arm with force" in text:
            yield Arm(arm=True, force=True)
        for name, value in re.findall(r"\b([A-Z][A-Z0-9_]+) ?= ?([0-9.]+)", text):
            yield EnableFence(value != "0") if name == "FENCE_ENABLE" else SetParameter(name, float(value))
        if "USER_1" in text:
            yield UnlockGuard()

    def go_home(self):
        """Arm, then the ways home that a station has, nearest at hand first."""
        began_s = self.trip.now_s
        while self.away_m() > HOME_M and self.trip.now_s - began_s < PATIENCE_S:
            if not self.trip.snapshot.armed and not self.try_(Arm(arm=True)):
                self.trip.run(5.0)
                continue
            home = self.trip.world.app.vehicle.parts.mission.home
            at_pier = home is not None and math.dist(home, self.pier) < math.radians(HOME_M / 111_000.0)
            before_m = self.away_m()
            if not (at_pier and self.try_(SetMode(Mode.RTL))):
                self.try_(Reposition(*self.pier))
            self.trip.run(25.0)
            if self.away_m() > before_m - 3.0:
                self.trip.run(5.0)
        return self.away_m() <= HOME_M


def walk(voyage, seed, monkeypatch):
    """Go out, let something break, try to come home; what was met, whether he is home, and what was tried last."""
    chance = random.Random(seed)
    event, aid = EVENTS[seed % len(EVENTS)], chance.choice(AIDS)
    store = MemoryStore()
    overrides = [
        "depth.enabled=false" if aid != "guard required" else "depth.required=true",
        "mission.cruise_speed_mps=2.5",
    ]
    trip = voyage(*overrides, seed=seed, store=store)
    frame = trip.world.surroundings.plant.frame
    pier = frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    bearing, reach_m = chance.uniform(-0.6, 0.6), chance.uniform(60.0, 140.0)
    out = (reach_m * math.cos(bearing), reach_m * math.sin(bearing))
    trip.sail(2.5, (0.6 * out[0], 0.6 * out[1] + chance.uniform(-20.0, 20.0)), out)
    trip.until(lambda: trip.distance_m > chance.uniform(0.5, 0.9) * reach_m, 200.0)

    if event == "operator disarms":
        trip.ask(Arm(arm=False))
    elif event == "board starts again":
        trip.board.reset(trip.world.now_us)
    elif event == "store refuses":
        monkeypatch.setattr(store, "completions", refusing(store))
        trip.ask(Arm(arm=False))
    else:
        content = store.snapshot()
        store = {
            "computer starts again": MemoryStore(content),
            "store lost": MemoryStore(),
            "store foreign": MemoryStore(StoreContent(records={"store/aside": Record(1, "companion.db.simulated-1")})),
        }[event]
        lat, lon = frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
        place = [f"world.latitude_deg={math.degrees(lat):.8f}", f"world.longitude_deg={math.degrees(lon):.8f}"]
        trip = voyage(*overrides, *place, seed=seed + 1000, store=store)
    trip.run(chance.uniform(2.0, 15.0))
    if aid == "small fence":
        here = trip.truth.north_m, trip.truth.east_m
        trip.circle_fence(15.0, here[0] + 60.0, here[1])
    elif aid == "far plan":
        trip.plan(1.5, (9_000.0, 0.0))
        trip.mode(Mode.AUTO)
    elif aid in GUARD:
        trip.faults.depth_silent = True
        trip.run(8.0)
    operator = Operator(trip, pier)
    is_home = operator.go_home()
    told = f"seed {seed}: {event}, {aid}: {operator.away_m():.0f} m from home"
    return is_home, "\n".join([told, *operator.done[-8:], *trip.texts[-8:]])


def refusing(store):
    """A disk that takes nothing, and says so."""

    def completions():
        waiting, store._waiting = store._waiting, []
        return [Completion(ticket, False, "disk full") for ticket, _ in waiting]

    return completions


@pytest.mark.parametrize("seed", [7, 14, 21, 29])  # four events, four aids; all thirty pairs in the soak
def test_nobody_is_stranded(voyage, monkeypatch, seed):
    is_home, told = walk(voyage, seed, monkeypatch)
    assert is_home, told


@pytest.mark.soak
@pytest.mark.parametrize("part", range(10))
def test_nobody_is_stranded_on_two_hundred_walks(voyage, part):
    stranded = []
    for seed in range(FIRST_SEED + 20 * part, FIRST_SEED + 20 * (part + 1)):
        with pytest.MonkeyPatch.context() as patch:
            is_home, told = walk(voyage, seed, patch)
        stranded += [] if is_home else [told]
    assert not stranded, "\n\n".join(stranded)


def test_a_voyage_goes_on_where_the_computer_starts_again_and_return_leads_to_its_beginning(voyage):
    store = MemoryStore()
    trip = voyage("depth.enabled=false", store=store)
    pier = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    trip.sail(2.5, (120.0, 0.0), after_s=30.0)
    lat, lon = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    place = [f"world.latitude_deg={math.degrees(lat):.8f}", f"world.longitude_deg={math.degrees(lon):.8f}"]
    again = voyage("depth.enabled=false", "operator.gcs_required=true", *place, store=store)
    assert any("voyage goes on" in text for text in again.texts)
    assert again.ask(Arm(arm=True)).reason == "", "no ground station was heard: that would refuse a departure"
    home = again.world.app.vehicle.parts.mission.home
    assert math.dist(home, pier) < 1e-6
    again.ask(Arm(arm=False))
    fresh = voyage("depth.enabled=false", "operator.gcs_required=true", store=MemoryStore())
    assert "no ground station heard" in fresh.ask(Arm(arm=True)).reason


def test_a_boat_that_a_restart_left_drifting_is_told_of_until_somebody_arms_or_disarms(voyage):
    """Killed under way: a NOTICE of where home is was all that a station heard of a boat that was disarmed and adrift."""
    world = voyage("depth.enabled=false").world
    frame = world.surroundings.plant.frame
    for began_m, drifts in ((-80.0, True), (-20.0, False)):
        pier = frame.to_geodetic(began_m, 0.0)
        kept = Record(1, {"place": pier, "home": pier, "by_operator": False})
        again = voyage("depth.enabled=false", store=MemoryStore(StoreContent(records={"voyage": kept})))
        again.run(3.0)
        assert again.texts.count(ADRIFT[1]) == drifts
        assert (ADRIFT in again.snapshot.standing) is drifts
        assert again.ask(Arm(arm=drifts)).reason == ""
        assert ADRIFT not in again.snapshot.standing
    assert ADRIFT[0] is Severity.WARNING


@pytest.mark.parametrize("acts", ["arms", "disarms", "nobody"])
def test_that_a_boat_drifts_since_a_restart_is_told_each_minute(acts):
    pier, going, told = LatLon((0.7, -0.1)), Voyage(), []
    going.resume(pier, None)
    for second in range(200):
        if second == 30 and acts != "nobody":
            going.armed(second, pier) if acts == "arms" else going.disarmed(second, None, by_operator=True)
        told += [second] if going.tells_adrift(5_000_000 + second * 1_000_000) else []
    assert told == ([10, 70, 130, 190] if acts == "nobody" else [10])


@pytest.mark.parametrize("starts_again", [False, True], ids=["one process", "computer starts again"])
def test_home_stays_where_the_voyage_began_when_an_operator_arms_again_at_sea(voyage, starts_again):
    """Home was moved to the open sea without a word, and a lost station left her there: "Return to home, 0 m"."""
    store = MemoryStore()
    trip = voyage("depth.enabled=false", store=store)
    pier = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    trip.sail(2.5, (120.0, 0.0), after_s=40.0)
    if starts_again:
        lat, lon = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
        place = [f"world.latitude_deg={math.degrees(lat):.8f}", f"world.longitude_deg={math.degrees(lon):.8f}"]
        trip = voyage("depth.enabled=false", *place, store=store)
        assert trip.ask(Arm(arm=True)).reason == ""
    trip.mode(Mode.HOLD)
    for arm in (False, True):
        trip.texts.clear()
        assert trip.ask(Arm(arm=arm)).reason == ""
        trip.run(1.0)
    assert math.dist(trip.world.app.vehicle.parts.mission.home, pier) < 1e-6
    where = f"{math.degrees(pier[0]):.5f} {math.degrees(pier[1]):.5f}"
    told = [text for text in trip.texts if "home stays" in text]
    assert len(told) == 1
    assert re.fullmatch(rf"home stays \d+ m away, at {where}; Set Home moves it", told[0])
    assert trip.mode(Mode.RTL).reason == ""
    trip.run(90.0)
    assert Operator(trip, pier).away_m() < 5.0


def test_home_stays_when_an_operator_disarms_at_sea_and_the_computer_starts_again(voyage):
    """Home was moved to the open sea without a word: "Return to home, 0 m". A restart that a parameter needs, needs the Disarm first."""
    store = MemoryStore()
    trip = voyage("depth.enabled=false", store=store)
    frame, home = trip.world.surroundings.plant.frame, trip.at(-20.0, 5.0)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.ask(SetHomePosition(*(math.radians(part / 1e7) for part in home))).reason == ""
    assert trip.ask(Reposition(*frame.to_geodetic(80.0, 0.0), speed_mps=2.5)).reason == ""
    trip.until(lambda: trip.distance_m > LANDED_M, 60.0)
    assert trip.ask(Arm(arm=False)).reason == ""
    trip.run(1.0)
    lat, lon = frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    place = [f"world.latitude_deg={math.degrees(lat):.8f}", f"world.longitude_deg={math.degrees(lon):.8f}"]
    kept = store.snapshot().records["voyage"].data
    at, left_us = kept["left"]
    assert left_us == pytest.approx(trip.snapshot.utc_us, abs=2e6)
    for later_s, stays in ((300, True), (86_400, False)):
        left = {**kept, "left": (at, left_us - later_s * 1_000_000)}  # simulated time begins anew
        again = voyage(
            "depth.enabled=false", *place, store=MemoryStore(StoreContent(records={"voyage": Record(1, left)}))
        )
        assert any("the voyage goes on" in text for text in again.texts)
        assert any("the voyage before is over" in text for text in again.texts) is not stays
        assert again.ask(Arm(arm=True)).reason == ""
        is_at = [round(math.degrees(part) * 1e7) for part in again.world.app.vehicle.parts.mission.home]
        assert is_at == pytest.approx(home if stays else again.at(0.0, 0.0), abs=30)


@pytest.mark.parametrize(
    ("up_s", "utc_s", "north_m", "stays"),
    [
        (10.0, 1_060.0, 200.0, True),
        (10.0, 2_810.0, 200.0, False),
        (10.0, 1_060.0, 9_000.0, False),
        (10.0, None, 200.0, True),
        (1_810.0, None, 200.0, False),
        (10.0, 500.0, 200.0, True),
    ],
    ids=["soon", "later", "another water by car", "no clock", "no clock for long", "a clock of before"],
)
def test_a_voyage_that_was_left_lasts_as_long_when_the_computer_starts_again(up_s, utc_s, north_m, stays):
    """The receiver's clock tells how long ago she was left; without it the half hour begins with the process."""
    pier, before, going = LatLon((0.7, -0.1)), Voyage(), Voyage()
    away = at_north(pier, 200.0)
    before.armed(0, pier)
    before.disarmed(50_000_000, away, by_operator=True)
    before.hears_time(60_000_000, 1_010_000_000)
    assert before.left == (away, 1_000_000_000)
    going.resume(pier, None, before.left)
    start_us, end_us = 7_000_000_000, 7_000_000_000 + round(up_s * 1e6)
    going.hears_time(start_us, None)
    going.passes(at_north(pier, north_m))
    going.hears_time(end_us, None if utc_s is None else round(utc_s * 1e6))
    assert going.has_begun(end_us) is stays
    assert going.keeps_home(end_us, at_north(pier, north_m), pier) is stays


def test_who_means_the_place_at_sea_sets_home_there(voyage):
    trip = voyage("depth.enabled=false")
    trip.sail(2.5, (120.0, 0.0), after_s=40.0)
    here = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    assert trip.ask(SetHomePosition(None, None)).reason == ""
    trip.mode(Mode.HOLD)
    for arm in (False, True):
        assert trip.ask(Arm(arm=arm)).reason == ""
    assert math.dist(trip.world.app.vehicle.parts.mission.home, here) < 1e-6


def test_a_voyage_that_ends_ashore_leaves_home_where_the_next_one_begins(voyage):
    """Disarmed by the pier, carried along it, and armed again: that is the next voyage."""
    trip = voyage("depth.enabled=false")
    trip.sail(2.5, (40.0, 0.0), after_s=30.0)
    assert 20.0 < trip.distance_m < LANDED_M
    here = trip.world.surroundings.plant.frame.to_geodetic(trip.truth.north_m, trip.truth.east_m)
    trip.mode(Mode.HOLD)
    trip.texts.clear()
    for arm in (False, True):
        assert trip.ask(Arm(arm=arm)).reason == ""
    assert Operator(trip, trip.world.app.vehicle.parts.mission.home).away_m() < 5.0
    assert math.dist(trip.world.app.vehicle.parts.mission.home, here) < 1e-6
    assert not [text for text in trip.texts if "home stays" in text]


@pytest.mark.parametrize(
    ("north_m", "after_s", "stays"),
    [
        (200.0, 60.0, True),
        (30.0, 60.0, False),
        (200.0, 1790.0, True),
        (200.0, 1810.0, False),
        (4_000.0, 1200.0, True),
        (9_000.0, 1200.0, False),
    ],
    ids=["at sea", "by the pier", "long after", "on a trailer", "adrift", "another water by car"],
)
def test_home_stays_as_long_as_the_voyage_lasts(north_m, after_s, stays):
    """An operator has disarmed her 200 m off; where and when she is armed again."""
    pier = LatLon((0.7, -0.1))
    away, end_us = at_north(pier, 200.0), round(after_s * 1e6)
    going = Voyage()
    assert not going.keeps_home(0, pier, pier)
    going.armed(0, pier)
    going.disarmed(0, away, by_operator=True)
    assert going.keeps_home(end_us, at_north(pier, north_m), pier) is stays
    assert not going.keeps_home(end_us, None, pier)


@pytest.mark.parametrize(("hull", "out_s"), [("otter", 20.0), *in_the_soak(("wamv", 60.0), ("blueboat", 5.0))])
def test_home_stays_when_an_operator_disarms_while_the_position_is_lost(hull, out_s):
    """That voyage counted as over: home was moved to the open sea without a word, and "Return to home, 0 m" left her there."""
    helm = Helm("ardurover", "depth.enabled=false", f'vessel="{hull}"', "failsafe.gcs_then_s=10")
    assert helm.command(ARM, 1.0) == 0
    lat, lon = helm.at(120.0, 0.0)
    assert helm.command(REPOSITION, -1.0, 1.0, 0.0, math.nan, lat / 1e7, lon / 1e7) == 0
    helm.run(100.0)
    assert helm.truth.north_m > 90.0
    helm.world.surroundings.plant.sensors.faults.no_fix = True
    helm.run(out_s)
    assert helm.command(ARM, 0.0) == 0
    helm.run(5.0)
    helm.world.surroundings.plant.sensors.faults.no_fix = False
    helm.run(40.0)
    assert helm.command(SET_MODE, 1.0, HOLD) == 0
    assert helm.command(ARM, 1.0) == 0
    helm.run(2.0)
    assert re.search(r"home stays \d+ m away, at ", helm.texts().replace("\n", ""))
    helm.present = False
    helm.run(180.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 5.0


def test_a_voyage_that_is_left_without_a_position_goes_on_where_the_vessel_was_last_known_to_be():
    pier = LatLon((0.7, -0.1))
    for carried_m, stays in ((6_200.0, True), (12_000.0, False)):
        going = Voyage()
        going.armed(0, pier)
        going.passes(at_north(pier, 6_000.0))
        going.passes(None)
        going.disarmed(0, None, by_operator=True)
        assert going.keeps_home(1, at_north(pier, carried_m), pier) is stays


def test_a_boat_that_was_carried_to_another_water_departs_there_and_lands_there():
    """The voyage stayed at the old water: no check of a departure was asked, and landing at the new home did not end it."""
    pier, other = LatLon((0.7, -0.1)), LatLon((0.7013, -0.1))
    going = Voyage()
    going.armed(0, pier)
    going.disarmed(1, at_north(pier, 200.0), by_operator=True)
    assert going.has_begun(2)
    going.passes(other)
    assert not going.has_begun(2), "arming is a departure"
    going.armed(2, other)
    assert going.place == other
    going.disarmed(3, other, by_operator=True)
    assert not going.keeps_home(4, at_north(other, 200.0), other), "she had landed"


@pytest.mark.parametrize(
    ("broken_m", "after_s", "armed_m", "stays"),
    [
        (0.0, 86_400.0, 4_000.0, False),
        (40.0, 1_810.0, 200.0, False),
        (40.0, 60.0, 200.0, True),
        (200.0, 86_400.0, 4_000.0, True),
    ],
    ids=["a day later", "half an hour later", "set out by the current", "broken at sea"],
)
def test_a_failsafe_that_disarms_by_the_pier_does_not_keep_the_voyage_open_for_good(broken_m, after_s, armed_m, stays):
    """A board was switched off at the jetty, the program left on: a day later home was kept 4 km off."""
    pier, end_us = LatLon((0.7, -0.1)), round(after_s * 1e6)
    going = Voyage()
    going.armed(0, pier)
    going.disarmed(0, at_north(pier, broken_m), by_operator=False)
    going.disarmed(end_us, at_north(pier, armed_m), by_operator=False)
    assert going.keeps_home(end_us, at_north(pier, armed_m), pier) is stays
    assert going.has_begun(end_us) is stays


def test_a_failsafe_does_not_open_a_voyage_again_that_an_operator_has_left():
    """What disarms a vessel that is disarmed already breaks nothing."""
    pier = LatLon((0.7, -0.1))
    away = at_north(pier, 200.0)
    going = Voyage()
    going.armed(0, pier)
    going.disarmed(0, away, by_operator=True)
    going.disarmed(1, away, by_operator=False)
    assert going.keeps_home(2, away, pier)
    assert not going.keeps_home(86_400_000_000, away, pier)


def at_north(place, north_m):
    return LatLon(LocalFrame(*place).to_geodetic(north_m, 0.0))


def test_a_voyage_goes_on_farther_from_home_than_the_longest_leg(voyage):
    """She was taken for carried there: "the voyage before began 5 km away: it is over", and Return led 0 m."""
    store = MemoryStore()
    trip = voyage("depth.enabled=false", store=store)
    home = at_north(trip.world.surroundings.plant.frame.to_geodetic(0.0, 0.0), -5_200.0)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.ask(SetHomePosition(*home)).reason == ""
    trip.run(1.0)
    again = voyage("depth.enabled=false", store=store)
    assert any("voyage goes on" in text for text in again.texts)
    assert not [text for text in again.texts if "it is over" in text]
    assert again.ask(Arm(arm=True)).reason == ""
    assert again.world.app.vehicle.parts.mission.home == pytest.approx(home)


def test_where_a_voyage_was_last_seen_is_kept_to_half_a_kilometre():
    pier, going = LatLon((0.7, -0.1)), Voyage()
    going.armed(0, pier)
    kept = set()
    for out_m in range(0, 9_001, 100):
        here = at_north(pier, float(out_m))
        going.passes(here)
        kept.add(going.lasting)
        after = Voyage()
        after.resume(*going.lasting)
        assert not after.carried_m(here, pier)
        assert not after.carried_m(pier, pier), "brought home with the computer off"
        assert out_m < 6_000 or not after.carried_m(at_north(pier, out_m + 4_000.0), pier), "adrift"
        assert after.carried_m(at_north(pier, out_m + 9_000.0), pier) > 8_000.0, "another water, by car"
    assert len(kept) < 20, "one line on the disk each"


def test_a_boat_that_was_carried_away_does_not_go_on_with_its_last_voyage(voyage):
    store = MemoryStore()
    voyage("depth.enabled=false", store=store).sail(1.5, (60.0, 0.0), after_s=5.0)
    again = voyage("depth.enabled=false", "operator.gcs_required=true", "world.latitude_deg=52.0", store=store)
    assert any("it is over, and home is here" in text for text in again.texts)
    assert "no ground station heard" in again.ask(Arm(arm=True)).reason
    here = again.world.surroundings.plant.frame.to_geodetic(again.truth.north_m, again.truth.east_m)
    assert math.dist(again.world.app.vehicle.parts.mission.home, here) < 1e-6
