"""End-to-end tests: real processes, real sockets, real clients, on the real clock. They wait more than they work, so some
run side by side; what has deadlines is kept apart by ``tests/groups.py``."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.e2e)
