"""Which worker gets which tests: those with deadlines on the real clock must not run beside each other, those of one module go together.

pytest-xdist's own mark for this (``xdist_group``) writes to a field that pytest 9 no longer reads, so its groups are none. What a test's
id tells is asked here instead, where the workers are given their tests. Everything else goes to whoever is free.
"""

from __future__ import annotations

from typing import Final

import pytest
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

GROUPS: Final = {
    # pins and processes are watched against a clock: two of these at once would take each other's time
    "deadlines": ("test_firmware_vessel", "test_lifecycle", "test_kill_runs", "test_pty_deadlines"),
    "boards": ("test_pty_real_time",),
    # the tests of each share what its first one makes: an environment, parsed sources, a voyage, a page on its ports
    "pypy": ("test_pypy",),
    "sources": ("test_house_rules",),
    "voyage": ("test_depth_memory_voyages",),
    "page": ("test_page",),
    "ordering": ("test_page_ordering",),
    "strangers": ("test_page_strangers",),
}
"""By group: the modules of its tests."""


REAL_CLOCK: Final = ("tests/e2e/", "tests/firmware/test_pty_")
"""Few and long: each is handed out alone. Of the others, many and short, a module at a time: it makes what they share once, and seven
thousand questions of who is free took a quarter of a minute."""
LONGEST: Final = (
    "test_gateway_story",
    "test_loiter_story",
    "test_firmware_vessel",
    "test_page",
    "test_page_ordering",
    "test_plan_command",
    "test_tuning",
)
"""Begun first, or one worker does them alone when the others are done: stories on the real clock, the groups of deadlines; the longest of
the modules that the alphabet puts last."""


def group_of(nodeid: str) -> str | None:
    """Return the group of a test, None for one that may run beside any."""
    module = nodeid.partition("::")[0].rpartition("/")[2].removesuffix(".py")
    return next((name for name, modules in GROUPS.items() if module in modules), None)


class GroupScheduling(LoadScopeScheduling):  # type: ignore[misc, unused-ignore]
    """Hands a group or a module to one worker, test after test, and any test on the real clock to whoever is free."""

    def _split_scope(self, nodeid: str) -> str:
        alone = nodeid if nodeid.startswith(REAL_CLOCK) else nodeid.partition("::")[0]
        return group_of(nodeid) or alone


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.stem not in LONGEST)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> GroupScheduling | None:
    """``--dist loadgroup`` means these groups."""
    return GroupScheduling(config, log) if config.getoption("dist") == "loadgroup" else None
