"""Geodesy: a centimetre within 10 km, whatever the latitude."""

from __future__ import annotations

import math

from hypothesis import given, strategies as st

from mavlink_bridge.language.geodesy import LocalFrame, at_most_m, direct, inverse

LATITUDES = st.floats(-1.4, 1.4)
LONGITUDES = st.floats(-math.pi, math.pi)
REACH = st.floats(-10_000.0, 10_000.0)


@given(LATITUDES, LONGITUDES, REACH, REACH)
def test_round_trip_is_exact_to_a_tenth_of_a_millimetre(lat: float, lon: float, north: float, east: float) -> None:
    frame = LocalFrame(lat, lon)
    back = frame.to_local(*frame.to_geodetic(north, east))
    assert math.dist(back, (north, east)) < 1e-4


@given(LATITUDES, LONGITUDES, st.floats(0.0, 10_000.0), LONGITUDES)
def test_distances_from_the_origin_are_those_of_the_ellipsoid(
    lat: float, lon: float, run: float, bearing: float
) -> None:
    north, east = LocalFrame(lat, lon).to_local(*direct(lat, lon, bearing, run))
    assert abs(math.hypot(north, east) - run) < 1e-6


def test_known_distance() -> None:
    # one minute of latitude at 41 N on WGS-84: M(41 deg) * pi / 10800
    a, e2, lat = 6378137.0, 0.00669437999014, math.radians(41.0)
    meridian = a * (1 - e2) / (1 - e2 * math.sin(lat) ** 2) ** 1.5
    half = math.radians(0.5 / 60)
    distance, bearing = inverse(lat - half, 0.0, lat + half, 0.0)
    assert abs(distance - meridian * math.radians(1 / 60)) < 1e-3
    assert abs(bearing) < 1e-12


@given(st.floats(-1.5, 1.5), LONGITUDES, st.floats(-6, 0), st.floats(-1, 1), st.floats(-1, 1))
def test_the_bound_of_a_distance_is_never_short_and_hardly_long(lat, lon, power, north, east):
    scale = 10.0**power
    one, other = (lat, lon), (max(min(lat + north * scale, 1.5), -1.5), lon + east * scale)
    exact_m = inverse(*one, *other)[0]
    assert exact_m * (1.0 - 1e-7) - 1e-5 <= at_most_m(*one, *other) <= exact_m * 1.011 + 1e-5
