"""The path's integral takes out what stands beside a leg, and nothing of what is being closed."""

import math

import pytest

from companion.core.guide.field import Integrator, approach, standing_share

DT_S, LOOK_AHEAD_M = 0.05, 2.0


def offsets_m(from_m, speed_mps, *, heading_off_rad=0.0, seconds=120.0):
    """Offsets of a hull that makes each course good at once, but for what its compass is off."""
    integral, offset_m, found, angle_rad = Integrator(), from_m, [], 0.0
    for _ in range(round(seconds / DT_S)):
        across_mps = speed_mps * math.sin(heading_off_rad - angle_rad)
        standing = standing_share(offset_m, LOOK_AHEAD_M, speed_mps, across_mps)
        steered_m = integral.step(DT_S, offset_m, LOOK_AHEAD_M, gain=0.3, corridor_m=2.0, standing=standing)
        angle_rad, _ = approach(steered_m, LOOK_AHEAD_M, 5.0, 0.0)
        offset_m += across_mps * DT_S
        found.append(offset_m)
    return found


@pytest.mark.parametrize("from_m", [1.9, -1.9, 1.0])
@pytest.mark.parametrize(("speed_mps", "most_m"), [(0.5, 0.1), (1.5, 0.05), (2.5, 0.05)])
def test_a_hull_that_joins_a_leg_is_not_carried_past_it(from_m, speed_mps, most_m):
    """0.1 to 0.3 m when the way to the leg was summed up, too."""
    past_m = max(-math.copysign(1.0, from_m) * offset_m for offset_m in offsets_m(from_m, speed_mps))
    assert past_m < most_m


@pytest.mark.parametrize("off_deg", [3.0, -3.0])
@pytest.mark.parametrize("speed_mps", [0.5, 1.5, 2.5])
def test_a_compass_that_is_off_does_not_hold_a_hull_beside_the_leg(off_deg, speed_mps):
    assert abs(offsets_m(0.0, speed_mps, heading_off_rad=math.radians(off_deg))[-1]) < 0.01
