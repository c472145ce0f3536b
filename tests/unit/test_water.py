"""The simulated water: what is switched off is gone."""

import random

from sitl.plant import SimVessel, Water, WaterConfig
from sitl.plant.library import load_vessel


def test_wind_current_and_waves_that_are_switched_off_leave_nothing():
    """The last gust blew on for ever at 0.6 m/s, and the hull lay heeled by 3 degrees in a flat calm."""
    water = Water(
        WaterConfig(current_mps=0.5, current_sigma_mps=0.1, wind_mps=8.0, wave_height_m=0.3), random.Random(1)
    )
    hull = SimVessel(load_vessel("otter"))
    for _ in range(600):
        water.step(0.05)
        hull.step(0.05, 0.0, 0.0, 0.0, 0.0, water)
    assert hull.roll_rad
    water.configure(WaterConfig())
    for _ in range(10):
        water.step(0.05)
        hull.step(0.05, 0.0, 0.0, 0.0, 0.0, water)
    assert (water.wind_n_mps, water.wind_e_mps, water.current_n_mps, water.current_e_mps) == (0.0, 0.0, 0.0, 0.0)
    assert (hull.roll_rad, hull.pitch_rad, hull.heave_m) == (0.0, 0.0, 0.0)
