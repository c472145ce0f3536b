"""A compass that turns otherwise than rate sensor and course do is found wrong; a rate sensor that is wrong itself makes no compass so."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from mavlink_bridge.language.units import wrap_pi
from sitl.plant import Truth
from sitl.sensors import SimulatedSensors
from tools.benches.cells.sensor_rig import SensorRig, circle


class Turning(SensorRig):
    """A boat on a circle with a current; her compass makes ``counts`` of each turn, her rate sensor tells ``rate`` of what it is told."""

    def __init__(self, speed_mps: float = 1.5, sensors: SimulatedSensors | None = None) -> None:
        super().__init__(circle(8.0, speed_mps, (0.0, 0.3)), sensors=sensors)
        self.counts = 1.0
        self.late_s = 0.0
        self.rate: Callable[[float], float] = lambda r_radps: r_radps
        self._psi_rad, self._seen = self.motion(0.0).psi_rad, self.suite.step
        self._told_rad = self._psi_rad
        self.suite.step = self._altered  # type: ignore[method-assign]

    def _altered(self, now_us: int, truth: Truth) -> list[bytes]:
        self._told_rad += self.counts * wrap_pi(truth.psi_rad - self._psi_rad)
        self._psi_rad = truth.psi_rad
        told_rad = wrap_pi(self._told_rad - self.late_s * truth.r_radps)
        return self._seen(now_us, replace(truth, psi_rad=told_rad, r_radps=self.rate(truth.r_radps)))

    def said(self) -> list[str]:
        return [text for _, _, text in self.texts if "turn" in text]

    def off_deg(self) -> float:
        assert self.state.psi_rad is not None
        return abs(math.degrees(wrap_pi(self.state.psi_rad - self.truth.psi_rad)))


@pytest.mark.parametrize("counts", [-1.0, 2.0, 0.2])
def test_a_compass_that_turns_otherwise_than_the_vessel_is_given_up_until_it_goes_along_with_a_turn(
    counts: float,
) -> None:
    made = Turning()
    made.run(20.0)
    made.counts = counts
    made.run(15.0)
    told = ["Heading: NMEA GPHDT contradicts the turns that turn rate and course tell: not used"]
    assert made.said() == [*told, "It is believed again after a turn of 60 deg that it goes along with: by hand"]
    assert made.state.heading_from_course
    assert made.off_deg() < 15.0
    assert made.state.drift_n_mps == pytest.approx(0.0, abs=0.2)
    assert made.state.drift_e_mps == pytest.approx(0.3, abs=0.2)
    made.run(90.0)
    assert made.state.heading_from_course, "it does not come back while it contradicts"
    made._told_rad, made.counts = made.truth.psi_rad, 1.0
    made.run(20.0)
    assert made.said()[-1] == "Heading: NMEA GPHDT goes along with the turns again"
    assert not made.state.heading_from_course
    assert made.off_deg() < 3.0


@pytest.mark.parametrize(
    "sensors", [SimulatedSensors(heading_hz=1.0), SimulatedSensors(fix_hz=1.0, grade="standalone")]
)
def test_a_slow_compass_and_a_slow_receiver_show_it_as_well(sensors: SimulatedSensors) -> None:
    made = Turning(sensors=sensors)
    made.run(20.0)
    made.counts = -1.0
    made.run(20.0)
    assert made.said()


@pytest.mark.parametrize(
    "rate", [lambda r: -r, lambda r: 0.0, lambda r: 0.35, lambda r: 60.0 * r, lambda r: r / 60.0, lambda r: 2.0 * r]
)
def test_a_rate_sensor_that_is_wrong_makes_no_compass_wrong(rate: Callable[[float], float]) -> None:
    made = Turning()
    made.run(20.0)
    made.rate = rate
    made.run(90.0)
    assert made.said() == []


@pytest.mark.parametrize("speed_mps", [0.8, 1.5, 3.0])
@pytest.mark.parametrize(
    "sensors", [SimulatedSensors(), SimulatedSensors(heading_hz=1.0, fix_hz=1.0, grade="standalone")]
)
def test_a_compass_that_is_late_in_each_turn_goes_along(sensors: SimulatedSensors, speed_mps: float) -> None:
    made = Turning(speed_mps, sensors)
    made.run(20.0)
    made.late_s = 1.5
    made.run(40.0)
    assert made.said() == []
