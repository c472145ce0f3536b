"""A compass that is late by what its settings say: the law leaves room for it."""

import pytest

from companion.core.estimate import Estimator, EstimatorConfig
from companion.core.steer.bandwidth import Wishes, heading_schedule
from companion.settings.schema import Settings
from mavlink_bridge.language.messages import AngularVelocity, EulerAngles
from sitl.plant.library import load_vessel

OTTER = load_vessel("otter")


def test_a_late_compass_makes_the_heading_loop_slower_and_leaves_the_same_margins():
    late, prompt = (heading_schedule(OTTER, Wishes(2.2, 0.9, 0.15, late_s)) for late_s in (0.25, 0.0))
    assert late.gains[4].omega_radps < 0.8 * prompt.gains[4].omega_radps
    assert late.worst.holds


def test_the_law_takes_the_latest_compass_of_the_settings_unless_told_otherwise():
    sensors = [
        {"name": name, "url": "tcp://host:1", "nmea": {"heading_latency_s": late}}
        for name, late in (("a", 0.1), ("b", 0.25))
    ]
    assert Settings.model_validate({"sensors": sensors}).steering.model.heading_late_s == 0.25
    told = {"sensors": sensors, "steering": {"model": {"heading_late_s": 0.05}}}
    assert Settings.model_validate(told).steering.model.heading_late_s == 0.05
    assert Settings().steering.model.heading_late_s == 0.0


def test_the_estimator_takes_the_latest_compass_of_the_settings_unless_told_otherwise():
    sensors = [{"name": "a", "url": "tcp://host:1", "nmea": {"heading_latency_s": 0.25}}]
    assert Settings.model_validate({"sensors": sensors}).estimate.heading_late_s == 0.25
    told = {"sensors": sensors, "estimate": {"heading_late_s": 0.05}}
    assert Settings.model_validate(told).estimate.heading_late_s == 0.05
    assert Settings().estimate.heading_late_s == 0.0


@pytest.mark.parametrize("late_s", [0.0, 0.3, 0.6, 0.9])
def test_a_compass_that_speaks_is_never_lost_however_late_it_is_and_a_silent_one_as_soon_as_ever(late_s):
    """At 10 Hz, and 0.57 s late by the settings: older than 0.5 s when they came, its headings were lost again and again."""
    eyes = Estimator(EstimatorConfig(heading_late_s=late_s))
    late_us, steps = round(late_s * 1e6), range(10, 60)
    for now_us in (100_000 * k for k in steps):
        eyes.update(EulerAngles(now_us - late_us, psi_rad=1.0))
        eyes.update(AngularVelocity(now_us - late_us, r_radps=0.0))
        assert eyes.predict(now_us + 90_000).psi_rad == pytest.approx(1.0, abs=1e-3)
        assert eyes.has_turn_rate(now_us + 90_000)
    last_us = 100_000 * steps[-1]
    assert eyes.predict(last_us + 490_000).psi_rad is not None
    assert eyes.predict(last_us + 510_000).psi_rad is None
