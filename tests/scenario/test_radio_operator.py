"""An operator's work over the radio at every phase of the vessel's rhythm, on a clean and on a lossy air, with the stand-in's windows.

What must hold whatever the air loses: nothing is shown that is not so aboard, what is accepted is shown at once, and boat, gateway
and station end in one state.
"""

from __future__ import annotations

import random

import pytest

from tests.qgc_buttons import Generation
from tests.radio_rig import Seen, campaign, connected

EXCHANGE_S = 0.74
"""Order, answer and all between them, when nothing is lost."""
WINDOW_S = 1.5


def oracle(loss: float, phases: int) -> float:
    """Share of armings that come too late for who repeats back to back, each exchange of two packets by the campaign's own draws."""
    late = 0
    for phase in range(phases):
        draws = random.Random(f"{loss}/{phase}")
        tries = int(WINDOW_S / EXCHANGE_S)
        late += not any(draws.random() >= loss and draws.random() >= loss for _ in range(tries))
    return late / phases


def assert_true(seen: Seen) -> None:
    assert (seen.false, seen.differing) == ([], [])
    assert seen.shown_s
    assert max(seen.shown_s) <= 0.2


def test_on_a_clean_air_no_arming_fails_and_all_that_is_shown_is_true(tmp_path):
    screen = connected(tmp_path)
    seen = campaign(screen, 4, 0.0)
    assert_true(seen)
    assert (seen.arms, seen.arm_popups) == (4, 0)
    assert max(seen.sailing_s) <= 5.0
    assert not [text for text in seen.popups if "failed" in text or "rejected" in text or "denied" in text]


def test_on_a_lossy_air_nothing_false_is_shown(tmp_path):
    assert_true(campaign(connected(tmp_path, Generation.V5), 3, 0.3))


@pytest.mark.soak
@pytest.mark.parametrize("generation", Generation, ids=lambda item: item.value)
def test_a_hundred_phases_on_a_clean_air(tmp_path, generation):
    seen = campaign(connected(tmp_path, generation), 100, 0.0)
    assert_true(seen)
    assert seen.arm_popups == 0
    assert max(seen.sailing_s) <= 5.0


@pytest.mark.soak
@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_a_hundred_phases_on_a_lossy_air(tmp_path, loss):
    seen = campaign(connected(tmp_path), 100, loss)
    share, best = seen.arm_popups / seen.arms, oracle(loss, 100)
    print(f"loss {loss}: {share:.1%} of {seen.arms} armings end in a box, repeating back to back {best:.1%}")
    assert_true(seen)
