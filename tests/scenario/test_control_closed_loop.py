"""The loop closed on the simulated hull with ideal sensors: the first things a boat must do, in current and wind."""

import math

import pytest

from companion.core.guide.paths import Line
from companion.core.steer.law import SeedConfig, SteeringConfig
from companion.core.steer.pid import PidGains
from mavlink_bridge.language.figures import Circle, Hover
from mavlink_bridge.language.messages import Loiter, LoiterDirection
from sitl.plant.library import load_vessel
from sitl.plant.water import WaterConfig
from tools.benches.cells.control_loop import ControlLoop, Setup

OTTER = load_vessel("otter")
SWAPPED = SteeringConfig(
    profile="seed",
    seed=SeedConfig(
        heading_gains=PidGains(kp=1.8, ki=0.005, kd=0.4),
        speed_gains=PidGains(kp=0.6, ki=0.15),
        low_speed_thruster_share=0.8,
        high_speed_thruster_share=0.2,
    ),
)
MODEL = SteeringConfig()
BREEZE = WaterConfig(current_mps=0.3, wind_mps=4.0, wave_height_m=0.3)


def loop(steering=MODEL, water=BREEZE, vessel=OTTER):
    return ControlLoop(Setup(vessel, water, steering))


def rms(values):
    return math.sqrt(sum(value * value for value in values) / len(values))


def test_goto_arrives_and_stays():
    run = loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(run.goto(60.0, 30.0))
    run.run(1.5, 90.0, lambda output: output.arrived)
    for _ in range(20 * 60):
        run.tick(1.5)
    assert math.hypot(run.vessel.north_m - 60.0, run.vessel.east_m - 30.0) < 1.5


@pytest.mark.parametrize("steering", [SWAPPED, SteeringConfig()], ids=["seed", "model"])
@pytest.mark.parametrize("direction", [LoiterDirection.CW, LoiterDirection.CCW])
def test_circle_is_joined_and_held_in_the_ordered_direction(direction, steering):
    run = loop(steering)
    run.place(40.0, 0.0, math.pi)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Circle(radius_m=20.0, direction=direction)))
    run.run(1.5, 60.0, lambda output: output.on_path)
    run.run(1.5, 60.0, lambda output: output.turns > 0.5)
    errors, turned, last = [], 0.0, math.atan2(run.vessel.east_m, run.vessel.north_m)
    while run.tick(1.5).turns < 1.5:
        bearing = math.atan2(run.vessel.east_m, run.vessel.north_m)
        turned += math.remainder(bearing - last, 2 * math.pi)
        last = bearing
        errors.append(math.hypot(run.vessel.north_m, run.vessel.east_m) - 20.0)
    assert rms(errors) < 0.25
    assert (turned > 0) == (direction is LoiterDirection.CW)
    assert abs(turned) == pytest.approx(2 * math.pi, rel=0.02)


def test_hover_faces_the_drift_and_holds():
    run = loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=Hover()))
    errors = []
    for tick in range(20 * 200):
        run.tick(1.5)
        if tick > 20 * 100:
            errors.append(math.hypot(run.vessel.north_m, run.vessel.east_m))
    assert rms(errors) < 0.5


def test_legs_hold_their_lines():
    run = loop()
    run.place(0.0, 0.0, 0.0, 1.5)
    first, second = run.goto(60.0, 0.0, 1), run.goto(60.0, 60.0, 2)
    run.sail(first, None, second)
    run.run(1.5, 80.0, lambda output: output.arrived)
    run.sail(second, (first.lat_rad, first.lon_rad))
    leg, errors = Line((60.0, 0.0), (60.0, 60.0)), []

    def watch(output):
        here = leg.project(run.vessel.north_m, run.vessel.east_m)
        if 20.0 < here.along_m < 55.0:
            errors.append(here.cross_m)
        return output.arrived

    run.run(1.5, 80.0, watch)
    assert rms(errors) < 0.5
