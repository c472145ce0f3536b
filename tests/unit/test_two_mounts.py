"""Two receivers, two sounders on one hull, each where its ``[mounts.NAME]`` says: only what is left after that is a disagreement."""

from __future__ import annotations

import math

import pytest

from companion.core.estimate import Estimator, EstimatorConfig
from companion.core.hull.geometry import SENT_LINK, Arm, HullGeometry
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Distance, EulerAngles, FixType, GpsFix, Source

_FRAME = LocalFrame(math.radians(41.0), math.radians(-8.7))
_STEP_US = 200_000
_RECEIVERS = (Source("bow", "GP", (0,)), Source("stern", "GP", (1,)))


def at_antenna(t_us: int, arm: Arm, psi_rad: float, *, off_m: float, source: Source) -> GpsFix:
    """An exact fix of an antenna on a hull that turns where it is; ``off_m``: it says so much too far north."""
    sine, cosine = math.sin(psi_rad), math.cos(psi_rad)
    north_m, east_m = arm[0] * cosine - arm[1] * sine, arm[0] * sine + arm[1] * cosine
    lat_rad, lon_rad = _FRAME.to_geodetic(north_m + off_m, east_m)
    return GpsFix(t_us, FixType.RTK_FIXED, lat_rad, lon_rad, hacc_m=0.02, sog_mps=0.0, source=source)


def two_receivers(
    arms: tuple[Arm, Arm],
    *,
    told: HullGeometry | None = None,
    compass: bool = True,
    turn_radps: float = 0.1,
    off_m: float = 0.0,
) -> Estimator:
    """Half a minute of both; ``off_m``: the second one is wrong by so much."""
    made = Estimator(EstimatorConfig(), told or HullGeometry(antennas=arms))
    for step in range(150):
        t_us = step * _STEP_US
        psi_rad = turn_radps * t_us * 1e-6
        if compass:
            made.update(
                EulerAngles(t_us, psi_rad=math.remainder(psi_rad, 2.0 * math.pi), source=Source("bow", "GPHDT"))
            )
        for link in (0, 1):
            fix = at_antenna(t_us, arms[link], psi_rad, off_m=off_m * link, source=_RECEIVERS[link])
            made.update(fix, link)
        made.predict(t_us)
    return made


def said(made: Estimator, what: str) -> list[str]:
    return [text for _, text in made.drain_texts() if what in text]


@pytest.mark.parametrize("compass", [True, False])
@pytest.mark.parametrize("apart_m", [0.3, 1.0, 4.0])
def test_two_exact_receivers_agree_when_their_mounts_are_told(apart_m: float, compass: bool) -> None:
    """They were compared as they came: for ever apart, and arming was refused."""
    arms = ((0.5 * apart_m, 0.1, -1.0), (-0.5 * apart_m, -0.1, -1.5))
    made = two_receivers(arms, compass=compass)
    assert not made.sources_disagree
    assert said(made, "disagree") == []


@pytest.mark.parametrize("off_m", [-1.0, 1.0])
def test_a_receiver_that_is_wrong_is_found_beside_its_mount(off_m: float) -> None:
    made = two_receivers(((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), off_m=off_m)
    assert made.sources_disagree
    assert said(made, "disagree") == ["Positions disagree: stern GP is 1.0 m from bow GP, which is used"]


def test_without_a_compass_no_more_than_the_mounts_is_allowed() -> None:
    arms = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    assert two_receivers(arms, compass=False, off_m=6.0).sources_disagree


def test_antennas_whose_mounts_are_not_told_are_told_with_the_key_that_mends_it() -> None:
    """``is 0 m from`` was no sentence that helps."""
    made = two_receivers(((0.2, 0.0, 0.0), (-0.2, 0.0, 0.0)), told=HullGeometry(), turn_radps=0.0)
    (text,) = said(made, "disagree")
    assert text == (
        "Positions disagree: stern GP is 0.4 m from bow GP, which is used; mounted so? set [mounts.stern.antenna]"
    )


def two_sounders(told: HullGeometry, *, off_m: float = 0.0, second: int = 1) -> Estimator:
    """20 s over level ground, 4 m below the waterline, of transducers 0.2 and 0.8 m below it; ``off_m``: the second one is wrong."""
    made = Estimator(EstimatorConfig(), told)
    for step in range(100):
        t_us = step * _STEP_US
        made.update(Distance(t_us, 4.0 - 0.2, source=Source("bow", "SDDPT", (0,))), 0)
        made.update(Distance(t_us, 4.0 - 0.8 + off_m, source=Source("stern", "SDDPT", (1,))), second)
    return made


def test_two_sounders_agree_when_their_mounts_are_told() -> None:
    """They were compared as they came: ``reads 0.6 m less`` of one water, for ever."""
    assert said(two_sounders(HullGeometry(transducers_m=(0.2, 0.8))), "Depth") == []
    assert len(said(two_sounders(HullGeometry(transducer_m=0.2)), "Depth")) == 1


def test_a_sounder_that_another_computer_reads_has_its_own_mount() -> None:
    told = HullGeometry(transducers_m=(0.2,), transducer_m=0.2, sent_transducer_m=0.8)
    assert said(two_sounders(told, second=SENT_LINK), "Depth") == []


def test_a_sounder_that_is_wrong_is_told_beside_its_mount() -> None:
    """0.6 m more water than there is, at a transducer 0.6 m deeper, had read alike."""
    (text,) = said(two_sounders(HullGeometry(transducers_m=(0.2, 0.8)), off_m=0.6), "Depth")
    assert text == "Depth: stern SDDPT reads 0.6 m more than bow SDDPT, which is used"
