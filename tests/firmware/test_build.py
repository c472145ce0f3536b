"""The firmware builds for both boards, fits in half of them, and its protocol code survives the host tests."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

from sitl.board import avr


def make(*words):
    done = subprocess.run(["make", "-s", "-C", str(avr.FIRMWARE), *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("variant", ["uno", "mega", "uno_bench", "mega_bench"])
def test_builds_without_a_warning(avr_build, variant):
    avr_build(variant)
    assert (avr.BUILD / f"{variant}.hex").stat().st_size > 1000


def test_size_is_below_half_of_flash_and_ram(avr_build):
    avr_build("uno", "mega")
    shares = [float(share) for share in re.findall(r"\(([\d.]+) %\)", make("size"))]
    assert len(shares) == 4
    assert max(shares) < 50.0


def test_a_firmware_that_is_too_large_fails(avr_build):
    avr_build("uno")
    script = [sys.executable, str(avr.FIRMWARE / "size.py"), f"{avr.BUILD}/uno.elf:8000:2048"]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "more than half" in done.stdout


@pytest.mark.parametrize("lines", [20_000, pytest.param(1_000_000, marks=pytest.mark.soak)])
def test_protocol_code_under_sanitizers(lines):
    """All vectors, all sequences up to length 3, random lines, and as many noisy ones in three ways."""
    missing = [name for name in ("make", "g++") if not shutil.which(name)]
    if missing and os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail(f"missing packages: {' '.join(missing)}", pytrace=False)
    if missing:
        pytest.skip(f"missing packages: {' '.join(missing)}")
    said = make("host-test", f"HOST_LINES={lines}")
    assert re.search(r"[1-9]\d+ passed, 0 failed", said), said
    assert said.count(f"of {lines} lines applied, 0 wrong") == 3
