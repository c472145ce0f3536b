"""Motion carried by the model between measurements: what the model does not know of must not stand in it."""

import math

import pytest

from companion.core.hull import ForceModel
from companion.core.steer.observer import WaterSpeedObserver
from mavlink_bridge.language.messages import ActuatorOutput, EstimatedState
from tools.benches.cells.foreign_hulls import bare

TICK_S = 0.05
_STRAIGHT_S = 5.0
"""Way is on before the turn."""


def seen(munk, seconds, rate_radps):
    """The turn rate after a steady turn has been measured for so long, by an observer with this share of the Munk moment."""
    vessel = bare("otter", munk)
    observer = WaterSpeedObserver(vessel, ForceModel(vessel))
    ahead = ActuatorOutput(0, 0.6, 0.6, 0.0, 0.0, "demand")
    for tick in range(round((_STRAIGHT_S + seconds) / TICK_S)):
        rate = rate_radps if tick * TICK_S >= _STRAIGHT_S else 0.0
        observer.step(TICK_S, EstimatedState(round(tick * TICK_S * 1e6), psi_rad=0.0, r_radps=rate, u_mps=1.5), ahead)
    return observer.rate_radps


@pytest.mark.parametrize("munk", [0.0, 0.5, 1.0])
def test_a_steady_turn_is_seen_as_measured_whatever_the_file_says_of_it(munk):
    """It stood off by the pole times all that the model's moments were wrong: 4 degrees a second on a hull that turns away."""
    assert seen(munk, 8.0, 0.15) == pytest.approx(0.15, abs=math.radians(0.2))


def test_a_turn_that_begins_is_not_seen_late():
    """The model carries the rate from tick to tick: half of a step is there within the pole."""
    assert seen(0.5, 0.15, 0.15) > 0.07


def test_a_lost_turn_rate_leaves_nothing_behind():
    vessel = bare("otter", 1.0)
    observer = WaterSpeedObserver(vessel, ForceModel(vessel))
    for tick in range(100):
        rate = 0.3 if tick < 90 else None
        observer.step(TICK_S, EstimatedState(round(tick * TICK_S * 1e6), psi_rad=0.0, r_radps=rate, u_mps=1.5), None)
    assert observer.rate_radps is None
    observer.step(TICK_S, EstimatedState(5_000_000, psi_rad=0.0, r_radps=0.0, u_mps=1.5), None)
    observer.step(TICK_S, EstimatedState(5_050_000, psi_rad=0.0, r_radps=0.0, u_mps=1.5), None)
    assert observer.rate_radps == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("rate_radps", [7.0, 55.0, math.inf, math.nan])
def test_a_turn_rate_that_no_hull_can_leaves_nothing_behind(rate_radps):
    """The step ran away to infinity, and what is not a number was never forgotten: the vessel's process ended."""
    vessel = bare("otter", 0.5)
    observer = WaterSpeedObserver(vessel, ForceModel(vessel))
    ahead = ActuatorOutput(0, 0.6, 0.6, 0.0, 0.0, "demand")
    fastest = 0.0
    for tick in range(600):
        rate = rate_radps if 200 <= tick < 300 else 0.0
        observer.step(TICK_S, EstimatedState(round(tick * TICK_S * 1e6), psi_rad=0.0, r_radps=rate, u_mps=1.5), ahead)
        assert math.isfinite(observer.u_mps)
        assert math.isfinite(observer.v_mps)
        assert math.isfinite(observer.aligned_mps())
        fastest = max(fastest, abs(observer.u_mps), abs(observer.v_mps))
    assert fastest < 10.0
    assert observer.u_mps == pytest.approx(straight_on(vessel, ahead), abs=0.05)
    assert observer.rate_radps == pytest.approx(0.0, abs=0.01)


def straight_on(vessel, sent):
    """The surge that the same commands lead to with nothing amiss."""
    observer = WaterSpeedObserver(vessel, ForceModel(vessel))
    for tick in range(600):
        observer.step(TICK_S, EstimatedState(round(tick * TICK_S * 1e6), psi_rad=0.0, r_radps=0.0, u_mps=1.5), sent)
    return observer.u_mps
