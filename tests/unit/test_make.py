"""``make test``: both halves run, whatever the first did, and a failure of either is one of the whole."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("first", "second", "ends"), [(0, 0, 0), (1, 0, 2), (0, 1, 2), (2, 3, 2), (5, 0, 0), (0, 5, 0), (-2, 0, 2)]
)
def test_a_failed_first_half_hides_nothing_of_the_second(tmp_path, first, second, ends):
    fake = tmp_path / "pytest"
    ways = f'case "$*" in *"not e2e"*) echo first; exit {first % 256};; *) echo second; exit {second % 256};; esac'
    fake.write_text(f"#!/bin/bash\n{ways}\n")
    fake.chmod(0o755)
    words = ["make", "-s", "-C", str(REPO), "-o", "compiled", "test", f"PYTEST={fake}"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert [line for line in done.stdout.splitlines() if line in ("first", "second")] == ["first", "second"]
    assert done.returncode == ends
