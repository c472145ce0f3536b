"""The guard on slopes (vessel-control §5.4): parity reproduces the reactive columns, look-ahead holds its bars."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import DepthGrid, Sounding, build, offset
from companion.core.guard.depth.guard import DepthGuard
from companion.core.hull.geometry import HullGeometry
from companion.core.hull.statics import top_speed_mps
from mavlink_bridge.language.messages import Distance, EstimatedState
from sitl.plant.bottom import Flat, Slope
from sitl.plant.library import load_vessel
from sitl.plant.water import Water, WaterConfig
from tests.soaked import in_the_soak
from tools.benches.cells.depth_runs import QUIET, DepthRun, Noise
from tools.benches.cells.drawn_hulls import drawn

VESSEL = load_vessel("otter")
START_M = 20.35
"""Water depth at the start: 20 m under the keel."""
SLOPES = (pytest.param(50, marks=pytest.mark.soak), 20, 10, 5, 2)
"""1:50 takes ten minutes of sailing: ``make soak``; its parity rows stay."""
REACTIVE = {
    # (speed, 1:n): (coasting, full astern) of the reference's table
    (1.5, 50): (3.93, 3.98),
    (1.5, 10): (3.55, 3.82),
    (1.5, 5): (3.12, 3.65),
    (2.5, 50): (3.86, 3.92),
    (2.5, 20): (3.65, 3.82),
    (2.5, 5): (2.76, 3.44),
    (2.5, 2): (0.76, 2.47),
}


def slope(n: int) -> Slope:
    return Slope(Flat(START_M), 1.0 / n)


@pytest.mark.parametrize("brake", [False, True], ids=["coast", "astern"])
@pytest.mark.parametrize(
    ("speed_mps", "n"),
    [
        pytest.param(*row, marks=[pytest.mark.soak] if row == (1.5, 50) else [], id=f"{row[0]}, 1:{row[1]}")
        for row in REACTIVE
    ],
)
def test_parity_reproduces_the_reactive_columns(speed_mps, n, brake):
    parity = DepthGuardConfig(rate_look_ahead=False, map_look_ahead=False, brake=brake)
    run = DepthRun(VESSEL, slope(n), speed_mps, parity, delay_s=0.3, noise=QUIET)
    assert run.lowest_altitude_m() == pytest.approx(REACTIVE[speed_mps, n][brake], abs=0.1)


@pytest.mark.parametrize("brake", [False, True], ids=["coast", "astern"])
@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("n", SLOPES)
def test_the_closing_rate_keeps_3_85_m(n, speed_mps, brake):
    """Must hold: lowest true altitude >= 3.85 m, with a noisy sounder, slopes 1:50 to 1:2 from 20 m."""
    config = DepthGuardConfig(map_look_ahead=False, brake=brake)
    assert DepthRun(VESSEL, slope(n), speed_mps, config, noise=Noise(), seed=7).lowest_altitude_m() >= 3.85


@pytest.mark.parametrize("thruster_min", [-1.0, -0.3])
@pytest.mark.parametrize("n", [5, 10])
@pytest.mark.parametrize("seed", range(4))
def test_heavy_boats_with_the_brake_keep_3_85_m(n, seed, thruster_min):
    """Boats of a tonne that need ten seconds of thrust astern and more, and as much of it as the gate lets through."""
    config = DepthGuardConfig(map_look_ahead=False, brake=True)
    boat = drawn("heavy", seed)
    run = DepthRun(boat, slope(n), 0.8 * top_speed_mps(boat), config, noise=Noise(), seed=7, thruster_min=thruster_min)
    assert run.lowest_altitude_m() >= 3.85


@pytest.mark.soak
@pytest.mark.parametrize("slow", [False, True], ids=["deaf to slow", "slowing"])
@pytest.mark.parametrize("brake", [False, True], ids=["coast", "astern"])
@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("n", SLOPES)
def test_the_closing_rate_keeps_3_85_m_for_many_seeds(n, speed_mps, brake, slow):
    config = DepthGuardConfig(map_look_ahead=False, brake=brake)
    for seed in range(20):
        run = DepthRun(VESSEL, slope(n), speed_mps, config, noise=Noise(), seed=seed, slow=slow)
        assert run.lowest_altitude_m() >= 3.85


@dataclass(frozen=True, slots=True)
class SilentBelow(Noise):
    """A sounder that falls silent for good where there is less water than this below it."""

    silent_m: float = 5.15

    def read(self, rng: random.Random, true_m: float) -> float | None:
        return None if true_m < self.silent_m else Noise.read(self, rng, true_m)


@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("n", SLOPES)
def test_a_sounder_lost_at_five_metres_closing_costs_no_more_water(n, speed_mps):
    """Must hold: acted on in 1 s (test_guard_voyages); and if the slope goes on as it did, no less water than otherwise."""
    lost = DepthRun(VESSEL, slope(n), speed_mps, DepthGuardConfig(map_look_ahead=False), noise=SilentBelow(), seed=7)
    assert lost.lowest_altitude_m() >= 3.85


@dataclass(frozen=True, slots=True)
class Slow(Noise):
    """A sounder that speaks each so many tenths of a second, and is not heard every time."""

    outlier: float = 0.0
    every: int = 20
    asked: Iterator[int] = field(default_factory=itertools.count)

    def read(self, rng: random.Random, true_m: float) -> float | None:
        return None if next(self.asked) % self.every else Noise.read(self, rng, true_m)


@pytest.mark.parametrize("hull", ["otter", *in_the_soak("blueboat")])
@pytest.mark.parametrize("n", [*in_the_soak(10), 4, 2])
@pytest.mark.parametrize(("every", "lost"), [(10, 0.2), *in_the_soak((14, 0.0), (20, 0.0)), (20, 0.1)])
def test_a_slow_sounder_keeps_3_4_m(hull, n, every, lost):
    """A slope of 1:2 was sailed up aground, without a word, with a reading each 1.4 s and more."""
    for seed in range(4):
        noise, config = Slow(drop=lost, every=every), DepthGuardConfig(map_look_ahead=False)
        assert DepthRun(load_vessel(hull), slope(n), 1.5, config, noise=noise, seed=seed).lowest_altitude_m() >= 3.4


@pytest.mark.parametrize("lost", [0.0, 0.2])
@pytest.mark.parametrize("every", [5, 10, 14, 20])
def test_a_slow_sounder_stops_nobody_over_a_level_bottom(every, lost):
    """Half an hour with half a metre to spare."""
    noise, rng = Slow(drop=lost, every=every), random.Random(11)
    guard, stops = DepthGuard(DepthGuardConfig(), HullGeometry(0.35, 0.2, 1.08)), 0
    for i in range(18_000):
        now_us = i * 100_000
        state = EstimatedState(now_us, sog_mps=1.5)
        guard.measure(Distance(now_us, noise.read(rng, 4.65)), state)
        stops += guard.step(now_us, state, i > 200, None, lambda speed: 2.33 * speed).flags.depth_ahead
    assert stops == 0


def sea(height_m: float, seed: int, period_s: float = 3.0) -> Water:
    """Waves that have been running for a minute."""
    water = Water(WaterConfig(wave_height_m=height_m, wave_period_s=period_s), random.Random(seed))
    for _ in range(600):
        water.step(0.1)
    return water


@dataclass(frozen=True, slots=True)
class Afloat(Noise):
    """A sounder that goes up and down with the waves."""

    water: Water = field(default_factory=lambda: sea(0.6, 5))

    def read(self, rng: random.Random, true_m: float) -> float | None:
        self.water.step(0.1)
        heave_m = VESSEL.seakeeping.heave_m_per_m * self.water.wave_height_m * self.water.wave_quadrature
        return Noise.read(self, rng, true_m + heave_m)


@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("n", [10, 2, *in_the_soak(20, 5)])
@pytest.mark.parametrize("height_m", [0.6, *in_the_soak(0.3)])
def test_the_closing_rate_keeps_3_85_m_in_waves(n, speed_mps, height_m):
    """What waves explain is no slope; of a slope nothing is lost by that."""
    for seed in range(4):
        noise = Afloat(water=sea(height_m, seed))
        config = DepthGuardConfig(map_look_ahead=False)
        assert DepthRun(VESSEL, slope(n), speed_mps, config, noise=noise, seed=seed).lowest_altitude_m() >= 3.85


def charted(n: int, origin_rad: tuple[float, float], error_m: float = 0.0) -> DepthGrid:
    """Soundings of the slope every 4 m, in a band 24 m wide around the 4 m contour."""
    bottom = slope(n)
    contour_m = round((START_M - 4.35) * n)
    places = [(north, east) for north in range(contour_m - 60, contour_m + 30, 4) for east in range(-12, 13, 4)]
    return build(
        (Sounding(*offset(*origin_rad, north, east), bottom.depth_at(north, east) - error_m) for north, east in places),
        pitch_m=2.5,
        spread_m=5.0,
    )


@pytest.mark.parametrize("brake", [False, pytest.param(True, marks=pytest.mark.soak)], ids=["coast", "astern"])
@pytest.mark.parametrize("speed_mps", [pytest.param(1.5, marks=pytest.mark.soak), 2.5])
@pytest.mark.parametrize("n", SLOPES)
def test_a_map_keeps_the_full_4_m(n, speed_mps, brake):
    """Must hold: lowest true altitude >= 4.0 m with a map, astern brake off and on."""
    config = DepthGuardConfig(brake=brake)
    run = DepthRun(VESSEL, slope(n), speed_mps, config, noise=Noise(), seed=3)
    run.grid = charted(n, run.origin_rad)
    assert run.lowest_altitude_m() >= 4.0


def transitions(hours: float, altitude_m: float, heave_m: float) -> tuple[int, int]:
    """Count state changes and look-ahead stops of a vessel under way at 1.5 m/s over level ground."""

    noise, rng = Noise(), random.Random(11)
    guard = DepthGuard(DepthGuardConfig(), HullGeometry(0.35, 0.2, 1.08))
    states = stops = 0
    before = None
    for i in range(round(hours * 36_000)):
        now_us = i * 100_000
        state = EstimatedState(now_us, sog_mps=1.5)
        true_m = altitude_m + 0.15 + heave_m * math.sin(2.0 * math.pi * i / 30.0)
        guard.measure(Distance(now_us, noise.read(rng, true_m)), state)
        out = guard.step(now_us, state, True, None, lambda speed: 2.33 * speed)
        stops += out.flags.depth_ahead
        states += before is not None and out.state is not before and i > 20
        before = out.state
    return states, stops


@pytest.mark.parametrize("hours", [1.0, pytest.param(10.0, marks=pytest.mark.soak)])
def test_ten_hours_at_4_15_m_without_a_false_alarm(hours):
    """Must hold: 0.05 m noise, 1 % outliers, 2 % drop-outs, no heave: 0 false transitions, and no false stop."""
    assert transitions(hours, 4.15, 0.0) == (0, 0)


@pytest.mark.parametrize(
    ("altitude_m", "height_m", "period_s", "speed_mps"),
    [(5.65, 0.6, 3.0, 1.5), (5.65, 0.6, 2.0, 1.5), (5.65, 0.6, 5.0, 2.5), (4.65, 0.5, 3.0, 1.0), (4.65, 0.6, 3.0, 0.0)],
)
@pytest.mark.parametrize("every", [1, 2], ids=["10 Hz", "5 Hz"])
def test_waves_over_a_level_bottom_stop_nobody(altitude_m, height_m, period_s, speed_mps, every):
    """A quarter of an hour of each: there were up to 150 stops, and an approach told every three seconds."""
    noise, rng = Afloat(water=sea(height_m, 3, period_s)), random.Random(11)
    guard = DepthGuard(DepthGuardConfig(), HullGeometry(0.35, 0.2, 1.08))
    stops, told = 0, list[str]()
    for i in range(9_000):
        now_us = i * 100_000
        state = EstimatedState(now_us, sog_mps=speed_mps)
        heard_m = noise.read(rng, altitude_m + 0.15)
        if i % every == 0:
            guard.measure(Distance(now_us, heard_m), state)
        out = guard.step(now_us, state, i > 200, None, lambda speed: 2.33 * speed)
        stops += out.flags.depth_ahead
        told += [text for _, text in out.texts if i > 200 and "closing" in text]
    assert stops == 0
    assert len(told) <= 4


@pytest.mark.parametrize(
    ("altitude_m", "height_m", "period_s"),
    [(5.5, 1.0, 10.0), (7.0, 1.5, 14.0), *in_the_soak((5.5, 0.6, 9.0), (7.0, 1.5, 12.0))],
)
@pytest.mark.parametrize("speed_mps", [0.0, 1.5])
def test_a_swell_over_a_level_bottom_stops_nobody(altitude_m, height_m, period_s, speed_mps):
    """A quarter of an hour, after the first waves: there were stops in the first minutes, and an approach told with each wave."""
    noise, rng = Afloat(water=sea(height_m, 3, period_s)), random.Random(11)
    guard = DepthGuard(DepthGuardConfig(), HullGeometry(0.35, 0.2, 1.08))
    stops, told = 0, list[str]()
    for i in range(9_000):
        now_us = i * 100_000
        state = EstimatedState(now_us, sog_mps=speed_mps)
        guard.measure(Distance(now_us, noise.read(rng, altitude_m + 0.15)), state)
        out = guard.step(now_us, state, i > 600, None, lambda speed: 2.33 * speed)
        stops += out.flags.depth_ahead
        told += [text for _, text in out.texts if i > 600 and "closing" in text]
    assert stops == 0
    assert len(told) <= 16


@pytest.mark.parametrize("speed_mps", [1.5, 2.5])
@pytest.mark.parametrize("n", [10, 4, 2])
def test_a_slope_in_a_swell_is_seen(n, speed_mps):
    """The mean water, waves left out."""
    for seed in range(3):
        noise, config = Afloat(water=sea(1.2, seed, 12.0)), DepthGuardConfig(map_look_ahead=False)
        assert DepthRun(VESSEL, slope(n), speed_mps, config, noise=noise, seed=seed).lowest_altitude_m() >= 3.6


@pytest.mark.soak
def test_with_heave_the_count_is_reported(record_property):
    states, stops = transitions(1.0, 4.15, 0.05)
    print(f"with 0.05 m of heave: {states} transitions and {stops} stopping ticks an hour")
    record_property("transitions_per_hour_with_heave", states)
    record_property("stops_per_hour_with_heave", stops)
    assert states <= 60
    assert stops <= 20, "188 before a stop was confirmed"
