"""A console's clock as the bridge reckons it: late packets stay late, and a clock that was set back is soon believed."""

from __future__ import annotations

import pytest

from mavlink_bridge.imc.peers import PeerClock

UTC_S = 1_790_000_000.0
S = 1_000_000


def told(clock: PeerClock, begin_s: float, end_s: float, ahead_s: float, late_s: float = 0.0) -> None:
    """A Heartbeat each second, stamped by a clock that goes ahead, on its way for ``late_s``."""
    for number in range(round(end_s - begin_s)):
        at_s = begin_s + number
        clock.heard(UTC_S + at_s - late_s + ahead_s, round(at_s * S))


def age_s(clock: PeerClock, at_s: float, ahead_s: float = 0.0) -> float:
    """How old an order counts that was sent just now."""
    found = clock.age_s(UTC_S + at_s + ahead_s, round(at_s * S))
    assert found is not None
    return found


@pytest.mark.parametrize("ahead_s", [90.0, 300.0, 86_400.0])
def test_a_clock_that_was_set_back_is_believed_after_a_few_packets(ahead_s: float) -> None:
    clock = PeerClock()
    told(clock, 0.0, 40.0, ahead_s)
    told(clock, 40.0, 45.0, 0.0)
    assert age_s(clock, 45.0) == pytest.approx(0.0, abs=0.1)


def test_one_packet_with_a_wrong_time_is_forgotten_after_a_few_right_ones() -> None:
    clock = PeerClock()
    told(clock, 0.0, 40.0, 0.0)
    clock.heard(UTC_S + 40.0 + 300.0, 40 * S)
    assert age_s(clock, 40.0) == pytest.approx(300.0)
    told(clock, 41.0, 46.0, 0.0)
    assert age_s(clock, 46.0) == pytest.approx(0.0, abs=0.1)


def test_what_a_network_held_up_and_brings_at_once_stays_old() -> None:
    clock = PeerClock()
    told(clock, 0.0, 40.0, 0.0)
    for number in range(100):
        clock.heard(UTC_S + 40.0 + number, 150 * S + number * 20_000)
    assert clock.age_s(UTC_S + 60.0, 152 * S) == pytest.approx(92.0)


def test_packets_that_are_late_by_less_than_a_minute_stay_late_for_as_long_as_before() -> None:
    clock = PeerClock()
    told(clock, 0.0, 40.0, 0.0)
    told(clock, 40.0, 55.0, 0.0, late_s=15.0)
    assert age_s(clock, 55.0, ahead_s=-15.0) == pytest.approx(15.0)


def test_two_clocks_under_one_name_are_not_one_that_was_set_back() -> None:
    clock = PeerClock()
    for number in range(40):
        clock.heard(UTC_S + number + 300.0 * (number % 2), number * S)
    assert age_s(clock, 40.0) == pytest.approx(300.0)
