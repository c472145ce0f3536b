"""Telemetry rates, truthfulness, byte budget, high latency and time (checks 54 to 59)."""

import itertools
import math

import pytest

from mavlink_bridge.language.messages import EstimatedState, PlanState, SupplyVoltage
from mavlink_bridge.language.snapshot import FenceStatus, Health
from mavlink_bridge.mavlink.persona.config import Budget, EndpointConfig
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench

GEOFENCE, GPS, PREARM = 0x100000, 0x20, 0x10000000


@pytest.mark.parametrize(
    ("name", "at_least_hz"),
    [
        ("ATTITUDE", 4),
        ("GLOBAL_POSITION_INT", 4),
        ("VFR_HUD", 2),
        ("GPS_RAW_INT", 1),
        ("SYS_STATUS", 1),
        ("BATTERY_STATUS", 0.5),
        ("EXTENDED_SYS_STATE", 1),
        ("HOME_POSITION", 0.5),
        ("MISSION_CURRENT", 1),
        ("NAV_CONTROLLER_OUTPUT", 1),
        ("CURRENT_MODE", 0.5),
        ("SERVO_OUTPUT_RAW", 1),
        ("LOCAL_POSITION_NED", 1),
        ("FENCE_STATUS", 1),
        ("SYSTEM_TIME", 0.1),
        ("DISTANCE_SENSOR", 1),
        ("WATER_DEPTH", 1),
        ("ALTITUDE", 1),
    ],
)
def test_check_54_default_rates_without_asking(bench, name, at_least_hz):
    bench.run(2)
    bench.gcs.clear()
    bench.run(20)
    assert len(bench.gcs.all(name)) >= 20 * at_least_hz


def test_check_54_the_values_are_those_of_the_vessel(bench):
    bench.run(3)
    position = bench.gcs.last("GLOBAL_POSITION_INT")
    assert (position.lat, position.lon) == (411_842_063, -86_974_993)
    assert (position.vx, position.vy, position.hdg) == (100, 50, 2865)
    hud = bench.gcs.last("VFR_HUD")
    assert (hud.heading, hud.groundspeed) == (29, pytest.approx(1.1))
    servo = bench.gcs.last("SERVO_OUTPUT_RAW")
    assert (servo.servo1_raw, servo.servo4_raw) == (1500, 1500)
    assert bench.gcs.last("DISTANCE_SENSOR").current_distance == 450
    assert bench.gcs.last("ALTITUDE").bottom_clearance == 4.0
    assert bench.gcs.last("BATTERY_STATUS").voltages[0] == 12_400
    assert bench.gcs.last("GPS_RAW_INT").satellites_visible == 12


def test_check_54_unknown_is_said_as_unknown(bench):
    bench.vessel.changes["supply"] = None
    bench.vessel.changes["fix"] = None
    bench.gcs.clear()
    bench.run(3)
    assert bench.gcs.last("SYS_STATUS").voltage_battery == 0xFFFF
    assert bench.gcs.last("BATTERY_STATUS").battery_remaining == -1
    assert bench.gcs.last("GPS_RAW_INT").satellites_visible == 255
    bench.vessel.changes["supply"] = SupplyVoltage(0, 12.0, 3.0, 0.5)
    bench.run(3)
    assert bench.gcs.last("BATTERY_STATUS").battery_remaining == 50


@pytest.mark.parametrize("rate", [100, 300, 2000])
def test_check_55_the_budget_holds_over_any_ten_seconds(persona, rate):
    bench = Bench(config=EndpointConfig(persona=persona, budget=Budget(rate, 500)))
    sent = []
    for step in range(600):
        before = len(bench.gcs.inbox)
        if step % 20 == 0:
            bench.send(dialect.MAVLink_param_request_list_message(1, 1))
            bench.long(512, 148, confirmation=step // 20)
        bench.tick()
        sent.append(sum(len(bytes(message.get_msgbuf())) for message in bench.gcs.inbox[before:]))
    for start in range(len(sent) - 200):
        assert sum(sent[start : start + 200]) <= rate * 10
    acks = bench.gcs.all("COMMAND_ACK")
    assert len(acks) == 30
    beats = [at for at, m in zip(bench.gcs.times_us, bench.gcs.inbox, strict=True) if m.get_type() == "HEARTBEAT"]
    assert max(later - sooner for sooner, later in itertools.pairwise(beats)) <= 1_500_000


def test_check_54_attitude_as_a_quaternion_when_asked(bench):
    bench.vessel.changes["state"] = EstimatedState(0, phi_rad=0.1, theta_rad=-0.2, psi_rad=2.0)
    bench.long(511, 31, 100_000)
    bench.run(1)
    m = bench.gcs.last("ATTITUDE_QUATERNION")
    assert math.atan2(2 * (m.q1 * m.q4 + m.q2 * m.q3), 1 - 2 * (m.q3**2 + m.q4**2)) == pytest.approx(2.0, abs=1e-6)
    assert math.asin(2 * (m.q1 * m.q3 - m.q4 * m.q2)) == pytest.approx(-0.2, abs=1e-6)
    assert math.atan2(2 * (m.q1 * m.q2 + m.q3 * m.q4), 1 - 2 * (m.q2**2 + m.q3**2)) == pytest.approx(0.1, abs=1e-6)


def test_check_56_without_a_fix_nothing_is_invented(bench):
    bench.vessel.position = False
    bench.tick()
    bench.gcs.clear()
    bench.run(3)
    assert bench.gcs.last("GPS_RAW_INT").fix_type < 2
    assert not bench.gcs.all("GLOBAL_POSITION_INT")
    assert not bench.gcs.all("LOCAL_POSITION_NED")
    status = bench.gcs.last("SYS_STATUS")
    assert status.onboard_control_sensors_present & GPS
    assert not status.onboard_control_sensors_health & GPS


def test_check_57_a_high_latency_link_says_only_what_is_asked(persona):
    bench = Bench(config=EndpointConfig(persona=persona, profile="high_latency", high_latency_period_s=5.0))
    bench.run(10)
    assert not bench.gcs.inbox
    bench.long(2600, 1)
    bench.run(20)
    kinds = {message.get_type() for message in bench.gcs.inbox}
    assert kinds == {"COMMAND_ACK", "HIGH_LATENCY2"}
    assert 4 <= len(bench.gcs.all("HIGH_LATENCY2")) <= 5
    summary = bench.gcs.last("HIGH_LATENCY2")
    assert (summary.type, summary.groundspeed, summary.latitude) == (11, 6, 411_842_063)
    assert summary.custom_mode == (4 if persona == "ardurover" else 0x0304)
    bench.long(400, 1)
    bench.tick()
    assert bench.acked(400) == [0]
    bench.long(2600, 0)
    bench.gcs.clear()
    bench.run(20)
    assert not bench.gcs.inbox


def test_check_57_elsewhere_there_is_nothing_to_switch(bench):
    bench.long(2600, 0)
    bench.long(2600, 1)
    assert bench.acked(2600) == [0, 2]


def test_check_58_timesync(bench):
    bench.gcs.clear()
    bench.send(dialect.MAVLink_timesync_message(0, 123456789))
    (answer,) = bench.gcs.all("TIMESYNC")
    assert (answer.ts1, answer.tc1) == (123456789, bench.vessel.now_us * 1000)
    assert (answer.target_system, answer.target_component) == (255, 190)
    bench.send(dialect.MAVLink_timesync_message(55, 66))
    assert len(bench.gcs.all("TIMESYNC")) == 1


def test_check_59_a_stations_clock_is_not_ours(bench):
    bench.long(400, 1)
    bench.tick()
    bench.gcs.clear()
    for _ in range(2):
        bench.send(dialect.MAVLink_system_time_message(1, 2))
    bench.run(20)
    times = bench.gcs.all("SYSTEM_TIME")
    assert 2 <= len(times) <= 20
    assert all(later.time_boot_ms > sooner.time_boot_ms for sooner, later in itertools.pairwise(times))
    assert all(later.time_unix_usec > sooner.time_unix_usec > 1e15 for sooner, later in itertools.pairwise(times))
    assert not bench.vessel.handled[1:]


def test_check_59_boot_time_wraps(bench):
    bench.vessel.now_us = (2**32 - 500) * 1000
    bench.run(2)
    assert bench.gcs.last("ATTITUDE").time_boot_ms < 5000


def test_check_31_fence_bits(bench):
    bench.run(2)
    status = bench.gcs.last("SYS_STATUS")
    assert status.onboard_control_sensors_health & GEOFENCE, "no fence: healthy"
    assert status.onboard_control_sensors_health & PREARM
    good = Health(gps=True, heading=True, attitude=True, prearm_ok=True, fence_enabled=True)
    bench.vessel.changes |= {
        "health": Health(gps=True, heading=True, fence_ok=False, fence_enabled=True),
        "fence": FenceStatus(breached=True, breach_count=1, breach_type=3),
    }
    bench.tick()
    assert bench.gcs.last("FENCE_STATUS").breach_status == 1
    status = bench.gcs.last("SYS_STATUS")
    assert not status.onboard_control_sensors_health & GEOFENCE
    assert status.onboard_control_sensors_enabled & GEOFENCE
    bench.vessel.changes |= {"health": good, "fence": FenceStatus(breach_count=1)}
    bench.tick()
    assert bench.gcs.last("SYS_STATUS").onboard_control_sensors_health & GEOFENCE


def test_check_33_fence_switch(bench):
    bench.long(207, 1)
    bench.tick()
    bench.long(207, 0)
    bench.tick()
    assert bench.acked(207) == [0, 0]
    assert [request.body.enable for request in bench.vessel.handled] == [True, False]
    bench.vessel.changes["health"] = Health(fence_enabled=True)
    bench.tick()
    assert bench.gcs.last("SYS_STATUS").onboard_control_sensors_enabled & GEOFENCE


def test_flying_is_under_way(bench):
    bench.run(2)
    assert bench.gcs.last("EXTENDED_SYS_STATE").landed_state == 1
    bench.vessel.armed = True
    bench.run(2)
    assert bench.gcs.last("EXTENDED_SYS_STATE").landed_state == 2
    assert bench.gcs.last("HEARTBEAT").system_status == 4


def test_applied_pulses_are_not_made_up(bench):
    from mavlink_bridge.language.messages import ActuatorStatus

    bench.vessel.changes["actuator"] = ActuatorStatus(0, connected=False, applied_us=(1600, 1600, 1500, 1500))
    bench.run(2)
    assert bench.gcs.last("SERVO_OUTPUT_RAW").servo1_raw == 0


def test_a_board_that_can_never_tell_shows_what_was_commanded(bench):
    from mavlink_bridge.language.messages import ActuatorStatus

    bench.vessel.changes["actuator"] = ActuatorStatus(0, True, level=0, commanded_us=(1600, 1620, 1450, 1550))
    bench.run(2)
    found = bench.gcs.last("SERVO_OUTPUT_RAW")
    assert (found.servo1_raw, found.servo2_raw, found.servo3_raw, found.servo4_raw) == (1600, 1620, 1450, 1550)
    assert found.time_usec == 0
    bench.vessel.changes["actuator"] = ActuatorStatus(0, False, level=0, commanded_us=(1600, 1620, 1450, 1550))
    bench.run(2)
    assert bench.gcs.last("SERVO_OUTPUT_RAW").servo1_raw == 0


def test_a_finished_mission_is_complete(bench):
    bench.vessel.plan_state = PlanState.COMPLETE
    bench.run(1)
    assert bench.gcs.last("MISSION_CURRENT").mission_state in (1, 5)
