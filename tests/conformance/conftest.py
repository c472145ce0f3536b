"""Every check of a ground station's expectations runs for both faces of the vessel."""

import pytest

from tests.fake_vessel import Bench


@pytest.fixture(params=["ardurover", "generic"])
def persona(request):
    return request.param


@pytest.fixture
def bench(persona):
    """A fake vessel with one endpoint and one station (255/190), one tick old."""
    made = Bench(persona)
    made.tick()
    return made
