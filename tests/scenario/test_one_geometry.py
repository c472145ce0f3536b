"""The hull file's geometry and ``system``'s clock are what every part goes by: nothing to keep in step by hand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import config as shipped
from companion.settings.schema import load
from sitl.world.settings import SimSettings
from sitl.world.world import World

OTTER = shipped.path("vessels", "otter.toml").read_text()
SIM = shipped.path("sim.toml")


def hull(folder: Path, text: str) -> str:
    path = folder / "hull.toml"
    path.write_text(text)
    return f"vessel={path}"


def world(*changes: str) -> World:
    return World(load(SIM, [*changes, 'store=""', "world.sensors.sounder_sigma_m=0.0"], SimSettings), seed=1)


@pytest.mark.parametrize("sentence", ["DPT", "DBT"])
def test_the_guard_measures_from_the_keel_of_the_hull_file(tmp_path: Path, sentence: str) -> None:
    deep = OTTER.replace("keel_depth_m = 0.35", "keel_depth_m = 1.35").replace(
        "transducer_depth_m = 0.20", "transducer_depth_m = 0.75"
    )
    sailing = world(hull(tmp_path, deep), f'world.sensors.depth_sentence="{sentence}"')
    truth = sailing.run(10.0)
    assert sailing.snapshot is not None
    assert truth.depth_m is not None
    altitude_m = sailing.app.vehicle.controls.last.guarded.depth.altitude_m
    assert altitude_m == pytest.approx(truth.depth_m - 1.35, abs=0.15)


def test_a_second_sounder_has_a_place_of_its_own(tmp_path: Path) -> None:
    """The world's sounder is the sensor link ``nmea``; its own table in the hull file counts, not the hull's common one."""
    deep = OTTER + "\n[mounts.nmea]\ntransducer_depth_m = 0.9\n"
    sailing = world(hull(tmp_path, deep))
    truth = sailing.run(10.0)
    assert sailing.snapshot is not None
    assert truth.depth_m is not None
    assert sailing.app.vehicle.controls.last.guarded.depth.altitude_m == pytest.approx(truth.depth_m - 0.35, abs=0.15)


def test_the_antenna_of_the_hull_file_is_the_simulator_s_and_the_estimator_s(tmp_path: Path) -> None:
    text = OTTER + "\n[antenna]\nforward_m = 3.0\nstarboard_m = -1.0\nup_m = 2.0\n"
    sailing = world(hull(tmp_path, text), "world.heading_deg=90.0")
    truth = sailing.run(10.0)
    state = sailing.app.vehicle.controls.state
    assert state.lat_rad is not None
    assert state.lon_rad is not None
    north_m = (state.lat_rad - truth.lat_rad) * 6.37e6
    east_m = (state.lon_rad - truth.lon_rad) * 6.37e6 * math.cos(truth.lat_rad)
    assert math.hypot(north_m, east_m) < 0.2


def test_a_slower_tick_is_every_part_s_tick(tmp_path: Path) -> None:
    """At 10 Hz a demand of the tick before is 100 ms old: neither stale nor late."""
    sailing = world("system.tick_hz=10", "depth.enabled=false", "operator.gcs_required=false")
    sailing.run(5.0)
    vehicle = sailing.app.vehicle
    assert vehicle.parts.gate.period_us == vehicle.parts.monitors.period_us == sailing.period_us == 100_000


def test_rudders_go_as_far_as_the_hull_file_says(tmp_path: Path) -> None:
    sailing = world(hull(tmp_path, OTTER.replace("max_deg = 30.0", "max_deg = 18.0")))
    sailing.run(1.0)
    assert sailing.app.vehicle.parts.gate.rudder_max_rad == pytest.approx(math.radians(18.0))
