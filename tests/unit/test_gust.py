"""Gusts felt by how they turn the hull: a made-up hull that only yaws."""

import math

import pytest

from companion.core.guide.gust import GustObserver
from sitl.plant.library import load_vessel

DT_S = 0.05
NM_PER_RAD = 40.0
AGAINST_RAD = 1.0


class Hull:
    """Turned by a helm that is known and a wind that is not."""

    def __init__(self):
        hull = load_vessel("otter").hull
        self.inertia = hull.m33_kgm2 - hull.m23_kgm**2 / hull.m22_kg
        self.observer = GustObserver(load_vessel("otter"))
        self.observer.begin(AGAINST_RAD, 0.0)
        self.psi_rad, self.r_radps = AGAINST_RAD, 0.0

    def sail(self, seconds, wind_nm, helm_nm=0.0, told_nm=None):
        for _ in range(round(seconds / DT_S)):
            helm = -wind_nm if helm_nm is None else helm_nm
            self.r_radps += (helm + wind_nm) / self.inertia * DT_S
            self.psi_rad += self.r_radps * DT_S
            told = helm if told_nm is None else told_nm
            self.observer.step(
                DT_S,
                psi_rad=self.psi_rad,
                r_radps=self.r_radps,
                dr_radps2=told / self.inertia,
                against_rad=AGAINST_RAD,
                nm_per_rad=NM_PER_RAD,
            )
        return self.observer.off_rad


@pytest.mark.parametrize("off_rad", [0.2, -0.2])
def test_a_gust_is_felt_while_the_helm_still_holds_the_bow(off_rad):
    hull = Hull()
    hull.sail(5.0, 0.0)
    felt = hull.sail(1.5, -NM_PER_RAD * off_rad, helm_nm=None)
    assert math.isclose(felt, off_rad, rel_tol=0.35)
    assert abs(hull.psi_rad - AGAINST_RAD) < 0.01, "nothing of it shows in the heading"


def test_a_steady_pull_is_no_gust():
    hull = Hull()
    assert abs(hull.sail(120.0, -8.0, helm_nm=None)) < 0.01


def test_no_push_no_gust():
    hull = Hull()
    observer = hull.observer
    observer.step(DT_S, psi_rad=0.0, r_radps=0.3, dr_radps2=0.0, against_rad=0.0, nm_per_rad=0.0)
    assert observer.off_rad == 0.0


def test_what_swings_wider_than_wind_is_believed_less():
    """A moment of the boat's own making, to and fro."""
    hull = Hull()
    felt = [abs(hull.sail(1.5, 20.0 * (-1) ** k, helm_nm=None)) for k in range(40)]
    assert felt[0] > 0.3
    assert max(felt[-4:]) < 0.5 * felt[0]
