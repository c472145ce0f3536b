"""The checks that only a whole vessel under way can show: loiter radius, jumps of the plan, fence, return, links, parameters, fuzz."""

import math
import random

import pytest

from companion.io.keeping.store import MemoryStore
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Station
from tests.world_station import Helm

NAN = math.nan
GEOFENCE = 0x100000
CRUISE = (2, 178, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0)


def wp(helm, north, east):
    return (3, 16, 0.0, 0.0, 0.0, NAN, *helm.at(north, east), 50.0)


def start(helm, *items):
    assert helm.upload([CRUISE, *items]) == 0
    assert helm.command(400, 1) == 0
    assert helm.command(300) == 0


def test_check_20_negative_radius_circles_counter_clockwise(persona):
    helm = Helm(persona)
    start(helm, (3, 18, 2.0, 0.0, -20.0, 1.0, *helm.at(0, 30), 0.0))
    helm.until(lambda: helm.world.snapshot.path.on_path, 60)
    errors, turned, last = [], 0.0, None
    while helm.world.snapshot.mode is Mode.AUTO and turned > -4 * math.pi + 0.5:
        helm.step()
        north, east = helm.truth.north_m, helm.truth.east_m - 30.0
        errors.append(math.hypot(north, east) - 20.0)
        bearing = math.atan2(east, north)
        turned += math.remainder(bearing - last, math.tau) if last is not None else 0.0
        last = bearing
        assert helm.now_s < 300
    assert turned < -3.5 * math.pi, "counter-clockwise, both laps"
    assert math.sqrt(sum(e * e for e in errors) / len(errors)) < 1.0
    assert helm.gcs.last("ORBIT_EXECUTION_STATUS").radius == pytest.approx(-20.0, abs=0.1)


def test_check_45_an_eight_is_reported_as_one_and_not_as_a_circle(persona):
    helm = Helm(persona)
    x, y = helm.at(0, 40)
    start(helm, (3, 35, -60.0, 20.0, 0.0, 0.5, x, y, 0.0))
    helm.until(lambda: helm.world.snapshot.path.on_path, 90)
    helm.gcs.clear()
    helm.run(20.0)
    told = helm.gcs.all("FIGURE_EIGHT_EXECUTION_STATUS")
    assert len(told) >= 19, "once a second, on the straight parts too"
    assert (told[0].major_radius, told[0].minor_radius, told[0].x, told[0].y) == (-60.0, 20.0, x, y)
    assert told[0].orientation == pytest.approx(0.5)
    assert not helm.gcs.all("ORBIT_EXECUTION_STATUS"), "the arcs of an eight have other centres"


def test_check_28_an_upload_under_way_gives_no_kick(persona):
    """The rule: the new plan takes over at the same item; propulsion does not jump while it is stored."""
    helm = Helm(persona)
    points = [wp(helm, 60, 0), wp(helm, 60, 60), wp(helm, 0, 60)]
    start(helm, *points)
    helm.run(20)
    seq = helm.gcs.last("MISSION_CURRENT").seq
    before = helm.pulses_us
    assert helm.upload([CRUISE, *points, wp(helm, 0, 0)]) == 0
    jumps = []
    for _ in range(40):
        helm.step()
        now = helm.pulses_us
        jumps.append(max(abs(a - b) for a, b in zip(before[:2], now[:2], strict=True)))
        before = now
    assert max(jumps) < 60.0, "microseconds at the thrusters, tick to tick"
    assert helm.world.snapshot.mode is Mode.AUTO
    assert helm.gcs.last("MISSION_CURRENT").seq == seq
    assert helm.gcs.last("MISSION_CURRENT").total == 5


def test_check_31_a_breach_is_told_once_and_heals(persona):
    helm = Helm(persona)
    start(helm, wp(helm, 200, 0))
    helm.run(15)
    here = helm.at(helm.truth.north_m, helm.truth.east_m)
    assert helm.upload([(0, 5004, 15.0, 0.0, 0.0, 0.0, *here, 0.0)], 1) == 0
    helm.until(lambda: any(m.breach_status for m in helm.gcs.all("FENCE_STATUS")), 10)
    helm.run(2)
    assert not helm.gcs.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert helm.gcs.last("FENCE_STATUS").breach_count >= 1
    helm.run(5)
    told = [m.text for m in helm.gcs.all("STATUSTEXT") if "fence" in m.text.lower()]
    assert told
    assert len(told) == len(set(told)), "each text once"
    assert helm.upload([], 1) == 0
    helm.run(3)
    assert helm.gcs.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE
    assert not helm.gcs.last("FENCE_STATUS").breach_status


def test_check_33_the_fence_switch_shows(persona):
    helm = Helm(persona)
    assert helm.upload([(0, 5003, 60.0, 0.0, 0.0, 0.0, *helm.at(0, 0), 0.0)], 1) == 0
    for enable in (0, 1):
        assert helm.command(207, enable) == 0
        helm.run(1.2)
        assert bool(helm.gcs.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE) is bool(enable)


def test_check_32_return_goes_to_the_nearest_rally_point(persona):
    helm = Helm(persona)
    points = [(3, 5100, 0.0, 0.0, 0.0, 0.0, *helm.at(*at), 0.0) for at in ((40, 40), (-200, 0))]
    assert helm.upload(points, 2) == 0
    start(helm, wp(helm, 60, 60))
    helm.until(lambda: helm.truth.north_m > 30, 60)  # nearer to the rally point than to home
    assert helm.command(20) == 0
    helm.until(lambda: math.hypot(helm.truth.north_m - 40, helm.truth.east_m - 40) < 5, 90)
    assert helm.world.snapshot.mode in (Mode.RTL, Mode.HOLD)


def test_check_38_parameters_survive_a_restart(persona):
    store = MemoryStore()
    helm = Helm(persona, store=store)
    assert helm.param("CRUISE_SPEED", 1.25) == 1.25
    helm.run(1)
    again = Helm(persona, store=store)
    again.send(dialect.MAVLink_param_request_read_message(1, 1, b"CRUISE_SPEED", -1))
    assert again.gcs.last("PARAM_VALUE").param_value == 1.25


def test_check_38_a_change_on_one_link_shows_on_the_other(persona):
    helm = Helm(persona)
    other = helm.world.ground({"ardurover": "sdk", "generic": "gcs"}[persona])
    ear = Station(254)
    other.poll(helm.world.now_us)
    assert helm.param("CRUISE_SPEED", 1.75) == 1.75
    helm.run(0.5)
    for event in other.poll(helm.world.now_us):
        ear.receive(getattr(event, "data", b""), 0)
    assert ear.last("PARAM_VALUE").param_value == 1.75
    assert ear.last("PARAM_VALUE").param_id == "CRUISE_SPEED"


def test_check_46_arming_shows_within_1300_ms_and_force_disarms_under_way(persona):
    helm = Helm(persona)
    start(helm, wp(helm, 80, 0))
    helm.run(10)
    assert any(abs(pulse - 1500) > 20 for pulse in helm.pulses_us[:2])
    assert helm.command(400, 0, 21196) == 0
    helm.run(0.3)
    assert not helm.gcs.last("HEARTBEAT").base_mode & 128
    assert all(abs(pulse - 1500) < 1 for pulse in helm.pulses_us[:2])


def test_check_52_mode_changes_show_in_time(persona):
    helm = Helm(persona)
    assert helm.command(400, 1) == 0
    for number, mode in ((4, Mode.HOLD), (0, Mode.MANUAL), (11, Mode.RTL)):
        assert helm.command(176, 1, number, 0) == 0
        helm.run(0.2)
        assert helm.world.snapshot.mode is mode


def test_check_53_no_position_no_return(persona):
    helm = Helm(persona)
    helm.world.surroundings.plant.sensors.faults.gnss_silent = True
    helm.run(6)
    helm.gcs.clear()
    assert helm.command(20) in (1, 2)
    assert "position" in helm.texts().lower() or "fix" in helm.texts().lower()


@pytest.mark.parametrize("seed", range(2))
def test_check_63_fuzz_moves_nothing_while_disarmed(persona, seed):
    helm = Helm(persona)
    dice = random.Random(seed)
    stranger = Station(201)
    numbers = sorted(dialect.mavlink_map)
    for _ in range(200):
        for _ in range(10):
            frame = stranger.codec.seal(dice.choice(numbers), dice.randbytes(dice.randint(1, 255)))
            if dice.random() < 0.2:
                frame = frame[: dice.randrange(len(frame))]
            helm.link.write(0, frame)
        helm.step()
        if not helm.world.snapshot.armed:
            assert all(abs(pulse - 1500) < 1 for pulse in helm.pulses_us[:2])
    assert all(1000 <= pulse <= 2000 for pulse in helm.pulses_us)
    helm.gcs.clear()
    helm.run(5)
    assert len(helm.gcs.all("HEARTBEAT")) >= 4


def test_check_64_all_stations_vanish(persona):
    helm = Helm(persona)
    start(helm, wp(helm, 200, 0))
    helm.run(10)
    helm.present = False
    lost_s = helm.until(lambda: helm.world.snapshot.action >= Action.HOLD, 12)
    assert 3.0 <= lost_s <= 7.0
    helm.run(3)
    assert "ground" in helm.texts().lower() or "station" in helm.texts().lower()
    assert helm.gcs.last("HEARTBEAT").system_status == 5
    helm.present = True
    helm.run(3)
    assert helm.world.snapshot.mode is not Mode.AUTO or helm.world.snapshot.action >= Action.HOLD
    assert helm.command(300) == 0, "the returned station orders it on"
    helm.until(lambda: helm.world.snapshot.action < Action.HOLD and helm.world.snapshot.mode is Mode.AUTO, 5)
    helm.run(3)
    assert any(abs(pulse - 1500) > 20 for pulse in helm.pulses_us[:2])


def test_the_checks_before_arming_are_refused_under_arms(persona):
    """ACCEPTED would say that nothing stands against arming, of a boat that nobody may arm."""
    helm = Helm(persona)
    assert helm.command(401) == 0
    assert helm.command(400, 1) == 0
    helm.run(3.0)
    helm.gcs.clear()
    assert helm.command(401) == 1
    assert "Armed already: these are the checks before arming" in helm.texts().replace("\n", "")
