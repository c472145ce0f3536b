"""Shared fixtures: where the outside data is, and what a missing package means."""

from __future__ import annotations

import gc
import os
from pathlib import Path

import pytest

pytest_plugins = ["tests.groups"]
"""Which tests run one after the other."""

gc.disable()  # until the tests are collected: millions of objects come, and none goes
REPO = Path(__file__).resolve().parents[1]
SHARED_DATA = REPO.parent / "shared" / "data"
PYPY = REPO / ".venv-pypy/bin/companion"
"""What ``make pypy`` makes."""


def require(present: bool, what: str) -> None:
    """Skip when something is missing on a user's machine; fail under REQUIRE_ALL=1 (CI)."""
    if present:
        return
    if os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail(f"{what} is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
    pytest.skip(f"{what} is missing")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded data from elsewhere; tests that use it skip when it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no recorded data at {SHARED_DATA.relative_to(REPO.parent)} beside the checkout")
    return SHARED_DATA


@pytest.fixture(scope="session")
def leixoes(shared_data: Path) -> Path:
    """Soundings of the harbour of Leixões, DUNE-style; tests that use them skip when they are absent."""
    path = shared_data / "bathymetry" / "leixoes_apdl_bathymetry.ini"
    if not path.is_file():
        pytest.skip(f"no {path.name} among the recorded data")
    return path


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-expected", action="store_true", help="accept what tests/replay finds as the expectation")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test on the real clock may fall over a machine that stands still for a second: it gets one more try, shown as R."""
    for item in items:
        if item.get_closest_marker("e2e"):
            item.add_marker(pytest.mark.flaky(reruns=1, reruns_delay=2))


def pytest_collection_finish(session: pytest.Session) -> None:
    """Seven thousand collected tests never become rubbish: they need not be looked through at every collection."""
    gc.collect()
    gc.freeze()
    gc.enable()
