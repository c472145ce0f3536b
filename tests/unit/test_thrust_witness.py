"""A compass that thrust contradicts is found wrong; current, wind, eddies and a file that is wrong by half do not make one so."""

from __future__ import annotations

import cmath
import math
import random
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import pytest

from companion.core.estimate.doubts.borne_out import BorneOut
from companion.core.estimate.doubts.witness import SeenFix, ThrustWitness

DT_S = 0.05


class Receiver(NamedTuple):
    """How often a receiver tells how well of its place and its velocity; None: nothing of that."""

    hz: int
    sigma_m: float
    sigma_mps: float | None


RTK = Receiver(5, 0.03, 0.05)
FINE = [RTK, Receiver(1, 0.03, None)]
PLAIN = [Receiver(5, 0.4, 0.12), Receiver(1, 0.4, 0.12)]
ROUGH = [Receiver(5, 0.4, None), Receiver(1, 0.4, None)]


def watched(
    seconds: float,
    *,
    off_deg: float = 0.0,
    share: float = 1.0,
    way_mps: Callable[[float], float] = lambda t_s: 1.5 * (1.0 - math.exp(-t_s / 4.0)),
    carried: Callable[[float], complex] = lambda t_s: 0j,
    bow_rad: Callable[[float], float] = lambda t_s: 0.4,
    steered_rad: Callable[[float], float] | None = None,
    receiver: Receiver = RTK,
) -> tuple[float, float] | None:
    """When, s, and by how much, degrees, a compass that is so far off is found wrong; None when it never is.

    ``steered_rad``: what the compass says, where that is not the bow and ``off_deg``.
    """
    witness, noise = ThrustWitness(), random.Random(1)
    place, fix_s = 0j, 0.0

    def near(true: complex, sigma: float) -> tuple[float, float]:
        return true.real + noise.gauss(0.0, sigma), true.imag + noise.gauss(0.0, sigma)

    for tick in range(round(seconds / DT_S)):
        t_s = tick * DT_S
        told_rad = bow_rad(t_s) + math.radians(off_deg) if steered_rad is None else steered_rad(t_s)
        bow = cmath.rect(1.0, told_rad)
        ground = share * way_mps(t_s) * cmath.rect(1.0, bow_rad(t_s)) + carried(t_s)
        place += ground * DT_S
        is_fix = tick % round(1.0 / (receiver.hz * DT_S)) == 0
        mps = None if receiver.sigma_mps is None else near(ground, receiver.sigma_mps)
        told = SeenFix(round(t_s * 1e6), near(place, receiver.sigma_m), receiver.sigma_m, mps) if is_fix else None
        found = witness.step(DT_S, bow=(bow.real, bow.imag), through_mps=(way_mps(fix_s), 0.0), told=told)
        fix_s = t_s if is_fix else fix_s
        if found is not None:
            return t_s, math.degrees(found)
    return None


def gathers_way(t_s: float) -> float:
    return 1.5 * (1.0 - math.exp(-max(t_s - 5.0, 0.0) / 3.0))


@pytest.mark.parametrize(
    ("receiver", "share", "within_s"),
    [(receiver, share, 8.0) for receiver in FINE for share in (1.0, 2.0)]
    + [(receiver, 0.5, 9.5) for receiver in FINE]
    + [(receiver, share, 8.0) for receiver in PLAIN for share in (1.0, 2.0)]
    + [(receiver, share, 11.0) for receiver in ROUGH for share in (1.0, 2.0)],
)
@pytest.mark.parametrize("off_deg", [180.0, 120.0, 90.0, -60.0])
def test_a_wrong_compass_is_found_as_she_gathers_way(
    off_deg: float, receiver: Receiver, share: float, within_s: float
) -> None:
    """She held her point by it: 240 m off it in 160 s at full thrust, and the contradiction passed for a current of 2.4 m/s."""
    found = watched(25.0, off_deg=off_deg, share=share, way_mps=gathers_way, receiver=receiver)
    assert found is not None
    assert found[0] - 5.0 < within_s
    assert abs(math.remainder(found[1] + off_deg, 360.0)) < 15.0


def test_a_wrong_compass_is_found_in_a_current_and_in_a_turn_and_astern() -> None:
    assert watched(20.0, off_deg=180.0, carried=lambda t_s: 1.2 + 0.8j) is not None
    assert watched(20.0, off_deg=120.0, bow_rad=lambda t_s: 0.2 * t_s) is not None
    assert watched(20.0, off_deg=180.0, way_mps=lambda t_s: -1.2 * (1.0 - math.exp(-t_s / 4.0))) is not None


@pytest.mark.parametrize("receiver", FINE + PLAIN + ROUGH)
@pytest.mark.parametrize("off_deg", [0.0, 20.0, -35.0])
@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_a_compass_that_is_right_or_a_little_off_stands(off_deg: float, share: float, receiver: Receiver) -> None:
    watch = partial(watched, 60.0, off_deg=off_deg, share=share, receiver=receiver)
    assert watch(way_mps=lambda t_s: 1.5 * math.sin(0.3 * t_s)) is None
    assert watch(bow_rad=lambda t_s: 0.15 * t_s) is None


@pytest.mark.parametrize("receiver", FINE + PLAIN + ROUGH)
def test_what_carries_her_and_does_not_change_with_her_thrust_proves_nothing(receiver: Receiver) -> None:
    watch = partial(watched, receiver=receiver)
    current = -2.0 * cmath.rect(1.0, 0.4)
    assert watch(120.0, carried=lambda t_s: current) is None
    assert watch(120.0, carried=lambda t_s: current if t_s > 20.0 else 0j) is None
    eddies = watch(300.0, way_mps=lambda t_s: 1.0, carried=lambda t_s: cmath.rect(0.8, 0.25 * t_s))
    assert eddies is None


@pytest.mark.parametrize("receiver", FINE + PLAIN + ROUGH)
def test_a_tow_and_a_boat_that_is_held_prove_nothing(receiver: Receiver) -> None:
    watch = partial(watched, 60.0, receiver=receiver)
    assert watch(way_mps=lambda t_s: 0.0, carried=lambda t_s: cmath.rect(min(0.3 * t_s, 2.0), 2.0)) is None
    assert watch(share=0.0) is None
    towed = watch(share=0.2, carried=lambda t_s: -cmath.rect(min(max(0.3 * (t_s - 20.0), 0.0), 2.0), 0.4))
    assert towed is None


def test_the_past_says_nothing_of_a_heading_that_leaps() -> None:
    def leaping(t_s: float) -> float:
        return 0.4 if t_s < 10.0 else 0.4 + math.pi

    assert watched(60.0, bow_rad=leaping, carried=lambda t_s: 3.0 * cmath.rect(1.0, 0.4) if t_s >= 10.0 else 0j) is None


def test_a_heading_that_her_way_has_borne_out_is_not_made_wrong_by_a_propeller() -> None:
    """A propeller that dies or turns the other way takes her off the model as well: its own watch finds it, and she sails on."""

    def broken(t_s: float) -> complex:
        taken = cmath.rect(1.5, 0.4) * (cmath.rect(1.0, 1.6) - 1.0)
        return taken * min(max(t_s - 30.0, 0.0) / 3.0, 1.0)

    assert watched(60.0, carried=broken, way_mps=lambda t_s: 1.5 - 1.5 * math.exp(-(t_s % 30.0) / 4.0)) is None
    assert watched(60.0, off_deg=-92.0, way_mps=lambda t_s: 1.5 - 1.5 * math.exp(-(t_s % 30.0) / 4.0)) is not None


@pytest.mark.parametrize("receiver", FINE + PLAIN)
def test_a_steady_way_that_is_all_her_own_bears_the_heading_out(receiver: Receiver) -> None:
    """A propeller that failed on a long leg in a calm was a wrong compass: she drifted for 60 s before the cause was told."""

    def way_mps(t_s: float) -> float:
        return 1.5 * math.exp(-max(t_s - 100.0, 0.0) / 4.0)

    def broken(t_s: float) -> complex:
        return (way_mps(t_s) - 1.5) * (cmath.rect(1.0, 0.4 + 1.6) - cmath.rect(1.0, 0.4))

    assert watched(110.0, carried=broken, way_mps=way_mps, receiver=receiver) is None
    assert watched(110.0, off_deg=-92.0, way_mps=way_mps, receiver=receiver) is not None


def test_a_steady_way_bears_out_headings_near_its_own_alone() -> None:
    """A compass that iron has magnetised is right on one leg: vouched for round the corner she sailed 47 s by one 60 degrees off."""
    borne_out = BorneOut()
    for _ in range(300):
        borne_out.step(DT_S, 1.0, 1.5, 1.5)
    assert borne_out
    round_the_corner = cmath.rect(1.0, math.radians(60.0))
    borne_out.step(DT_S, round_the_corner, 1.5, 1.5 * round_the_corner)
    assert not borne_out
    borne_out.step(DT_S, cmath.rect(1.0, 0.3), 1.5, 1.5)
    assert borne_out, "a propeller that fails turns her so far within seconds"


def sails_and_stops(t_s: float) -> float:
    """A leg of 40 s, a stop, and so on."""
    leg_s = t_s % 50.0
    return 1.5 * (1.0 - math.exp(-leg_s / 4.0)) * (math.exp(-(leg_s - 40.0) / 3.0) if leg_s > 40.0 else 1.0)


@pytest.mark.parametrize("receiver", FINE + PLAIN)
@pytest.mark.parametrize(
    ("creeps_dps", "within_s"), [(0.2, 360.0), (0.5, 170.0), (1.0, 130.0), (-2.0, 160.0), (3.0, 160.0)]
)
def test_a_compass_that_creeps_away_is_found_though_her_way_bore_it_out_once(
    creeps_dps: float, within_s: float, receiver: Receiver
) -> None:
    """The helm holds the heading that it is told: her course goes the other way. She ran 284 m off, and out of her fence."""

    def bow_rad(t_s: float) -> float:
        return 0.4 - math.radians(max(-180.0, min(180.0, creeps_dps * max(t_s - 30.0, 0.0))))

    found = watched(within_s, way_mps=sails_and_stops, bow_rad=bow_rad, steered_rad=lambda t_s: 0.4, receiver=receiver)
    assert found is not None
    assert abs(found[1]) > 50.0


@pytest.mark.parametrize("receiver", FINE + PLAIN + ROUGH)
@pytest.mark.parametrize("turns_s", [120.0, 300.0, -600.0])
def test_a_tide_that_turns_makes_no_compass_wrong(turns_s: float, receiver: Receiver) -> None:
    def tide(t_s: float) -> complex:
        return cmath.rect(0.8, 2.0 * math.pi * t_s / turns_s)

    for way_mps in (sails_and_stops, lambda t_s: 0.8 + 0.4 * math.sin(0.1 * t_s)):
        for bow_rad in (lambda t_s: 0.4, lambda t_s: 2.0 * math.pi * t_s / turns_s + math.pi):
            assert watched(400.0, way_mps=way_mps, bow_rad=bow_rad, carried=tide, receiver=receiver) is None
