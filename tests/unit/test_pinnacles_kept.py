"""Two hundred pinnacles sounded once and drifted off, through the sounder's noise, the input chain and the memory: none is forgotten.

The same with the whole vessel: ``tests/scenario/test_pinnacles.py``.
"""

from __future__ import annotations

import math
import random

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import offset
from companion.core.guard.depth.guard import DepthGuard
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState, GuardState
from sitl.plant.bottom import Flat, Mound

HERE = (0.7188, -0.1519)
LIMIT_M = 4.0
PERIOD_US = 100_000
COAST_S = 1.0
"""As when she brakes astern: she comes to rest beside the rock."""


def state(t_us, north_m, east_m, speed_mps):
    lat, lon = offset(*HERE, north_m, east_m)
    return EstimatedState(t_us, lat_rad=lat, lon_rad=lon, x_m=north_m, y_m=east_m, sog_mps=speed_mps)


def sounded_once(seed):
    """Sail over a rock until the guard stops the boat, coast, drift: (guard, where it was shallow, how often that was measured)."""
    chance = random.Random(f"kept/{seed}")
    deep_m, top_m, radius_m = chance.uniform(12.0, 30.0), chance.uniform(1.0, 3.4), chance.uniform(0.6, 5.0)
    rock = Mound(Flat(deep_m), 0.0, chance.uniform(-0.3, 0.3) * radius_m, radius_m, deep_m - top_m)
    speed_mps, current_mps, to_rad = chance.uniform(0.8, 2.5), chance.uniform(0.002, 0.2), chance.uniform(0.0, math.tau)
    guard = DepthGuard(DepthGuardConfig(), HullGeometry())
    north_m, east_m, stopped, least = -20.0 - chance.random(), 0.0, False, (math.inf, 0.0, 0.0)
    shallow, until_us, now_us = 0, 60_000_000, 0
    while now_us < until_us and north_m < 40.0:
        now_us += PERIOD_US
        speed_mps *= math.exp(-0.1 / COAST_S) if stopped else 1.0
        north_m += 0.1 * (speed_mps + current_mps * math.cos(to_rad))
        east_m += 0.1 * current_mps * math.sin(to_rad)
        here = state(now_us, north_m, east_m, speed_mps)
        depth_m = rock.depth_at(north_m, east_m) + chance.gauss(0.0, 0.05)
        before = guard.input.gated
        guard.measure(Distance(now_us, depth_m), here)
        out = guard.step(now_us, here, loops_active=not stopped)
        gated = guard.input.gated
        if gated is not None and gated is not before and gated.value_m < LIMIT_M - 0.3:
            shallow += 1
            least = min(least, (gated.value_m, north_m, east_m))
        if not stopped and out.state in (GuardState.CORRECTION, GuardState.LOCKED):
            stopped, until_us = True, now_us + round(chance.uniform(20.0, 240.0) * 1e6)
    guard.memory.close_cell()
    return guard, least, shallow


@pytest.mark.parametrize("pinnacles", [20, pytest.param(200, marks=pytest.mark.soak)])
def test_no_pinnacle_is_forgotten(pinnacles):
    met, forgotten, seed = 0, [], 0
    while met < pinnacles:
        seed += 1
        guard, (_, north_m, east_m), shallow = sounded_once(seed)
        if shallow < 3:
            continue
        met += 1
        here = state(0, north_m + 8.0, east_m, 1.0)
        known = guard.memory.shoals_near(here, 12.0, LIMIT_M)
        depth_m = guard.memory.shoal_at(*offset(*HERE, north_m, east_m), 1) if known else None
        if depth_m is None:
            forgotten.append(seed)
    assert forgotten == []
