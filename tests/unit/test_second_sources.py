"""A second receiver and a second compass step in before the first one's silence counts as a loss."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from mavlink_bridge.language.messages import EulerAngles, FixType, GpsFix, Source

LAT_RAD, LON_RAD = math.radians(41.185), math.radians(-8.706)
RADIUS_M = 6.371e6
LATENCY_US = 120_000
FIRST, SECOND = Source("compass", "GP"), Source("second", "GN")
SPEED_MPS = 1.5


def fix_at(
    t_us: int,
    source: Source,
    *,
    off_m: float = 0.0,
    fix_type: FixType = FixType.RTK_FIXED,
    mps: float = SPEED_MPS,
) -> GpsFix:
    """A boat that sails north, as a receiver off to the north sees it."""
    north_m = mps * t_us * 1e-6 + off_m
    return GpsFix(t_us, fix_type, LAT_RAD + north_m / RADIUS_M, LON_RAD, sog_mps=mps, cog_rad=0.0, source=source)


class TwoReceivers:
    """Two receivers and a compass on one boat, in virtual time: each sends at its rate, from a phase of its period on."""

    def __init__(self, first_hz: float, second_hz: float, phase: float = 0.0) -> None:
        self.estimator = Estimator(EstimatorConfig())
        self.now_us = 0
        self.rates = {0: (first_hz, 0.0), 1: (second_hz, phase)}
        self.sources = {0: FIRST, 1: SECOND}
        self.mute: set[int] = set()
        self.off_m = {0: 0.0, 1: 0.0}
        self.mps = SPEED_MPS
        self.fix_type = {0: FixType.RTK_FIXED, 1: FixType.RTK_FIXED}
        self.texts: list[tuple[float, str]] = []
        self.lost_s: list[float] = []

    def run(self, seconds: float) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.now_us += 10_000
            for link, (hz, phase) in self.rates.items():
                period_us = round(1e6 / hz)
                if link not in self.mute and (self.now_us - round(phase * period_us)) % period_us == 0:
                    self.send(link)
            if self.now_us % 50_000 == 0:
                self.estimator.update(EulerAngles(self.now_us, psi_rad=0.0), 0)
                self.tick()

    def send(self, link: int) -> None:
        off_m, fix_type = self.off_m[link], self.fix_type[link]
        fix = fix_at(self.now_us - LATENCY_US, self.sources[link], off_m=off_m, fix_type=fix_type, mps=self.mps)
        self.estimator.update(fix, link)

    def tick(self) -> None:
        state = self.estimator.predict(self.now_us)
        if not state.position_valid:
            self.lost_s.append(self.now_us * 1e-6)
        self.texts += [(self.now_us * 1e-6, text) for _, text in self.estimator.drain_texts()]

    def said(self, what: str) -> list[str]:
        return [text for _, text in self.texts if what in text]

    def off_by_m(self) -> float:
        state, origin = self.estimator.predict(self.now_us), self.estimator.origin
        assert state.lat_rad is not None
        assert origin is not None
        return abs((state.lat_rad - LAT_RAD) * RADIUS_M - self.mps * self.now_us * 1e-6)


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("rates", [(10.0, 10.0), (10.0, 5.0), (5.0, 5.0), (1.0, 1.0), (10.0, 1.0), (5.0, 2.0)])
def test_a_sound_second_receiver_steps_in_before_the_position_is_lost(rates: tuple[float, float], phase: float) -> None:
    """It came a tenth of a second too late, and the boat stopped in open water until an operator came."""
    boat = TwoReceivers(*rates, phase)
    boat.run(20.0)
    boat.lost_s.clear()
    boat.mute = {0}
    boat.run(8.0)
    assert boat.lost_s == []
    assert boat.said("Position") == ["Position: compass GP silent, using second GN"]
    assert boat.off_by_m() < 0.5


@pytest.mark.parametrize("fix_type", [FixType.NONE, FixType.RTK_FLOAT])
def test_one_whose_first_receiver_loses_its_fix_sails_on_by_the_second(fix_type: FixType) -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.run(20.0)
    boat.lost_s.clear()
    boat.fix_type[0] = fix_type
    boat.run(10.0)
    assert boat.lost_s == []
    expected = ["Position: compass GP has no fix, using second GN"] if fix_type == FixType.NONE else []
    assert boat.said("Position") == expected
    boat.fix_type[0] = FixType.RTK_FIXED
    boat.run(20.0)
    assert boat.said("no longer") == []
    boat.run(15.0)
    assert len(boat.said("using compass GP, no longer second GN")) == len(expected)
    assert boat.lost_s == []


def test_a_second_receiver_that_was_known_to_be_off_does_not_step_in_at_once() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.off_m[1] = 60.0
    boat.run(20.0)
    boat.lost_s.clear()
    boat.mute = {0}
    boat.run(4.0)
    assert boat.lost_s


@pytest.mark.parametrize("second_hz", [10.0, 5.0, 2.0, 1.0])
@pytest.mark.parametrize("late_us", [0, 20_000, 60_000, 110_000, 170_000])
def test_a_second_compass_steps_in_before_the_heading_is_lost(second_hz: float, late_us: int) -> None:
    estimator, now_us, lost = Estimator(EstimatorConfig()), 0, []
    period_us = round(1e6 / second_hz)
    while now_us < 16_000_000:
        now_us += 10_000
        if now_us % 100_000 == 0 and now_us < 10_000_000:
            estimator.update(EulerAngles(now_us, psi_rad=0.5, source=FIRST), 0)
        if (now_us - late_us) % period_us == 0:
            estimator.update(EulerAngles(now_us, psi_rad=0.51, source=SECOND), 1)
        if now_us % 50_000 == 0:
            state = estimator.predict(now_us)
            if now_us > 5_000_000 and not state.heading_valid:
                lost.append(now_us)
    assert lost == []
    assert [text for _, text in estimator.drain_texts()] == ["Heading: compass GP silent, using second GN"]


def test_a_second_compass_that_is_as_expected_replaces_one_that_jumped() -> None:
    estimator, now_us = Estimator(EstimatorConfig()), 0
    while now_us < 16_000_000:
        now_us += 50_000
        estimator.update(EulerAngles(now_us, psi_rad=0.5 if now_us < 10_000_000 else 2.5, source=FIRST), 0)
        estimator.update(EulerAngles(now_us, psi_rad=0.51, source=SECOND), 1)
        state = estimator.predict(now_us)
        assert state.psi_rad == pytest.approx(0.505, abs=0.02)
    assert "Heading: compass GP jumped, using second GN" in [text for _, text in estimator.drain_texts()]


def test_two_that_disagreed_do_not_agree_when_one_falls_silent() -> None:
    """The wrong one was believed 0.2 s later, and arming no longer barred."""
    boat = TwoReceivers(10.0, 5.0)
    boat.off_m[1] = 60.0
    boat.run(20.0)
    assert boat.said("disagree") == ["Positions disagree: second GN is 60 m from compass GP, which is used"]
    boat.mute = {0}
    boat.run(9.0)
    assert boat.estimator.sources_disagree
    assert not boat.estimator.predict(boat.now_us).position_valid
    assert boat.said("agree again") == []
    assert boat.said("disagreed") == ["Positions disagreed: compass GP is silent, it was 60 m from second GN"]
    boat.run(60.0)
    assert boat.estimator.sources_disagree
    boat.mute, boat.off_m[1] = set(), 0.0
    boat.run(20.0)
    assert not boat.estimator.sources_disagree
    assert boat.said("agree again") == ["Receivers compass GP and second GN agree again"]


@pytest.mark.parametrize(("mps", "off_m"), [(1.0, 1.0), (2.0, 1.4), (3.0, 2.2)])
def test_two_that_disagreed_do_not_agree_when_one_falls_silent_under_way(mps: float, off_m: float) -> None:
    """The way made since the last fix excused the distance: they agreed again, and the wrong one led with a jump."""
    boat = TwoReceivers(5.0, 5.0, 0.25)
    boat.mps, boat.off_m[1] = mps, off_m
    boat.run(20.0)
    boat.mute = {0}
    boat.run(9.0)
    assert boat.estimator.sources_disagree
    assert boat.said("agree again") == []
    assert boat.said("disagreed") == [f"Positions disagreed: compass GP is silent, it was {off_m} m from second GN"]
    boat.mute, boat.off_m[1] = set(), 0.0
    boat.run(5.0)
    assert not boat.estimator.sources_disagree


def test_a_stop_past_the_last_fix_of_a_silent_one_is_no_agreement() -> None:
    """Its last fix is carried on with the way that the boat had, and comes by the place where the other one lies."""
    boat = TwoReceivers(10.0, 10.0)
    boat.off_m[1] = 1.0
    boat.run(20.0)
    lies = fix_at(boat.now_us - LATENCY_US, SECOND, off_m=1.0)
    boat.mute = {0, 1}
    for _ in range(30):
        boat.run(0.1)
        boat.estimator.update(replace(lies, t_us=boat.now_us - LATENCY_US, sog_mps=0.0), 1)
    assert boat.estimator.sources_disagree
    assert boat.said("agree again") == []


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5, 0.9])
@pytest.mark.parametrize("rates", [(10.0, 10.0), (5.0, 5.0), (1.0, 1.0), (10.0, 1.0), (1.0, 10.0)])
def test_two_that_disagreed_agree_again_under_way(rates: tuple[float, float], phase: float) -> None:
    boat = TwoReceivers(*rates, phase)
    boat.off_m[1] = 15.0
    boat.run(20.0)
    assert boat.estimator.sources_disagree
    boat.off_m[1] = 0.0
    boat.run(4.0)
    assert not boat.estimator.sources_disagree
    assert boat.said("agree again") == ["Receivers second GN and compass GP agree again"]


def test_one_that_was_off_and_fell_silent_bars_arming_until_it_agrees() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.off_m[1] = 15.0
    boat.run(20.0)
    boat.mute = {1}
    boat.run(60.0)
    assert boat.estimator.sources_disagree
    assert boat.said("disagreed") == ["Positions disagreed: second GN is silent, it was 15 m from compass GP"]
    assert boat.off_by_m() < 0.5
    boat.mute, boat.off_m[1] = set(), 0.0
    boat.run(5.0)
    assert not boat.estimator.sources_disagree


def test_of_three_the_odd_one_is_off_whichever_is_used() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.rates[2], boat.sources[2] = (5.0, 0.3), Source("third", "GL")
    boat.off_m[2], boat.fix_type[2] = 0.0, FixType.RTK_FIXED
    boat.off_m[0] = 60.0
    boat.run(20.0)
    boat.mute = {0}
    boat.run(30.0)
    assert boat.estimator.sources_disagree
    boat.mute, boat.off_m[0] = set(), 0.0
    boat.run(40.0)
    assert not boat.estimator.sources_disagree
    assert boat.off_by_m() < 0.5


def test_a_receiver_at_0_north_0_east_has_no_fix_and_the_second_leads() -> None:
    """It was accepted after 10 s, 4645 km away, while a good receiver was heard and not used."""
    boat = TwoReceivers(10.0, 5.0)
    boat.run(20.0)
    boat.lost_s.clear()
    broken = GpsFix(boat.now_us, FixType.RTK_FIXED, 0.0, 0.0, sog_mps=0.0, source=FIRST)
    boat.mute = {0}
    for number in range(300):
        boat.estimator.update(replace(broken, t_us=boat.now_us - LATENCY_US), 0)
        boat.run(0.1)
        assert not boat.said("accepted"), number
    assert boat.lost_s == []
    assert boat.off_by_m() < 0.5
    assert boat.said("0 N 0 E") == ["Receiver compass GP says 0 N 0 E: taken for no fix"]
    assert boat.said("Position") == ["Position: compass GP has no fix, using second GN"]


def test_a_boat_with_one_receiver_at_0_north_0_east_has_no_position() -> None:
    estimator = Estimator(EstimatorConfig())
    for number in range(300):
        estimator.update(GpsFix(100_000 * number, FixType.FIX_3D, 0.0, 0.0, source=FIRST), 0)
        assert not estimator.predict(100_000 * number).position_valid
    assert estimator.origin is None


@pytest.mark.parametrize("off_m", [100.0, 4.6e6])
def test_a_first_receiver_that_jumps_is_replaced_by_the_second_where_the_boat_is(off_m: float) -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.run(20.0)
    boat.lost_s.clear()
    boat.off_m[0] = off_m
    boat.run(90.0)
    assert boat.lost_s == []
    assert boat.off_by_m() < 0.5
    assert boat.said("Position: ") == ["Position: compass GP jumped, using second GN"]
    assert boat.said("accepted") == []
    assert boat.estimator.sources_disagree


def test_a_jump_is_not_accepted_while_another_receiver_is_against_it() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.off_m[1] = 80.0
    boat.run(20.0)
    boat.off_m[0] = 300.0
    boat.run(30.0)
    assert not boat.estimator.predict(boat.now_us).position_valid
    assert boat.said("accepted") == ["Position 300 m away not accepted: second GN contradicts it"]
    boat.off_m[1] = 300.0
    boat.run(5.0)
    assert boat.estimator.predict(boat.now_us).position_valid
    assert boat.off_by_m() == pytest.approx(300.0, abs=1.0)


def test_a_frozen_first_receiver_is_replaced_by_one_that_moves() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.run(20.0)
    boat.lost_s.clear()
    frozen = fix_at(boat.now_us - LATENCY_US, FIRST)
    boat.mute = {0}
    for _ in range(200):
        boat.estimator.update(replace(frozen, t_us=boat.now_us - LATENCY_US), 0)
        boat.run(0.1)
    assert boat.lost_s == []
    assert boat.off_by_m() < 0.5
    assert boat.said("Position: ") == ["Position: compass GP repeats one position, using second GN"]
    assert boat.said("moves again") == []


def test_two_that_repeat_one_position_do_not_stand_in_for_each_other() -> None:
    boat = TwoReceivers(10.0, 5.0)
    boat.run(20.0)
    frozen_us = boat.now_us - LATENCY_US
    boat.mute = {0, 1}
    for _ in range(150):
        for link, source in ((0, FIRST), (1, SECOND)):
            boat.estimator.update(replace(fix_at(frozen_us, source), t_us=boat.now_us - LATENCY_US), link)
        boat.run(0.1)
    assert not boat.estimator.predict(boat.now_us).position_valid
