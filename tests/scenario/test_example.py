"""The example of the README runs."""

from __future__ import annotations

import runpy
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "first_loiter.py"


def test_the_first_loiter_is_sailed() -> None:
    names = runpy.run_path(str(EXAMPLE))
    assert names["main"](120.0) < 0.5
