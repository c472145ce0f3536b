"""Row 59: gains that do not fit together are refused; ones that got in anyway lose their thrust before they do harm."""

from __future__ import annotations

import cmath
import math

import pytest

from companion.core.steer.gain_check import GAIN_DB, PHASE_DEG, gains_problem, margins
from companion.core.steer.law import ModelConfig, SteeringConfig
from companion.settings.schema import load_vessel
from mavlink_bridge.language.requests import Result, SetParameter
from tools.benches.cells.drawn_hulls import drawn
from tools.benches.cells.foreign_hulls import bare
from tools.benches.cells.trial_cells import wrong

SEED = ("steering.profile=seed", "steering.seed.speed_gains={kp=0.6, ki=0.15}")
LIMIT = math.sqrt(0.3)
"""What FS_OSC_THRUST leaves: 30 % of the thrust of a propeller whose thrust is the square of its output."""


def thrust(trip):
    return max(abs(trip.snapshot.output.thruster_port), abs(trip.snapshot.output.thruster_starboard))


@pytest.mark.parametrize(
    "gains",
    [
        ("steering.seed.heading_gains={kp=50.0, ki=0.0, kd=0.0}", "steering.seed.max_thruster_differential=1.0"),
        ("steering.seed.heading_gains={kp=2.0, ki=0.0, kd=20.0}", "steering.seed.max_thruster_differential=1.0"),
        ("steering.seed.heading_gains={kp=20.0, ki=0.0, kd=20.0}", "steering.seed.max_thruster_differential=1.0"),
    ],
    ids=["far too much P", "far too much D", "both"],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_row_59_a_vessel_with_unstable_gains_loses_its_thrust_within_three_seconds(voyage, measured, gains, seed):
    trip = voyage(*SEED, *gains, seed=seed)
    trip.sail(1.5, (400.0, 0.0))
    swings: list[float] = []
    sides = [0.0] * 3
    while "oscillating" not in trip.snapshot.causes:
        trip.step()
        output = trip.snapshot.output
        for i, share in enumerate(
            (output.thruster_port, output.thruster_starboard, math.degrees(output.rudder_port_rad) / 30)
        ):
            side = math.copysign(1.0, share) if abs(share) > 0.5 else sides[i]
            if side and side == -sides[i]:
                swings = [*swings, trip.now_s] if swings and trip.now_s - swings[-1] < 1.5 else [trip.now_s]
            sides[i] = side
        assert trip.now_s < 60.0, f"it was never noticed: {trip.texts}, {trip.snapshot.output}"
    took_s = trip.now_s - swings[0]
    assert took_s <= 3.0
    trip.run(2.0)
    for _ in range(200):
        trip.step()
        assert thrust(trip) <= LIMIT + 1e-9
        assert all(abs(pulse - 1500.0) <= 0.6 * 500.0 for pulse in trip.board.pulses_us[:2]), "at the pins"
    assert any("oscillates" in text for text in trip.texts)
    if "kp=50" in gains[0]:  # the slowest to show
        measured(59, f"unstable gains: thrust cut {took_s:.2f} s after the first full swing")


@pytest.mark.parametrize(
    ("set_first", "refused"),
    [
        ({"SPEED_P": 3.0}, ("SPEED_I", 2.0)),
        ({"SPEED_P": 4.0}, ("SPEED_I", 1.5)),
        ({}, ("STEER_INT", 1.0)),
        ({"STEER_INT": 0.05, "STEER_BW": 0.8}, ("STEER_INT", 0.6)),
    ],
)
def test_row_59_gains_that_do_not_fit_together_are_refused_with_the_reason(voyage, set_first, refused):
    trip = voyage()
    for name, value in set_first.items():
        assert trip.ask(SetParameter(name, value)).reason == "", "each of them alone is fine"
    before = trip.world.app.settings
    reply = trip.ask(SetParameter(*refused))
    assert reply.result is Result.DENIED
    assert refused[0] in reply.reason
    assert "unstable" in reply.reason
    assert trip.world.app.settings == before
    assert trip.ask(SetParameter("WP_RADIUS", 3.0)).reason == "", "other parameters are not held up"


def test_row_59_configured_gains_that_do_not_fit_are_told_at_the_start(voyage):
    trip = voyage("steering.model.speed_gain=5.0", "steering.model.speed_integral=2.0")
    assert any(text.startswith("Steering: the speed loop (SPEED_P 5, SPEED_I 2)") for text in trip.texts)
    assert not any("Steering:" in text for text in voyage().texts)


@pytest.mark.parametrize("vessel", ["otter", "blueboat", "plant_b", "wamv"])
def test_the_shipped_gains_fit_every_shipped_vessel(vessel):
    assert gains_problem(SteeringConfig(), load_vessel(vessel)) == ""
    assert gains_problem(SteeringConfig(model=ModelConfig(speed_gain=5.0, speed_integral=2.0)), load_vessel(vessel))
    assert gains_problem(SteeringConfig(profile="seed"), load_vessel(vessel)) == "", "not judged"


_HARD = {
    **{f"default hull, file wrong by half, {draw}": wrong(load_vessel("otter"), draw) for draw in range(1, 21)},
    **{f"fast {seed}": drawn("fast", seed) for seed in (3, 4, 8)},
    **{f"heavy {seed}": drawn("heavy", seed) for seed in (0, 3, 6)},
    "bare, Munk moment whole": bare("otter", 1.0),
}


@pytest.mark.parametrize("vessel", _HARD.values(), ids=_HARD)
def test_the_shipped_gains_start_any_hull_whatever_its_file_says(vessel):
    """One file in eight that is wrong by half was refused, and a third of hulls drawn at random; the schedule mends what they need."""
    assert gains_problem(SteeringConfig(), vessel) == ""
    assert gains_problem(SteeringConfig(model=ModelConfig(speed_gain=5.0, speed_integral=2.0)), vessel)


def test_margins_are_those_of_the_textbook():
    """An integrator with a delay: crossing at its gain; phase margin 90 degrees less gain x delay; unstable at pi/2."""
    for gain, stable in ((0.5, True), (1.5, True), (1.6, False)):
        gain_db, phase_deg = margins(lambda s, gain=gain: gain / s * cmath.exp(-s))
        assert phase_deg == pytest.approx(90.0 - math.degrees(gain), abs=0.5)
        assert gain_db == pytest.approx(20.0 * math.log10(0.5 * math.pi / gain), abs=0.1)
        assert (phase_deg > 0.0) == stable
    assert PHASE_DEG > 0.0
    assert GAIN_DB > 0.0
