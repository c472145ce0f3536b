"""A compass that is late by what its settings say: the law leaves room for it."""

from companion.core.steer.bandwidth import Wishes, heading_schedule
from companion.settings.schema import Settings
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
