"""End-to-end tests: real processes, real sockets, real clients, on the real clock. They wait more than they work, so three
groups of them run side by side: what has deadlines at the pins, what talks to ground stations, and what waits for slow air."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
WITH_DEADLINES = ("test_firmware_vessel", "test_lifecycle", "test_kill_runs")


def group_of(item: pytest.Item) -> str:
    if "radio" in item.name or "gateway" in item.nodeid:
        return "e2e-radio"
    return "e2e" if Path(item.fspath).stem in WITH_DEADLINES else "e2e-clients"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in Path(item.fspath).parents:
            item.add_marker(pytest.mark.e2e)
            item.add_marker(pytest.mark.xdist_group(group_of(item)))
