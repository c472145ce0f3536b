"""Conversations with a vehicle: what is said, what it waits for, when it is said again, when it is given up.

A ``Job`` is a generator. It yields ``Step``s and gets the message that it waited for, or None when all tries are over; what it
returns is its ``JobOutcome``. Jobs run side by side; a message goes to every job that wants it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Final

MAX_JOBS: Final = 32
"""Nobody has that many orders under way; what comes on top has failed at once."""
_NOTHING: Final[tuple[Any, ...]] = ()


@dataclass(frozen=True, slots=True)
class JobOutcome:
    """What became of a job. ``reason``: one sentence for the operator, empty when it worked."""

    ok: bool
    reason: str = ""


DONE: Final = JobOutcome(True)


@dataclass(frozen=True, slots=True)
class Step:
    """One wait. ``say`` makes the messages of the n-th try, from 0; ``wait_s`` is the time of each try."""

    say: Callable[[int], Sequence[Any]]
    wants: Callable[[Any], bool]
    wait_s: float
    tries: int = 1


Job = Generator[Step, Any, JobOutcome]


@dataclass(slots=True, eq=False)
class _Running:
    job: Job
    done: Callable[[JobOutcome], None]
    step: Step
    tried: int = 0
    due_us: int = 0


class Exchange:
    """Runs the jobs of one link."""

    def __init__(self) -> None:
        self._running: list[_Running] = []
        self._now_us = 0

    @property
    def busy(self) -> bool:
        return bool(self._running)

    def start(self, job: Job, done: Callable[[JobOutcome], None], now_us: int) -> None:
        """Begin a job; ``done`` gets its outcome, perhaps before this returns."""
        self._now_us = now_us
        if len(self._running) >= MAX_JOBS:
            job.close()
            done(JobOutcome(False, "too many orders under way"))
            return
        running = _Running(job, done, Step(lambda _: _NOTHING, lambda _: False, 0.0))
        self._running.append(running)
        self._advance(running, None)

    def hear(self, message: Any, now_us: int) -> None:
        """Give a message to the jobs that wait for it."""
        self._now_us = now_us
        for running in tuple(self._running):
            if running.step.wants(message):
                self._advance(running, message)

    def poll(self, now_us: int) -> list[Any]:
        """What is to be sent now: first tries, repeats, and what follows from giving up."""
        self._now_us = now_us
        messages: list[Any] = []
        for running in tuple(self._running):
            while running in self._running and now_us >= running.due_us:
                if running.tried >= running.step.tries:
                    self._advance(running, None)
                    continue
                messages += running.step.say(running.tried)
                running.tried += 1
                running.due_us = now_us + round(running.step.wait_s * 1e6)
        return messages

    def drop(self, reason: str, job: Job | None = None) -> None:
        """End a job without success; None: all of them."""
        ended = [running for running in self._running if job is None or running.job is job]
        self._running = [running for running in self._running if running not in ended]
        for running in ended:
            running.job.close()
            running.done(JobOutcome(False, reason))

    def _advance(self, running: _Running, message: Any) -> None:
        """Hand a job what it waited for. Its next step is said at the next ``poll``."""
        try:
            step = next(running.job) if message is None and running.due_us == 0 else running.job.send(message)
        except StopIteration as end:
            self._running.remove(running)
            running.done(end.value)
            return
        running.step, running.tried, running.due_us = step, 0, max(self._now_us, 1)
