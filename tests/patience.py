"""For the few tests here that wait for a kernel or a thread: how long at most, and how to see that nothing waited."""

from __future__ import annotations

import resource
from typing import Final

PATIENCE_S: Final = 60.0
"""After this something never comes. No test passes by it, so it may be long: a busy machine needs seconds for what takes milliseconds."""


def waits() -> int:
    """How often this thread has given up the processor to wait for something; being pushed off by others does not count."""
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw
