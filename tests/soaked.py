"""Cases of a test that only the soak looks at: other numbers of a kind that a case of every run stands for."""

from __future__ import annotations

from typing import Any

import pytest


def in_the_soak(*cases: Any) -> list[Any]:
    """Return the cases, marked, for ``pytest.mark.parametrize``; one of several arguments is a tuple."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.soak) for case in cases]
