"""A console's sticks: what they add up to, and that each one is neutral when nobody names it any more."""

from __future__ import annotations

import pytest

from companion.imc.desk.remote import RemoteSticks

HOLD_US = 1_000_000


def held(*messages: str, period_us: int = 100_000) -> tuple[float, float]:
    """What the vessel is told after messages at 10 Hz, each at its time."""
    sticks = RemoteSticks(HOLD_US, 0)
    said = None
    for number, actions in enumerate(messages):
        sticks.take(actions, number * period_us)
        said = sticks.due(number * period_us)
    assert said is not None
    return said


def test_axes_add_up() -> None:
    assert held("Thrust=127;Heading=-127") == (1.0, -1.0)
    assert held("Port Motor=127;Starboard Motor=-127") == (0.0, 1.0)
    assert held("Thrust=127", "Port Motor=127;Starboard Motor=127") == (1.0, 0.0)


@pytest.mark.parametrize("other", ["", "Foo=3", "Thrust", "Thrust=nan", "Heading=0", "Accelerate=0", "Stop=0", ";;;="])
@pytest.mark.parametrize("thrust", ["Thrust=64", "Port Motor=64;Starboard Motor=64"])
def test_only_a_message_that_names_an_axis_makes_it_last(other: str, thrust: str) -> None:
    assert held(thrust, *[other] * 9)[0] > 0.4
    assert held(thrust, *[other] * 12)[0] == 0.0


def test_each_motor_ages_by_itself() -> None:
    assert held("Port Motor=127;Starboard Motor=127", *["Port Motor=127"] * 12) == (0.5, 0.5)


def test_an_axis_that_is_repeated_lasts() -> None:
    assert held(*["Thrust=127"] * 50)[0] == 1.0


def test_a_button_counts_once_and_its_thrust_lasts_while_buttons_are_named() -> None:
    up = ["Accelerate=1"] * 5 + ["Accelerate=0"] * 5
    assert held(*up, *up)[0] == pytest.approx(0.2)
    assert held(*up, *["Accelerate=0;Decelerate=0"] * 30)[0] == pytest.approx(0.1)
    assert held(*up, *["Heading=0"] * 12)[0] == 0.0
    assert held(*up, "Thrust=0", *["Accelerate=0"] * 5)[0] == 0.0, "a stick in the middle is in the middle"
    assert held(*up, "Stop=1")[0] == 0.0
