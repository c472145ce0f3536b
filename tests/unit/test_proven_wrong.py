"""A compass that thrust has proven wrong: no water that it made itself, and no bow that swings by, makes it right again."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from mavlink_bridge.language.units import wrap_pi
from tests.soaked import in_the_soak
from tools.benches.cells.sensor_rig import Motion, Pose, SensorRig

SAILS_S = 120.0
"""So long she sails straight on while the compass creeps away; then thrust stops, and the next change of way proves it wrong."""
WAY_MPS = 1.5


def pose_of(speed_mps: Callable[[float], float], psi_rad: Callable[[float], float], stream: complex) -> Motion:
    made = [0.0, 0.0, 0.0]

    def pose(t_s: float) -> Pose:
        u_mps, psi = speed_mps(t_s), wrap_pi(psi_rad(t_s))
        vn, ve = u_mps * math.cos(psi) + stream.real, u_mps * math.sin(psi) + stream.imag
        past_s, made[2] = t_s - made[2], t_s
        made[0] += vn * past_s
        made[1] += ve * past_s
        return Pose(made[0], made[1], psi, vn, ve, u_mps=u_mps)

    return pose


def sails_and_stops(again_s: float = math.inf) -> Callable[[float], float]:
    def speed_mps(t_s: float) -> float:
        if t_s < SAILS_S:
            return WAY_MPS
        stopped = WAY_MPS * math.exp(-(t_s - SAILS_S) / 2.0)
        return stopped if t_s < again_s else WAY_MPS * (1.0 - math.exp(-(t_s - again_s) / 2.0))

    return speed_mps


def found_wrong(motion: Motion, creeps_to_deg: float, *, has_rate: bool = True) -> SensorRig:
    """Run until the compass is found to be wrong; from then on it is off by the same."""
    made = SensorRig(motion)
    made.suite.faults.rate_silent = not has_rate

    def creep(here: SensorRig) -> None:
        off_deg = max(0.0, here.now_us * 1e-6 - 20.0) * math.copysign(1.0, creeps_to_deg)
        here.suite.faults.heading_bias_deg = off_deg if abs(off_deg) < abs(creeps_to_deg) else creeps_to_deg

    while not any("not believed" in text for _, _, text in made.texts):
        assert made.now_us < 140e6, "never found"
        made.run(0.05, creep)
    made.texts.clear()
    return made


def believed_after_s(made: SensorRig, seconds: float) -> float | None:
    """When she has a heading again, of the compass or of a course."""
    since_us, found = made.now_us, None
    while found is None and made.now_us < since_us + round(seconds * 1e6):
        made.run(0.05)
        # A course may stand in while she loses her way.
        if made.state.psi_rad is not None and made.now_us > since_us + 4_000_000:
            found = (made.now_us - since_us) * 1e-6
    return found


@pytest.mark.parametrize("has_rate", [True, False])
@pytest.mark.parametrize(("off_deg", "stream"), [(80.0, 0.1 + 0.3j), *in_the_soak((-80.0, 0j), (95.0, -0.3 + 0.2j))])
def test_row_31_at_rest_it_is_tried_again_after_60_s_and_no_sooner(
    off_deg: float, stream: complex, has_rate: bool
) -> None:
    """It was "plausible again" after 5 to 11 s: the water that it had made was a course of 1.5 m/s, where it pointed."""
    made = found_wrong(pose_of(sails_and_stops(), lambda t_s: 0.4, stream), off_deg, has_rate=has_rate)
    after_s = believed_after_s(made, 90.0)
    assert after_s is not None
    assert 59.0 < after_s < 80.0
    assert [text for _, _, text in made.texts if "Compass" in text] == ["Compass: new heading accepted after 60 s"]


def test_row_31_a_bow_that_swings_where_the_compass_was_expected_makes_it_no_better() -> None:
    """Without a turn rate sensor nothing tells of the swing."""

    def swings(t_s: float) -> float:
        return 0.4 - math.radians(80.0) * min(1.0, max(0.0, t_s - SAILS_S - 10.0) / 10.0)

    made = found_wrong(pose_of(sails_and_stops(), swings, 0j), 80.0, has_rate=False)
    assert believed_after_s(made, 40.0) is None


def by_hand(off_deg: float, seconds: float) -> SensorRig:
    """At rest for 20 s, then straight on by hand for so long; the compass is off by so much by then."""
    again_s = SAILS_S + 25.0
    made = found_wrong(pose_of(sails_and_stops(again_s), lambda t_s: 0.4, 0.1 + 0.3j), 80.0)
    made.run(20.0)
    made.suite.faults.heading_bias_deg = off_deg
    made.run(again_s + seconds - made.now_us * 1e-6)
    return made


def off_deg_of(made: SensorRig) -> float:
    assert made.state.psi_rad is not None
    return abs(math.degrees(wrap_pi(made.state.psi_rad - made.truth.psi_rad)))


def test_row_31_ten_seconds_of_straight_way_by_hand_bear_out_one_that_has_come_right() -> None:
    made = by_hand(0.0, 15.0)
    assert not made.state.heading_from_course
    assert off_deg_of(made) < 5.0


def test_row_31_a_way_by_hand_does_not_bear_out_one_that_is_still_wrong() -> None:
    made = by_hand(80.0, 50.0)
    assert made.state.heading_from_course
    assert off_deg_of(made) < 30.0
