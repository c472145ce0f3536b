"""End-to-end tests: real processes, real sockets, real clients, on the real clock. They wait more than they work, so some
run side by side; what has deadlines is kept apart by ``tests/groups.py``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.browser import Browser, chromium
from tests.e2e.page_process import Boat

SIZES = {"phone": (390, 844, True), "desk": (1280, 900, False)}
HERE = Path(__file__).resolve().parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.e2e)


@pytest.fixture(scope="module")
def boat(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Boat]:
    """The module says which one by its ``INSTANCE``: each has ports of its own."""
    chromium()
    found = Boat(tmp_path_factory.mktemp("page"), request.module.INSTANCE)
    yield found
    found.close()


@pytest.fixture(params=SIZES)
def browser(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Browser]:
    width, height, phone = SIZES[request.param]
    found = Browser(tmp_path / "profile", width, height, phone=phone)
    yield found
    found.close()


@pytest.fixture
def phone(tmp_path: Path) -> Iterator[Browser]:
    found = Browser(tmp_path / "profile", *SIZES["phone"][:2], phone=True)
    yield found
    found.close()
