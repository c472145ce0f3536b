"""An operator's work over the radio at every phase of the vessel's rhythm, on a clean and on a lossy air, with the stand-in's windows.

What must hold whatever the air loses: nothing is shown that is not so aboard, what is accepted is shown at once, and boat, gateway
and station end in one state.
"""

from __future__ import annotations

import pytest

from tests.other_buttons import MavproxyButtons, MavsdkButtons
from tests.qgc_buttons import MODE_S, SET_MODE, Generation
from tests.radio_rig import Seen, armings, campaign, connected


def assert_true(seen: Seen) -> None:
    assert (seen.false, seen.differing) == ([], [])
    assert seen.shown_s
    assert max(seen.shown_s) <= 0.2


@pytest.mark.parametrize(("generation", "phases"), [(Generation.V4, range(2)), (Generation.V5, range(2, 4))])
def test_on_a_clean_air_no_arming_fails_and_all_that_is_shown_is_true(tmp_path, generation, phases):
    screen = connected(tmp_path, generation)
    seen = campaign(screen, 4, 0.0, only=phases)
    assert_true(seen)
    assert (seen.arms, seen.arm_popups) == (2, 0)
    assert max(seen.sailing_s) <= 5.0
    assert seen.popups == []


def test_on_a_lossy_air_nothing_false_is_shown(tmp_path):
    assert_true(campaign(connected(tmp_path, Generation.V5), 3, 0.3))


def test_armings_on_a_lossy_air_are_as_soon_as_two_tries_can_be(tmp_path):
    screen = connected(tmp_path)
    late, best = armings(screen, 4, 0.3)
    assert (screen.seen.false, screen.seen.differing) == ([], [])
    assert late <= best


@pytest.mark.parametrize("client", [MavsdkButtons, MavproxyButtons])
def test_other_clients_see_nothing_false_on_a_lossy_air(tmp_path, client):
    seen = campaign(connected(tmp_path, client=client()), 1, 0.3)
    assert_true(seen)


@pytest.mark.soak
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("client", [MavsdkButtons, MavproxyButtons])
def test_a_hundred_phases_of_other_clients(tmp_path, client, loss):
    boxes = []
    for first in range(0, 100, HOUR):
        folder = tmp_path / str(first)
        folder.mkdir()
        seen = campaign(connected(folder, client=client()), 100, loss, only=range(first, first + HOUR))
        assert_true(seen)
        boxes += seen.popups
    print(f"{client.__name__}, loss {loss}: {len(boxes)} commands failed: {boxes}")
    assert loss or not boxes


@pytest.mark.soak
@pytest.mark.parametrize("generation", Generation, ids=lambda item: item.value)
def test_a_hundred_phases_on_a_clean_air(tmp_path, generation):
    popups: list[str] = []
    answered_s: list[float] = []
    for first in range(0, 100, HOUR):
        folder = tmp_path / str(first)
        folder.mkdir()
        screen = connected(folder, generation)
        seen = campaign(screen, 100, 0.0, only=range(first, first + HOUR))
        assert_true(seen)
        assert seen.arm_popups == 0
        assert max(seen.sailing_s) <= 5.0
        popups += seen.popups
        answered_s += [seconds for command, seconds in screen.client.report.answers if command == SET_MODE]
    late = [seconds for seconds in answered_s if seconds > Generation.V5.answer_s]
    print(
        f"{generation.value}: {len(popups)} boxes: {popups}; modes answered after more than 1.2 s: {len(late)} of {len(answered_s)}"
    )
    assert not popups
    assert max(answered_s) <= MODE_S


HOUR = 20
"""Voyages of seven orders in ten minutes: more of them without a pause use up what the law gives the shore of the air in an hour."""


@pytest.mark.soak
@pytest.mark.parametrize(("loss", "bar"), [(0.1, 0.06), (0.3, 0.27)])
def test_a_hundred_armings_on_a_lossy_air(tmp_path, loss, bar):
    screen = connected(tmp_path)
    late, best = armings(screen, 100, loss)
    print(f"loss {loss}: {late} of 100 armings end in a box, repeating back to back {best}")
    assert (screen.seen.false, screen.seen.differing) == ([], [])
    assert late / 100 <= bar
    assert late <= 1.2 * best


@pytest.mark.soak
@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_a_hundred_phases_on_a_lossy_air(tmp_path, loss):
    seen = campaign(connected(tmp_path), 100, loss)
    print(f"loss {loss}: {seen.arm_popups} of {seen.arms} armings end in a box")
    assert_true(seen)
