"""Sentences of the seed that only the whole vessel can show: its silent board in telemetry, gains changed under way."""

from __future__ import annotations

from companion.io.links.link import Received
from mavlink_bridge.language.requests import Arm, GuidedHeading, SetParameter
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.board.arduino_twin import ArduinoTwin
from sitl.plant import SimVessel
from sitl.plant.library import load_vessel
from tests.scenario.test_actuators_in_the_loop import ask, make_world


def guided(board, *overrides):
    world = make_world(board, *overrides)
    ground, deframer, heard = world.ground(world.settings.endpoints[0].name), Deframer(), {}
    world.run(6.0)
    for body in (Arm(arm=True), GuidedHeading(0.5, speed_mps=1.0)):
        assert ask(world, body).reason == ""

    def run(seconds):
        for _ in range(round(seconds * 20)):
            world.step()
            for event in ground.poll(world.now_us):
                frames = deframer.receive(event.data, world.now_us) if isinstance(event, Received) else []
                heard.update((message.get_type(), message) for frame in frames if (message := decode(frame)))
        return heard

    return world, run


def test_the_originals_board_shows_in_servo_output_raw():
    """It was 0, 0, 0, 0 for the whole run."""
    world, run = guided(ArduinoTwin(level1=False), 'actuators.board.level="0"')
    shown = run(8.0)["SERVO_OUTPUT_RAW"]
    pins = world.surroundings.plant.board.pulses_us
    pulses = (shown.servo1_raw, shown.servo2_raw, shown.servo3_raw, shown.servo4_raw)
    assert pulses[0] > 1520
    assert all(abs(told - pin) < 60 for told, pin in zip(pulses, pins, strict=True)), "up to a second old"
    assert shown.time_usec == 0


def test_gains_are_changed_under_way_and_both_integrals_begin_anew():
    world, run = guided(ArduinoTwin(), "steering.profile=seed")
    run(15.0)
    before = world.snapshot.trace
    assert before.speed_i > 0.1
    assert ask(world, SetParameter("SEED_HDG_P", 1.2)).reason == ""
    after = world.snapshot.trace
    assert abs(after.speed_i) < 0.05, "0.3 s of it at most"
    assert after.heading_p == 1.2 * after.heading_error_rad
    assert ask(world, SetParameter("SEED_HDG_P", -1.0)).reason != ""


def test_rudders_turn_the_hull_which_they_did_not_in_the_originals_simulator():
    turning = []
    for stuck_rad in (None, 0.0):
        hull = SimVessel(load_vessel("otter"))
        hull.rudder_stuck_rad = [stuck_rad, stuck_rad]
        for _ in range(1_000):
            hull.step(0.02, 0.65, 0.35, 0.15, 0.15)
        turning.append(hull.r_radps)
    assert turning[0] > 1.2 * turning[1] > 0.0
