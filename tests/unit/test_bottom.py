"""The simulated bottom."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.geodesy import LocalFrame
from sitl.plant.bottom import BottomConfig, Flat, Mound, MoundConfig, Slope, SlopeConfig, make_bottom


def test_the_shipped_bottom_is_deep_about_the_start_and_has_a_shoal_a_hole_and_a_slope():
    bottom = make_bottom(BottomConfig())
    assert min(bottom.depth_at(n, e) for n in range(-80, 81, 10) for e in range(-80, 81, 10)) == 20.0
    assert bottom.depth_at(120.0, 0.0) == pytest.approx(2.5)
    assert bottom.depth_at(0.0, -120.0) == pytest.approx(30.0)
    assert bottom.depth_at(0.0, 250.0) == pytest.approx(15.0)
    assert bottom.depth_at(0.0, 10_000.0) == 0.2


def test_flat_slope_and_mound():
    assert Flat(7.0).depth_at(1.0, 2.0) == 7.0
    north = Slope(Flat(10.0), 0.1, 0.0, 5.0)
    assert [north.depth_at(n, 99.0) for n in (0.0, 5.0, 15.0)] == [10.0, 10.0, 9.0]
    south_west = Slope(Flat(10.0), 0.1, math.radians(225.0))
    assert south_west.depth_at(-10.0, -10.0) == pytest.approx(10.0 - 0.1 * math.hypot(10.0, 10.0))
    hill = Mound(Flat(10.0), 0.0, 0.0, 10.0, 4.0)
    assert [hill.depth_at(n, 0.0) for n in (0.0, 10.0, 50.0)] == [6.0, 10.0, 10.0]
    assert hill.depth_at(5.0, 0.0) == pytest.approx(8.0)
    assert Mound(Flat(3.0), 0.0, 0.0, 10.0, 9.0).depth_at(0.0, 0.0) == 0.2


def test_configured_kinds_and_tide(tmp_path):
    assert make_bottom(BottomConfig(kind="flat", depth_m=6.0, tide_m=-1.0)).depth_at(0.0, 500.0) == 5.0
    custom = BottomConfig(
        slope=SlopeConfig(bearing_deg=0.0, start_m=0.0, gradient=0.5), mounds=(MoundConfig(height_m=1.0),)
    )
    assert make_bottom(custom).depth_at(10.0, 500.0) == pytest.approx(15.0)
    assert make_bottom(BottomConfig(slope=None, mounds=())).depth_at(0.0, 900.0) == 20.0
    file = tmp_path / "bank.xyz"
    file.write_text("-8.70 41.18 5.0\n-8.70 41.1801 7.0\n", "utf-8")
    frame = LocalFrame(math.radians(41.18), math.radians(-8.70))
    bottom = make_bottom(BottomConfig(kind="file", file=file, tide_m=1.0), frame)
    assert bottom.depth_at(0.0, 0.0) == pytest.approx(6.0, abs=0.01)
    assert 6.0 < bottom.depth_at(5.5, 0.0) < 8.0
    assert bottom.depth_at(100.0, 100.0) is None
    with pytest.raises(ValueError, match="needs a file"):
        make_bottom(BottomConfig(kind="file"), frame)
