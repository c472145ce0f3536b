"""A sounder that repeats itself: proven by its own noise or by a slope that was due; never at rest, on the flat, or by real recordings."""

from __future__ import annotations

import itertools
import math
import random

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import build
from companion.core.guard.depth.guard import DepthGuard
from companion.core.guard.depth.repeated import RepeatedDepth
from companion.core.guard.depth.soundings import dune_reference, parse_dune
from companion.core.hull.geometry import HullGeometry
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Distance, EstimatedState

RECORDED = (
    "gpsd/sounder.log",
    "gpsd/humminbird-M37.log",
    "gpsd/bundg_zeus_9.log",
    "vessel/signalk_gofree-merrimac.log",
    "vessel/opencpn_hakefjord_head.log",
)
STEEP = 0.15


class Sailing:
    """A boat that sails over a bottom, and what its sounder says."""

    def __init__(self, *, hz=10.0, speed_mps=1.5, sigma_m=0.05, digit_m=0.01, seed=3):
        self.watch, self.rng = RepeatedDepth(), random.Random(seed)
        self.period_s, self.speed_mps, self.sigma_m, self.digit_m = 1.0 / hz, speed_mps, sigma_m, digit_m
        self.t_us, self.depth_m, self.said_m = 0, 12.0, 12.0

    def sail(self, seconds, *, rise=0.0, told=0.0, frozen=False):
        """Over a bottom that rises so much a metre, ``told`` of it known; return whether it was found stuck, after how many seconds."""
        for number in range(round(seconds / self.period_s)):
            self.t_us += round(self.period_s * 1e6)
            self.depth_m -= rise * self.speed_mps * self.period_s
            if not frozen:
                heard_m = self.depth_m + self.rng.gauss(0.0, self.sigma_m)
                self.said_m = round(round(heard_m / self.digit_m) * self.digit_m, 3)
            self.watch.hear(self.t_us, self.said_m, self.speed_mps, told)
            if self.watch.is_stuck:
                return number * self.period_s
        return None


@pytest.mark.parametrize(("hz", "within_s"), [(10.0, 3.0), (2.0, 6.0), (1.0, 12.0)])
def test_a_noisy_sounder_that_repeats_is_found_at_once_and_lives_with_the_next_value(hz, within_s):
    boat = Sailing(hz=hz)
    assert boat.sail(60.0, rise=0.05, told=0.05) is None
    assert boat.sail(30.0, rise=0.05, told=0.05, frozen=True) <= within_s
    assert boat.watch.was_closing
    assert boat.watch.is_noise_gone
    boat.sail(2.0 * boat.period_s)
    assert not boat.watch.is_stuck


def test_over_a_level_bottom_it_is_found_too_but_nothing_was_closing():
    boat = Sailing()
    assert boat.sail(60.0) is None
    assert boat.sail(30.0, frozen=True) <= 3.0
    assert not boat.watch.was_closing


def test_without_noise_the_slope_that_was_due_tells():
    boat = Sailing(sigma_m=0.0)
    assert boat.sail(20.0, rise=STEEP, told=STEEP) is None
    found_s = boat.sail(30.0, rise=STEEP, told=STEEP, frozen=True)
    assert 0.9 < found_s * boat.speed_mps * STEEP < 1.5, "a metre of it"
    assert not boat.watch.is_noise_gone, "a level would look the same"


@pytest.mark.parametrize("digit_m", [0.01, 0.1, 0.3048])
@pytest.mark.parametrize("sigma_m", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("hz", [1.0, 10.0])
def test_no_sounder_that_lives_is_stuck_over_flat_or_nearly_flat_bottoms(hz, sigma_m, digit_m):
    """Nor behind a lock gate: the boat stops, lies, and sails on over the same depth."""
    boat = Sailing(hz=hz, sigma_m=sigma_m, digit_m=digit_m)
    for rise in (0.001, 0.0, -0.001, 0.002):
        assert boat.sail(300.0, rise=rise, told=max(rise, 0.0)) is None
    boat.speed_mps = 0.02
    assert boat.sail(600.0) is None
    boat.speed_mps = 1.5
    assert boat.sail(300.0) is None


@pytest.mark.parametrize("digit_m", [0.1, 0.3048])
@pytest.mark.parametrize("sigma_m", [0.0, 0.05])
def test_a_coarse_sounder_on_a_slope_that_ends_on_a_shelf_is_not_stuck_for_the_first_metres(sigma_m, digit_m):
    boat = Sailing(sigma_m=sigma_m, digit_m=digit_m)
    assert boat.sail(30.0, rise=0.1, told=0.1) is None
    assert boat.sail(5.0) is None


def test_a_boat_at_rest_proves_nothing():
    boat = Sailing()
    assert boat.sail(30.0, rise=STEEP, told=STEEP) is None
    boat.speed_mps = 0.1
    assert boat.sail(600.0, frozen=True) is None


def test_a_sounder_that_measures_once_a_second_and_speaks_ten_times_is_not_stuck():
    boat = Sailing(hz=1.0)
    for _ in range(300):
        boat.sail(1.0, rise=0.02, told=0.02)
        for tenth in range(1, 10):
            boat.watch.hear(boat.t_us + tenth * 100_000, boat.said_m, boat.speed_mps, 0.02)
            assert not boat.watch.is_stuck


@pytest.mark.parametrize("name", RECORDED)
def test_recorded_sounders_are_never_stuck(shared_data, name):
    """Taken as under way at 2.5 m/s over a bottom that closes, which is the worst that can be said of them."""
    reader, estimator, watch = NmeaReader(NmeaConfig(earliest_year=2000)), Estimator(EstimatorConfig()), RepeatedDepth()
    read = 0
    for number, line in enumerate((shared_data / "nmea" / name).read_bytes().splitlines(keepends=True)):
        for item in reader.receive(line, 5_000 * number):
            if isinstance(item, Distance) and estimator.update(item) and item.value_m is not None:
                read += 1
                watch.hear(read * 1_000_000, item.value_m, 2.5, STEEP)
                assert not watch.is_stuck, f"reading {read}: {item.value_m} m"
    assert read > 30


def test_over_the_soundings_of_a_harbour_no_sounder_that_lives_is_stuck(leixoes):
    """Straight tracks over quays, slopes and dredged levels, with the guard's own idea of what closes."""
    text = leixoes.read_text("utf-8")
    grid, frame, rng = build(parse_dune(text)), LocalFrame(*dune_reference(text)), random.Random(5)
    sounders = itertools.cycle(itertools.product((0.01, 0.1, 0.3048), (0.0, 0.02, 0.05), (1, 10)))
    read = 0
    for digit_m, sigma_m, hz in itertools.islice(sounders, 90):
        north_m, east_m = rng.uniform(2000.0, 3000.0), rng.uniform(-1400.0, -400.0)
        course_rad, speed_mps = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.8, 3.0)
        velocity = speed_mps * math.cos(course_rad), speed_mps * math.sin(course_rad)
        guard = DepthGuard(DepthGuardConfig(), HullGeometry(0.35, 0.2, 1.08))
        for number in range(200 * hz):
            x_m, y_m = north_m + velocity[0] * number / hz, east_m + velocity[1] * number / hz
            lat_rad, lon_rad = frame.to_geodetic(x_m, y_m)
            depth_m = grid.depth_at(lat_rad, lon_rad)
            if depth_m is None or depth_m < 1.0:
                break
            said_m = round(round((depth_m - 0.2 + rng.gauss(0.0, sigma_m)) / digit_m) * digit_m, 3)
            state = EstimatedState(
                round(number * 1e6 / hz),
                lat_rad,
                lon_rad,
                x_m=x_m,
                y_m=y_m,
                vx_mps=velocity[0],
                vy_mps=velocity[1],
                sog_mps=speed_mps,
            )
            guard.measure(Distance(state.t_us, said_m), state)
            read += 1
            assert not guard.input.is_stuck, (digit_m, sigma_m, hz, guard.input.trouble)
    assert read > 20_000
