"""Sticks, set-points and measurements that come over MAVLink, right ones and absurd ones."""

import math

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from tests.fake_vessel import Bench, Station

NAN = math.nan
LAT, LON = 411_850_000, -87_060_000


@pytest.fixture
def bench():
    made = Bench()
    made.tick()
    return made


def got(bench, kind):
    bench.tick()
    return [request.body for request in bench.vessel.handled if isinstance(request.body, kind)]


@pytest.mark.parametrize(
    ("x", "y", "z", "r", "surge", "yaw"),
    [
        (0, 250, 500, 0, 0.5, 0.25),
        (0, 0, -1000, -400, -1.0, -0.4),
        (0, 32767, 32767, 32767, None, None),
        (300, 100, 32767, 32767, 0.3, 0.1),
        (0, 30000, -32768, 0, -1.0, 1.0),
    ],
)
def test_sticks(bench, x, y, z, r, surge, yaw):
    bench.send(dialect.MAVLink_manual_control_message(1, x, y, z, r, 0))
    sticks = got(bench, ask.ManualInput)
    assert sticks == ([] if surge is None else [ask.ManualInput(pytest.approx(surge), pytest.approx(yaw), 255)])


def test_sticks_for_another_vessel_are_not_ours(bench):
    bench.send(dialect.MAVLink_manual_control_message(2, 0, 0, 500, 0, 0))
    assert not got(bench, ask.ManualInput)


@pytest.mark.parametrize(
    ("steer", "throttle", "means"),
    [(1750, 2000, (1.0, 0.5)), (0, 0, None), (65535, 1500, (0.0, 0.0)), (1500, 100, None), (1100, 900, (-1.0, -0.8))],
)
def test_rc_override(bench, steer, throttle, means):
    bench.send(dialect.MAVLink_rc_channels_override_message(1, 1, steer, 0, throttle, 0, 0, 0, 0, 0))
    sticks = got(bench, ask.ManualInput)
    assert [(s.surge, s.yaw) for s in sticks] == ([] if means is None else [pytest.approx(means)])


def test_an_rc_override_of_one_channel_moves_its_axis_and_leaves_the_other(bench):
    def override(steer, throttle):
        bench.vessel.handled.clear()
        bench.send(dialect.MAVLink_rc_channels_override_message(1, 1, steer, 65535, throttle, *[65535] * 5))
        return [(stick.surge, stick.yaw) for stick in got(bench, ask.ManualInput)]

    assert override(65535, 1700) == [pytest.approx((0.4, 0.0))]
    assert override(1250, 65535) == [pytest.approx((0.4, -0.5))]
    bench.run(0.5)
    assert override(1300, 65535) == [pytest.approx((0.0, -0.4))], "the throttle is older than half a second"
    assert override(65535, 1600) == [pytest.approx((0.2, -0.4))]
    assert override(0, 65535) == []
    assert override(0, 1600) == [pytest.approx((0.2, 0.0))]
    assert override(65535, 65535) == []
    assert override(65535, 2500) == []


def test_two_stations_of_one_number_on_a_link_do_not_replace_each_others_sticks(bench):
    others = [Station(255, component) for component in (190, 230)]
    for surge, station in zip((600, -600), others, strict=True):
        bench.send(dialect.MAVLink_manual_control_message(1, 0, 0, surge, 0, 0), station)
    assert [stick.surge for stick in got(bench, ask.ManualInput)] == [0.6, -0.6], "the vessel judges who has them"
    for steer, throttle, station in ((65535, 1700, others[0]), (1750, 65535, others[1])):
        bench.vessel.handled.clear()
        bench.send(dialect.MAVLink_rc_channels_override_message(1, 1, steer, 65535, throttle, *[65535] * 5), station)
        (stick,) = got(bench, ask.ManualInput)
    assert (stick.surge, stick.yaw) == (0.0, 0.5), "the throttle is another's"


def target(mask, lat=LAT, lon=LON, vx=0.0, vy=0.0, yaw=0.0, frame=6):
    return dialect.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, lat, lon, 0, vx, vy, 0, 0, 0, 0, yaw, 0
    )


POSITION, VELOCITY, NOTHING = 0b110111111000, 0b110111000111, 0b111111111111


def test_a_velocity_of_nothing_is_a_stop_that_keeps_the_stream_alive(bench):
    bench.send(target(VELOCITY | 1 << 10, vx=0.0, vy=0.0))
    (stop,) = got(bench, ask.GuidedHeading)
    assert (stop.psi_rad, stop.speed_mps, stop.stream) == (None, 0.0, True)


def test_guided_positions_and_velocities(bench):
    bench.send(target(POSITION))
    bench.send(target(VELOCITY, vx=0.0, vy=2.0))
    (there,) = got(bench, ask.GuidedTarget)
    (course,) = got(bench, ask.GuidedHeading)
    assert math.degrees(there.lat_rad) == pytest.approx(41.185)
    assert (course.psi_rad, course.speed_mps, course.course, course.stream) == (
        pytest.approx(math.pi / 2),
        2.0,
        True,
        True,
    )


def local(frame, mask=VELOCITY):
    return dialect.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *[0.5] * 11)


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        (target(NOTHING), "neither a position nor a velocity"),
        (target(0b100111111111, yaw=1.0), "neither a position nor a velocity"),
        (target(POSITION, lat=0, lon=0), "position 0, 0 means not set"),
        (target(POSITION, lat=910_000_000), "not on the globe"),
        (target(POSITION, lat=2**31 - 1, lon=2**31 - 1), "not on the globe"),
        (target(POSITION, frame=8), "frame 8 is no global frame"),
        (target(VELOCITY, vx=NAN), "the velocity is no number up to 50 m/s"),
        (target(VELOCITY, vx=1e9), "the velocity is no number up to 50 m/s"),
        (local(7), "local frame 7 is not steered by"),
        (local(8), "local frame 8 is not steered by"),
        (local(9), "local frame 9 is not steered by"),
        (local(12), "local frame 12 is not steered by"),
        (local(1, POSITION), "no local position is steered to"),
    ],
)
def test_absurd_set_points_are_ignored_and_explained_now_and_then(bench, bad, why):
    for _ in range(150):
        bench.send(bad)
        bench.tick()
    assert not got(bench, (ask.GuidedTarget, ask.GuidedHeading))
    assert bench.texts().replace("\n", "").count(why) == 1, "once in 10 s"


@pytest.mark.parametrize("psi_deg", [0.0, 90.0, -135.0])
def test_attitude_set_points_steer(bench, psi_deg):
    half = math.radians(psi_deg) / 2
    bench.send(
        dialect.MAVLink_set_attitude_target_message(
            0, 1, 1, 7, [math.cos(half), 0.0, 0.0, math.sin(half)], 0, 0, 0, 0.4
        )
    )
    (order,) = got(bench, ask.GuidedHeading)
    assert order.psi_rad == pytest.approx(math.radians(psi_deg), abs=1e-6)
    assert order.throttle == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("q", "mask", "thrust", "why"),
    [
        ([0.0] * 4, 7, 0.0, "no attitude"),
        ([NAN] * 4, 7, 0.0, "no attitude"),
        ([1.0, 0, 0, 0], 7, 5.0, "the thrust is not between -1 and 1"),
        ([1.0, 0, 0, 0], 0x87, 0.0, "turn rates alone are not steered by"),
    ],
)
def test_absurd_attitudes_are_ignored_and_explained(bench, q, mask, thrust, why):
    bench.send(dialect.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, 0, 0, 0, thrust))
    assert not got(bench, ask.GuidedHeading)
    assert why in bench.texts().replace("\n", "")


def sonar(current, low=10, high=5000, orientation=25, quality=0):
    return dialect.MAVLink_distance_sensor_message(0, low, high, current, 1, 0, orientation, 0, signal_quality=quality)


def test_another_components_sounder(bench):
    sounder = Station(1, 155)
    for message in (sonar(450), sonar(6000), sonar(450, orientation=0), sonar(300, quality=100), sonar(300, quality=1)):
        bench.send(message, sounder)
    bench.send(sonar(111), Station(77, 155))
    readings = [(body.value_m, body.signal_quality) for body in got(bench, ask.DistanceInput)]
    assert readings == [(4.5, None), (None, None), (3.0, 1.0), (None, 0.0)]


def test_a_station_that_does_not_count_its_frames_stays_present():
    bench = Bench()
    for _ in range(40):
        bench.gcs.codec = Codec(255, 190)
        bench.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        bench.tick(19)
        assert bench.vessel.now_us - max(bench.endpoint.heard.values()) < 3_000_000
