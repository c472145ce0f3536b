"""Scaling into MAVLink fields: sentinels for the unknown, limits for the impossible, and exact round trips."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.mavlink.wire import mapping


@given(st.integers(-1_800_000_000, 1_800_000_000))
def test_positions_survive_the_round_trip_bit_for_bit(value):
    assert mapping.rad_to_degE7(mapping.degE7_to_rad(value)) == value


@pytest.mark.parametrize(
    ("angle_deg", "expected"),
    [(0.0, 0), (359.994, 35_999), (359.996, 0), (-90.0, 27_000), (-0.001, 0), (720.5, 50)],
)
def test_headings_are_0_to_35999_centidegrees(angle_deg, expected):
    assert mapping.rad_to_cdeg(math.radians(angle_deg)) == expected


def test_north_is_36000_in_the_one_field_where_0_means_no_compass():
    assert mapping.rad_to_yaw_cdeg(0.0) == 36_000
    assert mapping.rad_to_yaw_cdeg(math.radians(90.0)) == 9_000
    assert mapping.rad_to_yaw_cdeg(None) == 65_535
    assert mapping.rad_to_yaw_cdeg(0.0, fitted=False) == 0


# function, unknown, (in, out) pairs
TABLE = [
    (mapping.rad_to_cdeg, 65_535, [(math.pi, 18_000)]),
    (mapping.mps_to_cms, 65_535, [(1.234, 123), (-1.0, 0), (1e9, 65_534)]),
    (mapping.mps_to_cms_signed, 0, [(-1.5, -150), (1e9, 32_767), (-1e9, -32_767)]),
    (mapping.mps_to_fifths, 255, [(1.0, 5), (100.0, 254)]),
    (mapping.m_to_mm, 0, [(-1.5, -1_500), (1e12, 2_147_483_647)]),
    (mapping.m_to_mm_u32, 0, [(0.014, 14), (-1.0, 0)]),
    (mapping.m_to_cm, 0, [(4.0, 400), (655.35, 65_535), (9_999.0, 65_535), (-1.0, 0)]),
    (mapping.m_to_dam, 0, [(123.0, 12)]),
    (mapping.m_to_m16, 0, [(12.6, 13)]),
    (mapping.m_to_m_i16, 0, [(-12.6, -13), (1e9, 32_767)]),
    (mapping.m_to_dm, 255, [(0.014, 0), (1.26, 13), (99.0, 254), (-1.0, 0)]),
    (mapping.dop_to_u16, 65_535, [(0.9, 90), (1e6, 65_534)]),
    (mapping.share_to_percent, -1, [(0.5, 50), (7.0, 100)]),
    (mapping.thrust_to_percent, 0, [(-0.3, 0), (0.42, 42)]),
    (mapping.v_to_mv, 65_535, [(12.3, 12_300)]),
    (mapping.a_to_ca, -1, [(1.5, 150)]),
    (mapping.rad_to_deg_i8, 127, [(math.radians(-30.0), -30), (10.0, 126)]),
    (mapping.bottom_clearance_m, -1.0, [(4.5, 4.5), (-0.2, 0.0)]),
]


@pytest.mark.parametrize(("function", "unknown", "pairs"), TABLE, ids=[row[0].__name__ for row in TABLE])
def test_values_are_scaled_limited_and_unknown_has_its_sentinel(function, unknown, pairs):
    assert [function(value) for value, _ in pairs] == [expected for _, expected in pairs]
    assert function(None) == function(math.nan) == function(math.inf) == unknown


def test_unknown_positions_use_the_sentinel_that_the_field_defines():
    assert mapping.rad_to_degE7(None) == 0x7FFFFFFF
    assert mapping.rad_to_degE7(math.nan, unknown=0) == 0
    assert mapping.degE7_to_rad(0x7FFFFFFF) is None
    assert mapping.degE7_to_rad(-0x80000000) is None
    assert mapping.deg_to_degE7(math.nan) == mapping.deg_to_degE7(1e30) == 0x7FFFFFFF


def test_time_since_boot_wraps_after_50_days():
    assert mapping.boot_ms(1_500_999) == 1_500
    assert mapping.boot_ms((2**32 + 7) * 1_000) == 7


@pytest.mark.parametrize("lat_deg", [-60.0, -41.185, 0.0, 41.185, 69.0])
@pytest.mark.parametrize("lon_deg", [-8.7, 179.99])
@pytest.mark.parametrize("distance_m", [0.0, 100.0, 2_000.0, 5_000.0])
def test_an_offset_is_the_estimators_own(lat_deg, lon_deg, distance_m):
    frame = LocalFrame(math.radians(lat_deg), math.radians(lon_deg))
    for bearing_deg in range(0, 360, 30):
        angle_rad = math.radians(bearing_deg)
        wanted = distance_m * math.cos(angle_rad), distance_m * math.sin(angle_rad)
        found = mapping.offset_m(frame.lat_rad, frame.lon_rad, *frame.to_geodetic(*wanted))
        assert math.dist(found, wanted) < 0.1
