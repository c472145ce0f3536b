"""A ground station that falls silent and comes back, as the boat's own station hears it: what the boat does, on the water."""

from __future__ import annotations

import math

from tests.world_station import Helm

WAYPOINT, SET_MODE, ARM = 16, 176, 400
AUTO, RTL, HOLD = 10.0, 11.0, 4.0


def under_way(*overrides: str) -> Helm:
    helm = Helm("ardurover", "depth.enabled=false", *overrides)
    far = [(3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *helm.at(600.0, 0.0), 0.0)]
    assert helm.upload(far) == 0
    assert helm.command(SET_MODE, 1.0, AUTO) == 0
    assert helm.command(ARM, 1.0) == 0
    helm.run(20.0)
    assert helm.truth.u_mps > 0.5
    return helm


def silent(helm: Helm, seconds: float) -> None:
    helm.present = False
    helm.run(seconds)
    helm.present = True


def test_after_a_short_outage_the_boat_waits_for_an_order_and_says_so():
    helm = under_way()
    silent(helm, 8.2)
    assert "Ground station lost: HOLD" in helm.texts()
    helm.run(20.0)
    here = helm.truth.north_m, helm.truth.east_m
    helm.run(100.0)
    assert math.dist(here, (helm.truth.north_m, helm.truth.east_m)) < 5.0
    assert "Ground station lost: RETURN" not in helm.texts()
    assert "Ground station is back: clock stopped" in helm.texts()
    assert "order Auto to go on" in helm.texts()
    assert helm.command(SET_MODE, 1.0, AUTO) == 0
    helm.run(15.0)
    assert helm.truth.u_mps > 0.5
    assert helm.truth.north_m > here[0]


def test_a_link_that_flaps_brings_the_boat_home_by_its_silence():
    helm = under_way("failsafe.gcs_then_s=20")
    silent(helm, 6.0)
    silences_s = 0.0
    while "Ground station lost: RETURN" not in helm.texts():
        helm.run(4.0)
        silent(helm, 4.0)
        silences_s += 4.0
        assert silences_s <= 24.0
    assert silences_s >= 12.0
    helm.run(20.0)
    assert helm.truth.u_mps > 0.5


def test_a_return_that_was_ordered_is_not_stopped_by_a_lost_station():
    helm = under_way()
    assert helm.command(SET_MODE, 1.0, RTL) == 0
    north_m = helm.truth.north_m
    silent(helm, 90.0)
    assert math.hypot(helm.truth.north_m, helm.truth.east_m) < 5.0 < north_m
    assert "HOLD" not in helm.texts()
