"""End-to-end tests: real processes, real sockets, real clients. Each has ports of its own,
but they run one after the other, because the clock is real."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in Path(item.fspath).parents:
            item.add_marker(pytest.mark.e2e)
            # what waits for slow air waits in a group of its own, beside the others
            group = "e2e-radio" if "radio" in item.name or "gateway" in item.name else "e2e"
            item.add_marker(pytest.mark.xdist_group(group))
