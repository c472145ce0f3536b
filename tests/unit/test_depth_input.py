"""From echo-sounder readings to the altitude of the keel: offsets, tilt, validity, gate, median, age."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.depth.input import DepthInput, DepthInputConfig
from companion.core.hull.geometry import HullGeometry
from mavlink_bridge.language.messages import Distance, EstimatedState

PLAIN = DepthInputConfig(stale_s=1.0)
HULL = HullGeometry()
MOUNTED = HullGeometry(keel_m=0.35, transducer_m=0.2)
FAST_US = 100_000


def state(**values: float) -> EstimatedState:
    return EstimatedState(0, **values)


def feed(
    chain: DepthInput, values: list[float | None], period_us: int = FAST_US, start: int = 0, **motion: float
) -> int:
    now = start
    for value in values:
        chain.measure(Distance(now, value), state(**motion))
        now += period_us
    return now - period_us


def one(
    config: DepthInputConfig, distance: Distance, at: EstimatedState | None = None, hull: HullGeometry = HULL
) -> float | None:
    chain = DepthInput(config.model_copy(update={"median_samples": 1}), hull)
    chain.measure(distance, at)
    return chain.altitude_m(distance.t_us)


def test_the_altitude_is_under_the_keel():
    assert one(DepthInputConfig(), Distance(0, 5.0), hull=MOUNTED) == pytest.approx(4.85)


def test_every_sounder_is_measured_from_its_own_place():
    hull = HullGeometry(keel_m=0.35, transducer_m=0.2, transducers_m=(0.2, 0.9), sent_transducer_m=0.5)
    for source, expected in ((0, 4.85), (1, 5.55), (2, 4.85), (None, 5.15)):
        chain = DepthInput(DepthInputConfig(median_samples=1), hull)
        chain.measure(Distance(0, 5.0), None, source)
        assert chain.altitude_m(0) == pytest.approx(expected), source
    assert HullGeometry(transducer_m=0.2).transducer_of(None) == 0.2


@pytest.mark.parametrize(
    ("use", "offset_m", "expected"),
    [(False, 0.5, 4.85), (True, None, 4.85), (True, 0.5, 5.15), (True, 0.0, 4.65), (True, -0.3, 4.7)],
)
def test_the_sentences_own_offset_only_when_asked_for_and_never_twice(use, offset_m, expected):
    """DPT: positive = transducer to waterline, negative = transducer to keel."""
    config = DepthInputConfig(use_sentence_offset=use)
    assert one(config, Distance(0, 5.0, offset_m=offset_m), hull=MOUNTED) == pytest.approx(expected)


def test_tilt_counts_only_beyond_half_the_cone():
    for roll_deg, pitch_deg, factor in ((5.0, 0.0, 1.0), (20.0, 0.0, math.cos(math.radians(20.0))), (7.4, 0.0, 1.0)):
        at = state(phi_rad=math.radians(roll_deg), theta_rad=math.radians(pitch_deg))
        assert one(PLAIN, Distance(0, 10.0), at) == pytest.approx(10.0 * factor)
    both = state(phi_rad=math.radians(6.0), theta_rad=math.radians(6.0))
    assert one(PLAIN, Distance(0, 10.0), both) == pytest.approx(10.0 * math.cos(math.radians(6.0)) ** 2)
    assert one(PLAIN, Distance(0, 10.0), state(phi_rad=3.0)) == 0.0, "upside down is no depth"


@pytest.mark.parametrize(
    "distance",
    [
        Distance(0, None),
        Distance(0, 0.0),
        Distance(0, -1.0),
        Distance(0, math.nan),
        Distance(0, math.inf),
        Distance(0, 0.29),
        Distance(0, 100.1),
        Distance(0, 60.0, range_max_m=50.0),
        Distance(0, 5.0, signal_quality=0.04),
        Distance(0, 5.0, signal_quality=math.nan),
    ],
)
def test_what_cannot_be_a_depth_is_refused(distance):
    chain = DepthInput(PLAIN, HULL)
    assert chain.measure(distance, None) == ()
    assert (chain.rejected, chain.raw_m, chain.altitude_m(0)) == (1, None, None)


@pytest.mark.parametrize(
    "distance",
    [
        Distance(0, 0.3),
        Distance(0, 100.0),
        Distance(0, 50.0, range_max_m=50.0),
        Distance(0, 5.0, range_max_m=0.0),
        Distance(0, 5.0, signal_quality=0.05),
    ],
)
def test_what_just_can_be_a_depth_is_taken(distance):
    assert one(PLAIN, distance) == distance.value_m


def test_a_fast_sounder_needs_three_readings_and_takes_the_median_of_five():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0, 5.1])
    assert chain.altitude_m(now) is None
    now = feed(chain, [5.2], start=now + FAST_US)
    assert chain.altitude_m(now) == 5.1
    now = feed(chain, [5.3, 5.4, 5.5], start=now + FAST_US)
    assert chain.altitude_m(now) == pytest.approx(5.3)
    assert chain.lag_s(now) == pytest.approx(0.2)
    assert chain.lag_s(now + 50_000) == pytest.approx(0.25)


def test_a_slow_sounder_believes_two_of_three():
    chain = DepthInput(PLAIN.model_copy(update={"stale_s": 3.0}), HULL)
    now = feed(chain, [5.0], period_us=1_000_000)
    assert chain.altitude_m(now) is None
    now = feed(chain, [5.1, 4.0], period_us=1_000_000, start=1_000_000)
    assert chain.altitude_m(now) == 5.0
    now = feed(chain, [4.0], start=3_000_000)
    assert chain.altitude_m(now) == 4.0, "row 61: the second low reading acts"


def test_an_even_number_of_readings_errs_shallow():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0, 5.1, 5.2, 5.3])
    assert chain.altitude_m(now) == 5.1


@pytest.mark.parametrize("share", [0.3, 0.5, 2.0])
def test_a_false_echo_is_held_back(share):
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6 + [5.0 * share] * 2 + [5.0])
    assert chain.altitude_m(now) == 5.0
    assert chain.rejected == 2
    assert chain.gated.value_m == 5.0


def test_three_readings_that_agree_are_a_new_bottom():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6)
    assert chain.measure(Distance(now + FAST_US, 2.0), state()) == ()
    assert chain.measure(Distance(now + 2 * FAST_US, 2.0), state()) == ()
    passed = chain.measure(Distance(now + 3 * FAST_US, 2.0), state())
    assert [item.value_m for item in passed] == [2.0, 2.0, 2.0]
    assert chain.altitude_m(now + 3 * FAST_US) == 2.0


def test_jumps_that_do_not_agree_among_themselves_stay_out():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6 + [2.0, 9.0, 2.0, 9.0, 2.0])
    assert chain.altitude_m(now) == 5.0


def test_speed_over_a_steep_bottom_is_no_jump():
    chain = DepthInput(PLAIN.model_copy(update={"sigma_m": 0.0}), HULL)
    feed(chain, [5.0] * 6, sog_mps=4.0)
    now = 600_000
    # 2 m/s + 0.5 of 4 m/s for 0.1 s, and 3 % of 5 m for noise
    assert chain.measure(Distance(now, 5.0 - 0.55), state(sog_mps=4.0)) != ()
    chain = DepthInput(PLAIN.model_copy(update={"sigma_m": 0.0}), HULL)
    feed(chain, [5.0] * 6)
    assert chain.measure(Distance(now, 5.0 - 0.55), state()) == ()
    assert chain.measure(Distance(now + 1, 5.0 - 0.34), state()) != ()


def test_after_a_long_gap_the_chain_starts_anew():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6)
    later = now + 5_000_001
    assert chain.measure(Distance(later, 2.0), state()) != ()
    assert chain.altitude_m(later) is None, "one reading is not enough"
    now = feed(chain, [2.0, 2.0], start=later + FAST_US)
    assert chain.altitude_m(now) == 2.0


def test_a_value_grows_stale():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6)
    assert chain.altitude_m(now + 1_000_000) == 5.0
    assert chain.altitude_m(now + 1_000_001) is None
    assert chain.age_s(now + 2_000_000) == 2.0
    assert DepthInput(PLAIN, HULL).age_s(0) == math.inf
    assert DepthInput(PLAIN, HULL).lag_s(5) == 5e-6


def test_a_sounder_of_1_hz_is_not_stale_between_its_readings():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 4, period_us=1_000_000)
    assert chain.altitude_m(now + 2_500_000) == 5.0
    assert chain.altitude_m(now + 2_500_001) is None
    fast = DepthInput(PLAIN, HULL)
    now = feed(fast, [5.0, 5.0, None, None, None, 5.0, None, None, None, 5.0])
    assert fast.altitude_m(now + 1_000_000) == 5.0
    assert fast.altitude_m(now + 1_000_001) is None, "drop-outs of a fast one buy no time"
    slow = DepthInput(PLAIN, HULL)
    now = feed(slow, [5.0] * 4, period_us=4_000_000)
    assert slow.altitude_m(now + 5_000_000) == 5.0
    assert slow.altitude_m(now + 5_000_001) is None


@pytest.mark.parametrize("period_us", [400_000, 500_000, 530_000, 550_000, 700_000])
def test_a_sounder_slower_than_its_patience_may_miss_a_reading(period_us):
    """One of 2 Hz that lost one in fifty was told as lost each 15 s: between its readings lay 1.0 s, and 0.8 were allowed."""
    chain = DepthInput(DepthInputConfig(), HULL)
    now = feed(chain, [5.0] * 6, period_us=period_us)
    assert chain.altitude_m(now + 2 * period_us) == 5.0, "one is missing, the next is heard"
    assert chain.altitude_m(now + 5 * period_us // 2 + 1) is None


def test_old_and_repeated_readings_change_nothing():
    chain = DepthInput(PLAIN, HULL)
    now = feed(chain, [5.0] * 6)
    assert chain.measure(Distance(now, 4.0), state()) == ()
    assert chain.measure(Distance(now - 1, 4.0), state()) == ()
    assert chain.altitude_m(now) == 5.0


def hear(chain, start_s, seconds, value_m, period_s=0.5):
    """Readings of one distance, the first at ``start_s``; return the time of the next."""
    for i in range(round(seconds / period_s)):
        chain.measure(Distance(round((start_s + i * period_s) * 1e6), value_m, range_max_m=50.0), None)
    return start_s + seconds


def test_the_scale_of_a_sounder_that_ranges_by_itself_is_not_the_end_of_its_reach():
    """DPT's third field is the scale in use: on a scale of 5 m, 4.5 m is shallow water and not the edge of hearing."""
    chain = DepthInput(PLAIN.model_copy(update={"median_samples": 1, "jump_rate_mps": 50.0}), HULL)
    for number in range(40):
        value_m = 20.0 - 0.4 * number
        scale_m = next(scale for scale in (5.0, 10.0, 25.0) if value_m < scale)
        chain.measure(Distance(number * 500_000, value_m, range_max_m=scale_m), None)
        assert not chain.out_of_reach or scale_m == 25.0
    assert scale_m == 5.0
    assert not chain.out_of_reach


@pytest.mark.parametrize("period_s", [0.1, 0.5, 1.0])
def test_out_of_reach_changes_when_the_bottom_has_been_heard_elsewhere_for_five_seconds(period_s):
    chain = DepthInput(PLAIN.model_copy(update={"median_samples": 1, "jump_rate_mps": 50.0}), HULL)
    assert not chain.out_of_reach
    t_s = hear(chain, 0.0, 1.0, 41.0, period_s)
    assert chain.out_of_reach, "the first that is heard"
    t_s = hear(chain, t_s + 10.0, 3.0, 20.0, period_s)
    assert chain.out_of_reach, "fish"
    t_s = hear(chain, t_s + 4.0, 4.0, 20.0, period_s)
    assert chain.out_of_reach, "more fish"
    t_s = hear(chain, t_s + 10.0, 4.0, 20.0, period_s)
    t_s = hear(chain, t_s, 5 * period_s, 41.0, period_s)
    t_s = hear(chain, t_s, 4.0, 20.0, period_s)
    assert chain.out_of_reach, "the bottom itself, in between"
    t_s = hear(chain, t_s, 2.0 + period_s, 40.0, period_s)
    assert not chain.out_of_reach
    t_s = hear(chain, t_s, 4.5, 41.0, period_s)
    assert not chain.out_of_reach, "a second echo is not deep water"
    hear(chain, t_s, 2.0, 41.0, period_s)
    assert chain.out_of_reach
