"""A real bottom: soundings of the harbour of Leixoes. A plan into the shallows is refused; sailed by force it stops before."""

from __future__ import annotations

import math
import random
from functools import lru_cache

import pytest

from companion.core.guard.depth.grid import build, offset
from companion.core.guard.depth.soundings import dune_reference, parse_dune
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, GuidedHeading, Reposition

KEEL_M = 0.35
START = (2400.0, -1000.0)
"""North and east of the file's reference, m: about 10 m of water."""


def overrides(path, start, *, chart=True):
    text = path.read_text("utf-8")
    lat, lon = LocalFrame(*dune_reference(text)).to_geodetic(*start)
    found = [
        "world.bottom.kind=file",
        f"world.bottom.file={path}",
        f"world.latitude_deg={math.degrees(lat):.9f}",
        f"world.longitude_deg={math.degrees(lon):.9f}",
    ]
    return (*found, f"depth.map.file={path}") if chart else tuple(found)


def test_a_plan_across_the_4_m_contour_is_refused_with_its_item(voyage, leixoes):
    trip = voyage(*overrides(leixoes, START))
    good = trip.plan(1.5, (60.0, 0.0), (60.0, 200.0))
    assert good.reason == ""
    reply = trip.plan(1.5, (0.0, 200.0), (40.0, 300.0), (60.0, 560.0), (0.0, 0.0))
    assert reply.reason.startswith("item 3: charted depth ")
    assert "at least 4.3 m needed" in reply.reason or "at least 4.4 m needed" in reply.reason
    assert len(trip.world.app.vehicle.parts.mission.plan.maneuvers) == 3, "the old plan is kept"


def test_a_guided_target_in_the_shallows_is_refused(voyage, leixoes):
    trip = voyage(*overrides(leixoes, START))
    assert trip.ask(Arm(arm=True)).reason == ""
    for east_m, refused in ((520.0, True), (100.0, False)):
        lat, lon = (math.radians(value / 1e7) for value in trip.at(60.0, east_m))
        reason = trip.ask(Reposition(lat, lon)).reason
        assert reason.startswith("the target: charted depth") == refused


@lru_cache
def shoals(path):
    """Headings from the start that lead into charted shallows within 700 m, as the map sees them: (bearing, distance)."""
    text = path.read_text("utf-8")
    grid = build(parse_dune(text))
    lat, lon = LocalFrame(*dune_reference(text)).to_geodetic(*START)
    found = []
    for degrees in range(0, 360, 3):
        rad = math.radians(degrees)
        for away in range(20, 700, 5):
            depth = grid.depth_at(*offset(lat, lon, away * math.cos(rad), away * math.sin(rad)))
            if depth is None:
                break
            if depth < 4.0:
                found.append((rad, away))
                break
    return found


def forced(voyage, leixoes, seed, chart=True):
    """Steer straight for a shoal from at most 100 m before it; return (least true altitude, whether the guard acted)."""
    rng = random.Random(seed)
    heading, away = rng.choice(shoals(leixoes))
    speed = rng.choice((1.5, 2.5))
    skip = max(0.0, away - 100.0)
    start = (START[0] + skip * math.cos(heading), START[1] + skip * math.sin(heading))
    trip = voyage(*overrides(leixoes, start, chart=chart), f"world.heading_deg={math.degrees(heading):.1f}", seed=seed)
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.ask(GuidedHeading(math.remainder(heading, 2.0 * math.pi), speed)).reason == ""
    least = math.inf
    for _ in range(round(20.0 * ((away - skip) / speed + 30.0))):
        trip.step()
        if trip.truth.depth_m is not None:
            least = min(least, trip.truth.depth_m - KEEL_M)
        if trip.snapshot.mode is Mode.HOLD and (trip.snapshot.state.sog_mps or 0.0) < 0.05:
            break
    return least, trip.snapshot.mode is Mode.HOLD


def test_by_force_it_stops_before_the_contour(voyage, leixoes):
    """Must hold, 2 of the 50 seeds; all of them in ``make soak``."""
    for seed in (0, 3):
        least, stopped = forced(voyage, leixoes, seed)
        assert stopped
        assert least >= 4.0, f"seed {seed}"


@pytest.mark.soak
def test_by_force_it_stops_before_the_contour_for_50_seeds(voyage, leixoes, record_property):
    """Must hold: sailed by force it stops before the 4 m contour, for 50 seeds."""
    results = [forced(voyage, leixoes, seed) for seed in range(50)]
    tell(results, "with the chart", record_property)
    assert all(stopped for _, stopped in results)
    assert min(least for least, _ in results) >= 4.0


@pytest.mark.soak
def test_without_a_map_the_sounder_alone_keeps_it_off_the_ground(voyage, leixoes, record_property):
    results = [forced(voyage, leixoes, seed, chart=False) for seed in range(50)]
    tell(results, "with the sounder alone", record_property)
    assert min(least for least, _ in results) > 1.0


def tell(results, what, record_property):
    stopped, least = sum(stopped for _, stopped in results), min(least for least, _ in results)
    print(f"Leixoes {what}: {stopped} of {len(results)} stopped, least altitude {least:.2f} m")
    record_property(f"leixoes_least_altitude_m_{what.replace(' ', '_')}", round(least, 3))
