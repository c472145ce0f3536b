"""Hours over a fading air with orders at random: what must never happen does not happen."""

import pytest

from tests.soaked import in_the_soak
from tools.benches.lora import soak

CASES = [(name, loss) for name in ("o-10", "n-0.1") for loss in (0.0, 0.3, 0.6)]


def assert_clean(found):
    assert found["asked"] > 0
    assert (found["violations"], found["false"], found["twice"]) == (0, 0, 0), found


@pytest.mark.parametrize("name", ["o-10", *in_the_soak("n-0.1")])
def test_an_hour(name):
    assert_clean(soak(name, 0.3, 1.0, seed=3))


@pytest.mark.parametrize("loss", [0.0, 0.6])
@pytest.mark.parametrize("name", ["o-10", "n-0.1"])
def test_twenty_minutes_on_a_clean_and_on_a_bad_air(name, loss):
    """The day of each is in the soak."""
    assert_clean(soak(name, loss, 1 / 3, seed=round(loss * 10)))


@pytest.mark.soak
@pytest.mark.parametrize(("name", "loss"), CASES)
def test_a_day(name, loss):
    assert_clean(soak(name, loss, 24.0, seed=100 + round(loss * 10)))
