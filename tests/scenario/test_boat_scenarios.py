"""What any MAVLink boat is expected to do and no other test here shows, on the whole vessel. The table is docs/BOAT-SCENARIOS.md."""

from __future__ import annotations

import math

import pytest

import config
from companion.core.hull.statics import throttle_to_speed
from companion.io.links.link import Received
from companion.settings.schema import EndpointSettings, load
from mavlink_bridge.language.messages import Action, Mode
from mavlink_bridge.mavlink.wire.codec import decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.fake_vessel import Bench, Station
from tests.world_station import GCS_HEARTBEAT, Helm

PREARM = 0x10000000


def wp(helm, north_m, east_m, frame=3):
    return (frame, 16, 0.0, 0.0, 0.0, 0.0, *helm.at(north_m, east_m), 0.0)


def sticks(helm, seconds, *, ahead=0, yaw=0):
    """Hold the sticks, twenty times a second."""
    for _ in range(round(seconds * 20)):
        helm.link.write(0, helm.gcs.codec.encode(dialect.MAVLink_manual_control_message(1, 0, 0, ahead, yaw, 0)))
        helm.step()


def by_hand(helm):
    """Ask for Manual in the face's own numbers; return the result."""
    return helm.command(176, 1, 0) if helm.persona == "ardurover" else helm.command(176, 209, 1, 0, math.nan)


def sog_mps(helm):
    return math.hypot(helm.truth.vn_mps, helm.truth.ve_mps)


@pytest.fixture(params=["ardurover", "generic"])
def helm(request):
    return Helm(request.param)


# Connections


def test_twelve_links_are_served_at_once_and_nothing_crosses_from_one_to_another():
    """ManyMAVLinkConnections, PrivateChannel: no message of a station is passed on; there is no forwarding at all."""
    settings = load(config.path("sim.toml"), [], SimSettings)
    more = [
        EndpointSettings(name=f"more{n}", url=f"udp://127.0.0.1:{20_000 + n}", persona=("ardurover", "generic")[n % 2])
        for n in range(9)
    ]
    world = World(settings.model_copy(update={"endpoints": (*settings.endpoints, *more)}), 1)
    links = [world.ground(item.name) for item in world.settings.endpoints]
    stations = [Station(system=100 + n) for n in range(len(links))]
    heard = [Deframer() for _ in links]
    frames = [[] for _ in links]
    ask = dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
    private = dialect.MAVLink_statustext_message(6, b"for nobody else")
    for tick in range(100):
        for link, station in zip(links, stations, strict=True):
            if tick % 20 == 0:
                link.write(0, station.codec.encode(GCS_HEARTBEAT))
                link.write(0, station.codec.encode(private))
            if tick == 50:
                link.write(0, station.codec.encode(ask))
        world.step()
        for link, deframer, kept in zip(links, heard, frames, strict=True):
            for event in link.poll(world.now_us):
                if isinstance(event, Received):
                    kept += deframer.receive(event.data, world.now_us)
    assert len(links) == 12
    for kept in frames:
        assert {frame.system for frame in kept} == {1}, "only the vessel's own"
        names = [decode(frame).get_type() for frame in kept]
        assert names.count("HEARTBEAT") >= 4
        assert names.count("AUTOPILOT_VERSION") == 1
        assert not any("nobody" in decode(frame).text for frame in kept if frame.message_id == 253)


def test_rates_are_set_and_asked_for_by_both_forms_of_a_command():
    """SET_MESSAGE_INTERVAL, MESSAGE_INTERVAL_COMMAND_INT, GetMessageInterval."""
    bench = Bench("ardurover")
    for rate, put in ((5, bench.long), (10, bench.int)):
        put(511, 30, 1e6 / rate)
        bench.gcs.clear()
        bench.run(10)
        assert len(bench.gcs.all("ATTITUDE")) == pytest.approx(10 * rate, abs=1)
        for again in (bench.long, bench.int):
            again(510, 30)
            assert bench.gcs.last("MESSAGE_INTERVAL").interval_us == 1_000_000 // rate


def test_the_high_latency_summary_agrees_with_the_full_messages():
    """HIGH_LATENCY2 on one link against the full telemetry of another, of a boat under way."""
    helm = Helm("generic", "endpoints.0.profile=high_latency")
    slow, summary = helm.world.ground("gcs"), Station()
    assert helm.upload([wp(helm, 200, 100)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    slow.write(0, summary.codec.encode(dialect.MAVLink_command_long_message(1, 1, 2600, 0, 1, 0, 0, 0, 0, 0, 0)))
    for _ in range(20 * 40):
        helm.step()
        for event in slow.poll(helm.world.now_us):
            if isinstance(event, Received):
                summary.receive(event.data, helm.world.now_us)
        if summary.all("HIGH_LATENCY2") and helm.now_s > 20.0:
            break
        summary.clear()
    short = summary.last("HIGH_LATENCY2")
    place, hud = helm.gcs.last("GLOBAL_POSITION_INT"), helm.gcs.last("VFR_HUD")
    assert math.hypot(short.latitude - place.lat, short.longitude - place.lon) < 300, "3 m: half a second's way"
    assert short.heading * 2 == pytest.approx(hud.heading, abs=4)
    assert short.groundspeed / 5 == pytest.approx(hud.groundspeed, abs=0.3)
    assert short.custom_mode == 10, "Auto by the Rover's numbers, which are this endpoint's"
    assert short.wp_num == helm.gcs.last("MISSION_CURRENT").seq + 1, "the Rover face counts home"


# Arming


def test_it_starts_disarmed_in_hold_and_at_rest(helm):
    """InitialMode: always Hold."""
    beat = helm.gcs.all("HEARTBEAT")[0]
    assert not beat.base_mode & 128
    assert beat.custom_mode == (4 if helm.persona == "ardurover" else 0x03040000)
    assert set(helm.pulses_us) == {1500}


@pytest.mark.parametrize("fault", ["no_fix", "heading_silent"])
def test_a_reason_against_arming_is_told_and_goes_with_its_cause(helm, fault):
    """CompassPrearms, REQUIRE_LOCATION_FOR_ARMING: the text names it, the bit shows it, both clear by themselves."""
    faults = helm.world.surroundings.plant.sensors.faults
    setattr(faults, fault, True)
    helm.run(6.0)
    assert helm.command(400, 1.0) == 1
    assert {"no_fix": "No position", "heading_silent": "No heading"}[fault].lower() in helm.texts().lower()
    assert not helm.gcs.last("SYS_STATUS").onboard_control_sensors_health & PREARM
    setattr(faults, fault, False)
    helm.run(6.0)
    assert helm.gcs.last("SYS_STATUS").onboard_control_sensors_health & PREARM
    assert helm.command(400, 1.0) == 0


def test_a_stop_switch_pressed_before_the_start_blocks_arming_until_it_is_released(helm):
    """EStopAtBoot, SafetySwitch."""
    board = helm.world.surroundings.plant.board
    board.set_estop(True)
    helm.run(1.0)
    assert helm.command(400, 1.0) == 1
    assert helm.command(400, 1.0, 21196.0) == 1, "not by force either"
    assert "emergency stop" in helm.texts().lower()
    board.set_estop(False)
    helm.run(3.0)
    assert helm.command(400, 1.0) == 0


# By hand


def test_full_stick_gives_its_speed_and_no_fault(helm):
    """DriveMaxRCIN."""
    assert by_hand(helm) == 0
    assert helm.command(400, 1.0) == 0
    sticks(helm, 25.0, ahead=1000)
    limit = helm.world.app.settings.steering.seed.max_thruster_output
    assert helm.world.snapshot.output.thruster_port == pytest.approx(limit), "full stick is all that is configured"
    expected_mps = throttle_to_speed(helm.world.app.vehicle.parts.vessel, limit)
    assert 0.8 * expected_mps < sog_mps(helm) < 1.2 * expected_mps
    assert helm.world.snapshot.action is Action.NONE
    assert all(1000 <= pulse <= 2000 for pulse in helm.pulses_us)


def test_yaw_alone_turns_the_boat_where_it_lies(helm):
    """SkidSteer: one thruster ahead, the other astern."""
    assert by_hand(helm) == 0
    assert helm.command(400, 1.0) == 0
    sticks(helm, 1.0, yaw=1000)
    output = helm.world.snapshot.output
    assert output.thruster_port > 0.1
    assert output.thruster_starboard < -0.1
    before, turned = math.degrees(helm.truth.psi_rad), 0.0
    for _ in range(20):
        sticks(helm, 0.5, yaw=1000)
        turned += (math.degrees(helm.truth.psi_rad) - before + 180) % 360 - 180
        before = math.degrees(helm.truth.psi_rad)
    assert turned > 180.0, "to starboard"
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 6.0


def test_sticks_do_not_move_a_plan(helm):
    """StickMixingAuto the other way about: a stick that is touched must not shift the track."""
    assert helm.upload([wp(helm, 150, 0)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    helm.run(20.0)
    errors = []
    for _ in range(15):
        sticks(helm, 1.0, ahead=-1000, yaw=1000)
        errors.append(abs(helm.truth.east_m))
    assert helm.world.snapshot.mode is Mode.AUTO
    assert max(errors) < 0.6


def test_a_rudder_that_sticks_costs_accuracy_and_not_the_plan(helm):
    """Rudder failure: the thrusters and the other rudder carry it to the end."""
    assert helm.upload([wp(helm, 60, 0), wp(helm, 60, 40)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    helm.run(10.0)
    helm.world.surroundings.plant.vessel.rudder_stuck_rad = [math.radians(15.0), None]
    errors = []
    while helm.truth.north_m < 50.0:
        helm.step()
        errors.append(abs(helm.truth.east_m))
        assert helm.now_s < 120.0
    assert max(errors) < 2.0
    helm.until(lambda: math.dist((helm.truth.north_m, helm.truth.east_m), (60, 40)) < 3.0, 90.0)


# Plans and return


def test_a_plan_in_every_frame_that_a_station_uses_is_sailed(helm):
    """DriveEachFrame, MissionFrames: heights mean nothing to a boat, places do."""
    points = [(15, 0, 0), (15, 15, 3), (0, 15, 5), (0, 30, 6), (15, 30, 10), (15, 45, 11)]
    assert helm.upload([wp(helm, north, east, frame) for north, east, frame in points]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    left = [(north, east) for north, east, _ in points]
    while left:
        north, east = left[0]
        helm.until(lambda at=(north, east): math.dist((helm.truth.north_m, helm.truth.east_m), at) < 3.0, 60.0)
        left.pop(0)


def test_the_return_keeps_its_own_speed(helm):
    """RTL_SPEED."""
    assert helm.param("RTL_SPEED", 0.8) == pytest.approx(0.8)
    assert helm.upload([wp(helm, 60, 0)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    helm.until(lambda: helm.truth.north_m > 50.0, 90.0)
    assert sog_mps(helm) > 1.2
    assert helm.command(20) == 0
    helm.run(15.0)
    speeds = []
    while helm.truth.north_m > 12.0:
        helm.step()
        speeds.append(sog_mps(helm))
    assert 0.7 < sum(speeds) / len(speeds) < 0.9
    assert max(speeds) < 1.0
    helm.until(lambda: math.hypot(helm.truth.north_m, helm.truth.east_m) < 3.0, 60.0)


def test_a_home_that_was_moved_is_reported_and_returned_to(helm):
    """SetHome, GET_HOME_POSITION."""
    lat, lon = helm.at(30, 30)
    assert helm.command(179, 0, 0, 0, 0, lat / 1e7, lon / 1e7) == 0
    helm.gcs.clear()
    assert helm.command(410) == 0
    home = helm.gcs.last("HOME_POSITION")
    assert math.hypot(home.latitude - lat, home.longitude - lon) < 300, "a COMMAND_LONG carries 32-bit degrees"
    helm.run(2.0)
    here, place = helm.gcs.last("LOCAL_POSITION_NED"), helm.gcs.last("GLOBAL_POSITION_INT")
    assert math.dist((here.x, here.y), (0, 0)) < 5.0
    assert (home.x - here.x, home.y - here.y, home.z) == pytest.approx((30.0, 30.0, 0.0), abs=4.0)
    assert home.altitude == pytest.approx(place.alt - place.relative_alt, abs=500)
    assert helm.command(512, 49) == 0
    origin = helm.gcs.last("GPS_GLOBAL_ORIGIN")
    x, y = helm.at(here.x, here.y)
    assert (origin.latitude + x - helm.at(0, 0)[0], origin.longitude + y - helm.at(0, 0)[1]) == pytest.approx(
        (place.lat, place.lon), abs=100
    )
    assert helm.command(400, 1.0) == 0
    assert helm.command(20) == 0
    helm.until(lambda: math.dist((helm.truth.north_m, helm.truth.east_m), (30, 30)) < 4.0, 90.0)


def test_a_station_that_comes_back_finds_the_boat_holding_and_its_plan_where_it_stood(helm):
    """GCSFailsafe: recovery is the operator's decision, not the link's."""
    assert helm.upload([wp(helm, 30, 0), wp(helm, 150, 0)]) == 0
    assert helm.command(400, 1.0) == 0
    assert helm.command(300) == 0
    helm.until(lambda: helm.world.snapshot.progress.seq == 1, 60.0)
    helm.present = False
    helm.until(lambda: helm.world.snapshot.mode is Mode.HOLD, 8.0)
    helm.run(5.0)
    helm.present = True
    helm.run(10.0)
    assert helm.world.snapshot.mode is Mode.HOLD
    assert helm.world.snapshot.armed
    before = helm.truth.north_m
    assert helm.command(193, 1.0) == 0
    helm.until(lambda: helm.truth.north_m > before + 20.0, 60.0)
    assert helm.world.snapshot.progress.seq == 1
