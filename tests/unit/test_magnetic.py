"""The World Magnetic Model: the published test values, its limits, and its use by a compass that says no variation."""

from __future__ import annotations

import math

import pytest

from companion.core.estimate.estimator import EstimatorConfig
from companion.core.magnetic import MagneticModel
from mavlink_bridge.language.units import wrap_pi
from sitl.sensors.talkers import SimulatedSensors
from tools.benches.cells.sensor_rig import SensorRig, circle

EPOCH_US = 1_735_689_600_000_000
HALF_US = round(2.5 * 365.25 * 86_400e6)


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "later_us", "variation_deg"),
    [
        (80, 0, 0, 1.28),
        (0, 120, 0, -0.16),
        (-80, 240, 0, 68.78),
        (80, 0, HALF_US, 2.59),
        (0, 120, HALF_US, -0.24),
        (-80, 240, HALF_US, 68.49),
    ],
)
def test_values_published_with_the_model(lat_deg: float, lon_deg: float, later_us: int, variation_deg: float) -> None:
    found = MagneticModel().variation_rad(math.radians(lat_deg), math.radians(lon_deg), EPOCH_US + later_us)
    assert found is not None
    assert math.degrees(found) == pytest.approx(variation_deg, abs=0.01)


def test_no_variation_outside_the_models_years_or_at_the_magnetic_pole() -> None:
    model = MagneticModel()
    assert model.variation_rad(0.7, -0.15, EPOCH_US - 86_400_000_001) is None
    assert model.variation_rad(0.7, -0.15, EPOCH_US + 2 * HALF_US + 86_400_000_001) is None
    assert model.variation_rad(math.radians(86.0), math.radians(140.0), EPOCH_US) is None
    assert model.variation_rad(0.7, -0.15, EPOCH_US) is not None


def test_a_bare_magnetic_compass_gets_its_variation_from_the_model() -> None:
    """Off Porto the model says about -0.95 degrees; the talker sends none."""
    sensors = SimulatedSensors(grade="ideal", heading_sentence="HDM", sentences="ZDA, GGA, RMC, VTG")
    rig = SensorRig(circle(20.0, 1.5), sensors=sensors)
    rig.run(10.0)
    shift = math.degrees(wrap_pi(rig.state.psi_rad - rig.truth.psi_rad))
    assert shift == pytest.approx(-0.95, abs=0.1)
    without = SensorRig(circle(20.0, 1.5), sensors=sensors, estimate=EstimatorConfig(world_magnetic_model=False))
    without.run(10.0)
    assert without.state.heading_from_course


@pytest.mark.parametrize("kind", ["HDG", "HDM"])
def test_a_variation_of_zero_was_never_set_and_the_model_is_asked(kind: str) -> None:
    """0.0,E in HDG and in RMC: where the compass is 17 degrees off she sailed by it for the whole plan, without a word."""
    sensors = SimulatedSensors(grade="ideal", heading_sentence=kind, sentences="ZDA, GGA, RMC, VTG", variation_deg=0.0)
    rig = SensorRig(circle(20.0, 1.5), sensors=sensors)
    rig.run(10.0)
    assert math.degrees(wrap_pi(rig.state.psi_rad - rig.truth.psi_rad)) == pytest.approx(-0.95, abs=0.1)
    alone = SensorRig(circle(20.0, 1.5), sensors=sensors, estimate=EstimatorConfig(world_magnetic_model=False))
    alone.run(10.0)
    assert math.degrees(wrap_pi(alone.state.psi_rad - alone.truth.psi_rad)) == pytest.approx(0.0, abs=0.1)
    assert not alone.state.heading_from_course


@pytest.mark.parametrize(("variation_deg", "said"), [(-12.5, 1), (2.0, 0)])
def test_a_variation_that_is_not_that_of_these_waters_is_told_once(variation_deg: float, said: int) -> None:
    sensors = SimulatedSensors(grade="ideal", heading_sentence="HDG", variation_deg=variation_deg)
    rig = SensorRig(circle(20.0, 1.5), sensors=sensors)
    rig.run(40.0)
    told = [text for _, _, text in rig.texts if "variation" in text]
    assert len(told) == said
    assert all(text == "Heading: the told variation is 12 deg W, here it is 1 deg W: set the compass" for text in told)
    assert math.degrees(wrap_pi(rig.state.psi_rad - rig.truth.psi_rad)) == pytest.approx(0.0, abs=0.2)
