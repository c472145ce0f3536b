"""A small client of ArduPilot's JSON physics interface against our hull."""

import json
import math
import random
import socket
import struct

import pytest

from sitl.plant.json_physics import JsonPhysics, answer
from sitl.plant.library import load_vessel
from sitl.plant.water import WaterConfig

RATE_HZ = 200


class Client:
    """Sends what ArduPilot sends: magic, frame rate, frame count, pulses."""

    def __init__(self, physics, channels=16):
        self.physics, self.frame, self.channels = physics, 0, channels

    def packet(self, port=1500, rudder=1500, starboard=1500):
        magic = 18458 if self.channels == 16 else 29569
        pulses = [port, rudder, starboard, rudder] + [0] * (self.channels - 4)
        return struct.pack(f"<HHI{self.channels}H", magic, RATE_HZ, self.frame, *pulses)

    def step(self, **pulses):
        self.frame += 1
        return self.read(self.physics.receive(self.packet(**pulses)))

    @staticmethod
    def read(reply):
        assert reply.startswith(b"\n")
        assert reply.endswith(b"\n")
        assert reply.count(b"\n") == 2
        return json.loads(reply)


def physics(**water):
    return JsonPhysics(load_vessel("plant_b"), WaterConfig(**water))


def test_full_ahead_reaches_top_speed_in_simulated_time():
    client = Client(physics())
    for _ in range(30 * RATE_HZ):
        state = client.step(port=2000, starboard=2000)
    assert state["timestamp"] == pytest.approx(30.0)
    assert state["velocity"] == pytest.approx([3.08, 0.0, 0.0], abs=0.02)
    assert state["position"][0] > 80.0
    assert state["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -9.80665], abs=1e-3)


@pytest.mark.parametrize(("pulses", "sign"), [({"port": 1800, "starboard": 1400}, 1), ({"rudder": 1200}, -1)])
def test_thrusters_and_rudders_turn_it(pulses, sign):
    client = Client(physics())
    for _ in range(4 * RATE_HZ):
        state = client.step(**({"port": 1700, "starboard": 1700} | pulses))
    assert math.copysign(1, state["attitude"][2]) == sign
    assert math.copysign(1, state["imu"]["gyro"][2]) == sign


def test_acceleration_is_the_derivative_of_velocity():
    client = Client(physics())
    speed, area = 0.0, 0.0
    for _ in range(2 * RATE_HZ):
        state = client.step(port=2000, starboard=2000)
        area += state["imu"]["accel_body"][0] / RATE_HZ
        speed = state["velocity"][0]
    assert area == pytest.approx(speed, rel=1e-6)


def test_a_repeated_frame_is_answered_without_a_step():
    client = Client(physics())
    client.step(port=2000, starboard=2000)
    again = client.read(client.physics.receive(client.packet(port=2000, starboard=2000)))
    assert again["timestamp"] == pytest.approx(1 / RATE_HZ)


def test_a_count_that_starts_anew_is_a_new_run():
    client = Client(physics())
    for _ in range(1000):
        client.step(port=2000, starboard=2000)
    client.frame = 0
    state = client.step()
    assert state["timestamp"] == pytest.approx(1 / RATE_HZ)
    assert state["position"][0] == pytest.approx(0.0, abs=1e-6)


def test_thirty_two_channels_are_understood():
    assert Client(physics(), channels=32).step(port=2000)["timestamp"] > 0.0


def test_current_carries_it_after_the_start():
    client = Client(physics(current_mps=0.5, current_to_deg=90.0, start_s=1.0))
    for _ in range(3 * RATE_HZ):
        state = client.step()
    assert state["velocity"][1] == pytest.approx(0.5, abs=0.01)
    assert state["position"][1] == pytest.approx(1.0, abs=0.02)


def test_odd_packets_are_dropped():
    physics_, rng = physics(), random.Random(1)
    for size in (0, 1, 2, 39, 41, 40, 72, 500):
        assert physics_.receive(rng.randbytes(size)) is None
    assert physics_.t_s == 0.0


def test_over_a_real_socket():
    client = Client(physics())
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer,
    ):
        server.bind(("127.0.0.1", 0))
        peer.settimeout(5.0)
        client.frame = 1
        peer.sendto(client.packet(port=2000, starboard=2000), server.getsockname())
        answer(server, client.physics)
        assert Client.read(peer.recv(4096))["timestamp"] == pytest.approx(1 / RATE_HZ)
