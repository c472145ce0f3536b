"""The look-ahead's words: told once per approach and once per stop, with the way back; and maps that do not help."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.depth.ahead import DepthAhead, DepthLook
from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import Sounding, build, offset
from companion.core.guard.depth.guard import DepthGuard
from companion.core.guard.depth.input import Altitude, DepthInput, DepthInputConfig
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState

HULL = HullGeometry(beam_m=1.1)
CONFIG = DepthGuardConfig(input=DepthInputConfig(sigma_m=0.0, median_samples=1), good_margin_m=0.3)
HERE = (0.7188, -0.1519)


def at(north_m: float, speed_mps: float = 2.0, **more) -> EstimatedState:
    lat, lon = offset(*HERE, north_m, 0.0)
    values = {
        "lat_rad": lat,
        "lon_rad": lon,
        "x_m": north_m,
        "y_m": 0.0,
        "sog_mps": speed_mps,
        "cog_rad": 0.0,
        "psi_rad": 0.0,
    }
    return EstimatedState(0, **{**values, **more})


def approach(guard: DepthGuard, start_m: float, rate_mps: float, seconds: float, speed_mps: float = 2.0) -> list[str]:
    told = []
    for i in range(round(seconds * 10)):
        state = at(0.2 * i, speed_mps)
        guard.measure(Distance(i * 100_000, start_m - rate_mps * i * 0.1), state)
        told += [text for _, text in guard.step(i * 100_000, state, True, None, lambda speed: 2.0 * speed).texts]
    return [text for text in told if "closing" in text]


def test_an_approach_is_told_once_twenty_seconds_before_and_the_stop_once():
    told = approach(DepthGuard(CONFIG, HULL), 14.0, 0.25, 41.0)
    assert told[0] == "Bottom closing: depth limit in 20 s"
    assert told[1].startswith("Shallow water ahead (closing 0.2")
    assert len(told) == 2


def test_a_vessel_at_rest_tells_of_no_approach():
    assert approach(DepthGuard(CONFIG, HULL), 8.0, 0.05, 40.0, speed_mps=0.2) == []


def test_an_approach_that_noise_interrupts_is_told_once_and_one_that_is_past_the_limit_not_at_all():
    """A boat that had been stopped and drifted over a slope was told 44 times in 66 s that the depth limit is 0 s off."""
    ahead, told = DepthAhead(CONFIG, None, HULL), []
    for second in range(120):
        left_s = None if second % 3 == 0 else 18.0 - 0.2 * second
        look = DepthLook(4.0, closing_mps=0.0 if left_s is None else 0.2, left_s=left_s)
        told += [text for _, text in ahead.told(False, look, at(0.0), now_us=second * 1_000_000)]
    assert told == ["Bottom closing: depth limit in 18 s"]


def test_a_new_approach_is_told_anew():
    guard = DepthGuard(CONFIG, HULL)
    assert len([text for text in approach(guard, 8.0, 0.15, 10.0) if text.startswith("Bottom")]) == 1
    for i in range(100, 200):
        guard.measure(Distance(i * 100_000, 6.5 + 0.3 * (i - 100) * 0.1), at(0.0))
        guard.step(i * 100_000, at(0.0), True, None, lambda speed: 2.0 * speed)
    told = []
    for i in range(200, 300):
        guard.measure(Distance(i * 100_000, 9.5 - 0.4 * (i - 200) * 0.1), at(0.0))
        told += guard.step(i * 100_000, at(0.0), True, None, lambda speed: 2.0 * speed).texts
    assert sum(text.startswith("Bottom closing") for _, text in told) == 1


def test_the_stop_names_the_good_water_behind():
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    for i in range(6):
        ahead.look(i, at(2.0 * i, 1.0), 5.0, source, None, None)
    assert ahead.last_good == (10.0, 0.0)
    ahead.look(7, at(10.5, 1.0), 5.0, source, None, None)
    assert ahead.last_good == (10.0, 0.0), "every two metres"
    look = ahead.look(8, at(18.0, 1.0), 4.2, source, None, None)
    (text,) = ahead.told(True, look, at(18.0))
    assert text[1] == "Shallow water ahead (): stopping; good water 8 m off on 180"
    ahead.told(False, look, at(18.0))
    (text,) = ahead.told(True, look, at(10.5))
    assert text[1].endswith("stopping"), "here is as good"
    ahead.told(False, look, None)
    assert ahead.told(True, look, None)[0][1].endswith("stopping")


def test_without_a_position_nothing_is_kept():
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    for state, altitude in ((None, 9.0), (at(0.0, x_m=None), 9.0), (at(0.0), None), (at(0.0), 4.2)):
        ahead.look(0, state, altitude, source, None, None)
    assert ahead.last_good is None


def test_a_map_without_position_or_soundings_ahead_says_nothing():
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    ahead.map = build([Sounding(*offset(*HERE, 500.0, 500.0), 2.0)])
    for state in (at(0.0), EstimatedState(0, sog_mps=1.0)):
        look = ahead.look(0, state, 9.0, source, None, lambda speed: 2.0 * speed)
        assert (look.stop, look.map_least_m, look.limit_m) == (False, None, 4.0)


def test_from_water_that_the_map_calls_shallow_the_way_out_is_open():
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    ahead.map = build(
        [
            Sounding(*offset(*HERE, north, east), 3.0 + 0.02 * north)
            for north in range(-40, 60, 2)
            for east in (-4, 0, 4)
        ],
        2.0,
        2.0,
    )
    out = ahead.look(0, at(10.0, 1.0), 9.0, source, None, lambda speed: 2.0 * speed)
    assert not out.stop
    back = at(10.0, 1.0, cog_rad=math.pi, psi_rad=math.pi)
    look = ahead.look(0, back, 9.0, source, None, lambda speed: 2.0 * speed)
    assert look.stop
    assert look.why.startswith("map ")


def test_a_confirmed_jump_starts_the_rate_anew():
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    for i in range(50):
        ahead.note((Altitude(i * 100_000, 10.0 - 0.05 * i),))
    assert ahead.look(0, at(0.0), 7.5, source, None, lambda speed: speed).closing_mps > 0.4
    ahead.note((Altitude(5_000_000, 3.0), Altitude(5_100_000, 3.0), Altitude(5_200_000, 3.0)))
    assert ahead.look(0, at(0.0), 3.0, source, None, lambda speed: speed).closing_mps == 0.0


@pytest.mark.parametrize("speed_mps", [0.0, 0.05])
def test_drifting_onto_the_shallow_counts_the_reaction_only(speed_mps):
    ahead = DepthAhead(CONFIG, None, HULL)
    source = DepthInput(CONFIG.input, HULL)
    for i in range(60):
        ahead.note((Altitude(i * 100_000, 10.0 - 0.05 * i),))
    look = ahead.look(0, at(0.0, speed_mps), 7.0, source, None, lambda speed: 1 / 0)
    assert look.limit_m == pytest.approx(4.0 + look.closing_mps * 0.6)
    assert look.slow_to_mps is None
