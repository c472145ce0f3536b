"""Changes that must outlive the process: handed to the store's writer, put in force and acknowledged once they are on disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mavlink_bridge.language.requests import ACCEPTED, Reply, Result

from .io.keeping import AnyStore, Completion, StoreOp
from .store_watch import StoreWatch

Answer = Callable[[Reply], None]


@dataclass(frozen=True, slots=True)
class _Waiting:
    answer: Answer
    apply: Callable[[], None]


class Lasting:
    """Between the vessel and its store. ``watch`` hears how the disk does."""

    def __init__(self, store: AnyStore, watch: StoreWatch) -> None:
        self._store = store
        self._watch = watch
        self._waiting: dict[int, _Waiting] = {}

    def submit(self, op: StoreOp, answer: Answer, apply: Callable[[], None] = lambda: None) -> None:
        """Store ``op``; then call ``apply`` and answer ACCEPTED, or answer FAILED and change nothing."""
        self._waiting[self._store.submit(op)] = _Waiting(answer, apply)

    def collect(self) -> None:
        """Take what the writer has done since the last call."""
        for done in self._store.completions():
            self._stored(done)

    def _stored(self, done: Completion) -> None:
        if not done.ticket:  # no change of ours: news of the disk
            self._watch.news(done)
            return
        waiting = self._waiting.pop(done.ticket, None)
        if waiting is None:
            return
        self._watch.wrote(done)
        if not done.ok:
            waiting.answer(Reply(Result.FAILED, f"not stored: {done.text}"))
            return
        waiting.apply()
        waiting.answer(ACCEPTED)
