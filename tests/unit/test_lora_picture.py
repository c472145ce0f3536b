"""What the shore shows of the vessel after fades: right or old, never wrong and fresh."""

import dataclasses
import itertools
import math

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import PlanKind, SetParameter
from mavlink_bridge.radio.codec.state_fields import CLOCK_S
from mavlink_bridge.radio.codec.wire import Kind
from mavlink_bridge.radio.vessel_clock import VesselClock
from tools.benches.lora import settled, survey_items
from tools.lora_rig import Rig, profile


def going_straight(rig):
    """Let the vessel go north at 3 m/s, farther than its circle."""
    circle = rig.vessel.snapshot

    def snapshot(now_us, tick):
        seen = circle(now_us, tick)
        lat_rad = math.radians(41.185 + now_us * 1e-6 * 3.0 / 111_320.0)
        state = dataclasses.replace(seen.state, lat_rad=lat_rad, lon_rad=math.radians(-8.7), sog_mps=3.0)
        return dataclasses.replace(seen, state=state)

    rig.vessel.snapshot = snapshot
    rig.run(120.0)


def error_m(rig):
    """How far the shown position is from where the vessel is."""
    shown, true = rig.twin.state, rig.vessel.snapshot(rig.now_us, 0).state
    return math.hypot((shown.lat_rad - true.lat_rad) * 6.371e6, (shown.lon_rad - true.lon_rad) * 4.8e6)


def deaf_shore(rig, seconds):
    """Let the vessel hear the shore, and not the other way."""
    read = rig.pair.shore.read
    rig.pair.shore.read = lambda: read() and b""
    rig.run(seconds)
    rig.pair.shore.read = read


@pytest.mark.parametrize("fade_s", [300.0, 320.0, 340.0])
def test_after_a_one_way_fade_no_wrong_position_is_shown_as_fresh(fade_s):
    rig = settled()
    going_straight(rig)
    deaf_shore(rig, fade_s)
    worst_m = 0.0
    for _ in range(900):
        rig.run(0.1)
        if rig.twin.is_fresh(rig.now_us):
            worst_m = max(worst_m, error_m(rig))
    assert rig.twin.is_fresh(rig.now_us)
    assert worst_m < 70.0


def test_a_difference_tells_the_status_of_its_key():
    rig = settled()
    while rig.radio.link.last_posted[1][:1] and len(rig.radio.link.last_posted[1]) != 4:
        rig.step()  # differences go: the shore has named a key
    rig.vessel.mode, rig.vessel.armed = Mode.HOLD, False
    while rig.twin.state.mode is not Mode.HOLD:
        rig.step()
    rig.vessel.mode, rig.vessel.armed = Mode.AUTO, True
    deaf_shore(rig, 2.5)  # the key that tells so is lost
    heard_us = rig.twin.state_us
    while rig.twin.state_us == heard_us:
        rig.step()
    assert (rig.twin.state.mode, rig.twin.state.armed) == (Mode.AUTO, True)


@pytest.mark.parametrize("fade_s", [5.0, 15.0, 60.0])
def test_what_the_shore_lacks_is_asked_for_until_it_has_come(fade_s):
    rig = Rig(profile("o-10"))
    rig.vessel.params.set("DEPTH_MIN", 6.5)
    rig.vessel.plans.put(PlanKind.FENCE, survey_items(3))
    while not any(item.origin == "shore" and item.data[0] >> 4 == Kind.REPLY for item in rig.pair.air.log):
        rig.step()  # the vessel has said what it keeps
    rig.pair.air.jammed = True
    rig.run(fade_s)
    rig.pair.air.jammed = False
    rig.run(200.0)
    assert rig.twin.params.get("DEPTH_MIN").value == 6.5
    assert rig.twin.plans.plan_id(PlanKind.FENCE) == rig.vessel.plans.plan_id(PlanKind.FENCE) != 0


def test_what_has_come_is_not_asked_for_again():
    rig = settled()
    rig.vessel.params.set("DEPTH_MIN", 6.5)
    rig.radio.param_changed("DEPTH_MIN")
    rig.run(120.0)
    since_us = rig.now_us
    rig.run(1000.0)
    assert {item.data[0] >> 4 for item in rig.pair.air.log if item.origin == "shore" and item.start_us > since_us} == {
        Kind.BEACON
    }


def test_a_state_for_which_the_hour_has_no_room_is_told_later_as_the_vessel_is_then():
    rig = Rig(profile("n-0.1"), step_us=200_000)
    true_ages_s, came_us = [], []
    while rig.now_us < 2.5 * 3600e6:
        before_us = rig.twin.state_us
        rig.step()
        if rig.now_us == 29 * 60_000_000:
            for number in range(4):
                rig.twin.submit(number, SetParameter("LOIT_RADIUS", 20.0 + number), rig.now_us)
        if rig.twin.state_us != before_us:
            age_s = (rig.now_us // 1_000_000 - rig.twin.state.t_s) % CLOCK_S
            true_ages_s.append(age_s)
            came_us.append(rig.now_us)
            assert rig.twin.age_s(rig.now_us) == pytest.approx(age_s, abs=3.0)
    assert max(true_ages_s) < 5.0
    assert max(later - earlier for earlier, later in itertools.pairwise(came_us)) > (30 + 10) * 60e6


def test_a_late_state_is_as_old_as_the_vessels_clock_says_and_a_long_silence_makes_none_late():
    clock = VesselClock(profile("n-0.1").link)
    assert clock.made_us(4000, 1_000_000_000) == 1_000_000_000
    assert clock.made_us(4, 1_700_000_000) == pytest.approx(1_100_000_000, abs=1e6)
    assert clock.made_us(3, 1_701_000_000) is None
    assert clock.made_us((4 + 3000) % CLOCK_S, 4_100_000_000) == pytest.approx(4_100_000_000, abs=2e6)


def test_a_restarted_vessels_clock_counts_anew():
    rig = Rig(profile("n-0.1"), step_us=200_000)
    rig.run(31 * 60.0)
    rig.start_vessel()
    began_us = rig.now_us
    circle = rig.vessel.snapshot
    rig.vessel.snapshot = lambda now_us, tick: dataclasses.replace(circle(now_us, tick), t_us=now_us - began_us)
    heard_us = rig.twin.state_us
    while rig.twin.state_us == heard_us:
        rig.step()
    # what was spent before the restart leaves the hour within an hour, and the air of five stops is kept free until then
    assert rig.now_us - began_us < 3600e6 + 60e6
    assert rig.twin.age_s(rig.now_us) < 5.0
