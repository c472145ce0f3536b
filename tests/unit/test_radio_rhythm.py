"""When the vessel's next state comes, as the shore tells it: a period after the last one, or at the end of a pause that held it back."""

from __future__ import annotations

from mavlink_bridge.radio.air.rhythm import Rhythm

PERIOD_US, LONG_US, SHORT_US = 4_900_000, 460_000, 313_000


def listening() -> Rhythm:
    rhythm = Rhythm(PERIOD_US, LONG_US)
    rhythm.heard(1_000_000, 1_000_000 + SHORT_US)
    rhythm.next_us = SHORT_US
    return rhythm


def test_an_order_meets_only_the_state_that_is_due() -> None:
    rhythm = listening()
    assert not rhythm.meets(5_500_000, 5_880_000)
    assert rhythm.meets(5_600_000, 5_920_000)
    assert rhythm.meets(6_200_000, 6_500_000)
    assert not rhythm.meets(5_900_000 + LONG_US + 20_000, 6_800_000)


def test_an_order_in_a_hurry_waits_for_a_state_no_longer_than_it_should_be() -> None:
    rhythm = listening()
    after_us = 5_900_000 + SHORT_US + 20_000
    assert rhythm.meets(after_us, 6_600_000)
    assert not rhythm.meets(after_us, 6_600_000, hurries=True)
    assert rhythm.meets(5_900_000 + SHORT_US - 20_000, 6_600_000, hurries=True)


def test_a_state_that_came_early_or_late_moves_those_after_it() -> None:
    rhythm = listening()
    rhythm.heard(3_000_000, 3_460_000)
    assert not rhythm.meets(5_800_000, 6_100_000)
    assert rhythm.meets(7_800_000, 8_100_000)


def test_a_state_that_was_due_in_a_run_of_answers_comes_after_the_last_pause() -> None:
    rhythm = listening()
    rhythm.answered(5_500_000, 7_600_000)
    rhythm.answered(6_300_000, 8_400_000)
    rhythm.answered(7_100_000, 9_200_000)
    assert not rhythm.meets(7_300_000, 7_700_000)
    assert rhythm.meets(9_000_000, 9_300_000)
    assert rhythm.meets(9_300_000, 9_600_000)
    assert rhythm.meets(9_200_000 + PERIOD_US - 100_000, 9_200_000 + PERIOD_US + 200_000)


def test_a_pause_in_which_nothing_was_due_holds_nothing_back() -> None:
    rhythm = listening()
    rhythm.answered(2_000_000, 4_000_000)
    assert not rhythm.meets(3_900_000, 4_200_000)
    assert not rhythm.meets(4_100_000, 4_400_000)


def test_a_state_due_while_the_order_was_on_the_air_is_held_back_as_well() -> None:
    rhythm = listening()
    rhythm.answered(6_000_000, 8_400_000)
    assert not rhythm.meets(6_500_000, 6_800_000)
    assert rhythm.meets(8_200_000, 8_500_000)


def test_an_answer_that_a_state_precedes_is_awaited_longer() -> None:
    rhythm = listening()
    assert rhythm.over_us(5_700_000, 150_000) is None
    assert rhythm.over_us(5_800_000, 150_000) in range(5_900_000 + SHORT_US, 5_900_000 + SHORT_US + 30_000)
    rhythm.answered(6_300_000, 8_400_000)
    assert rhythm.over_us(7_000_000, 150_000) is None
