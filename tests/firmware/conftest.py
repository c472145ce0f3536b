"""What the firmware tests need, and what it means when that is missing."""

from __future__ import annotations

import os

import pytest

from sitl.board import avr
from tests.firmware.chip_process import Chip


@pytest.fixture(scope="session")
def avr_build():
    """Return a function that builds firmware targets. Skips naming the packages; fails under REQUIRE_ALL=1."""
    missing = avr.missing_packages()
    if missing:
        text = f"missing packages: {' '.join(missing)}"
        if os.environ.get("REQUIRE_ALL") == "1":
            pytest.fail(f"{text}, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
        pytest.skip(text)
    return avr.build


@pytest.fixture
def chips(avr_build, tmp_path):
    avr_build("uno", "sim")
    made = []

    def make(count, **options):
        made.extend(Chip(tmp_path / f"port{len(made)}", **options) for _ in range(count))
        return made[-count:]

    yield make
    for chip in made:
        chip.close()
