"""A helper thread: it runs what may wait for a disk (or a terminal: ``outlet``), one thing after the other, so that no tick ever does.

Jobs are called in order; what they return goes nowhere and what they raise ends only themselves. The queue is
bounded: a disk that hangs makes ``post`` say no instead of filling the memory.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Final

MAX_JOBS: Final = 512


class Writer:
    """A thread with a bounded queue of jobs."""

    def __init__(self, max_jobs: int = MAX_JOBS) -> None:
        self._jobs: queue.Queue[Callable[[], None] | None] = queue.Queue(max_jobs)
        self._thread = threading.Thread(target=self._work, name="writer", daemon=True)
        self._thread.start()

    def post(self, job: Callable[[], None], wait_s: float = 0.0) -> bool:
        """Queue a job; False when the queue is full. Does not wait, unless told so (at the end of a run)."""
        try:
            self._jobs.put(job, block=wait_s > 0.0, timeout=wait_s or None)
        except queue.Full:
            return False
        return True

    @property
    def waiting(self) -> int:
        """Jobs that have not begun."""
        return self._jobs.qsize()

    def close(self, timeout_s: float = 5.0) -> bool:
        """Let the queued jobs finish, at most so long; True when all did."""
        with contextlib.suppress(queue.Full):
            self._jobs.put(None, timeout=timeout_s)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            with contextlib.suppress(Exception):
                job()
