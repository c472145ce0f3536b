"""Changes that must outlive the process: handed to the store's writer, put in force and acknowledged once they are on disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.points import LatLon
from mavlink_bridge.language.requests import ACCEPTED, Reply, Result

from .core.vehicle.controls import Controls
from .core.vehicle.voyage import Left
from .io.keeping import AnyStore, Completion, StoreContent, StoreOp
from .io.keeping.content import ForgetRecord, SaveRecord
from .store_watch import StoreWatch

_VOYAGE: Final = "voyage"
"""Name of the store's record of a voyage under way."""
_AGAIN_US: Final = 1_000_000
"""Between two tries: the writer that is busy is not to be filled up."""
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


class VoyageKeeper:
    """Keeps in the store that a voyage is under way, and where its home is: a computer that starts again offshore is no departure."""

    def __init__(self, lasting: Lasting, controls: Controls, content: StoreContent) -> None:
        self._lasting = lasting
        self._controls = controls
        self._saved: dict[str, object] | None = None
        self._now_us = self._again_us = 0
        """The latter: when a change that was not stored is tried again."""
        record = content.records.get(_VOYAGE)
        data = record.data if record is not None and record.version == 1 else None
        if isinstance(data, dict):
            place, home, seen = (_point(data.get(name)) for name in ("place", "home", "seen"))
            left, by_operator = _left(data.get("left")), data.get("by_operator") is True
            controls.resume_voyage(place, home, seen, left, by_operator=by_operator)
            self._saved = controls.lasting_voyage

    def tick(self, now_us: int) -> None:
        """Store what has changed since; again, a second later, what could not be."""
        self._now_us, now, before = now_us, self._controls.lasting_voyage, self._saved
        if now == before or now_us < self._again_us:
            return

        def answer(reply: Reply) -> None:
            if reply.result is not Result.ACCEPTED and self._saved is now:
                self._saved, self._again_us = before, self._now_us + _AGAIN_US

        self._saved = now
        self._lasting.submit(ForgetRecord(_VOYAGE) if now is None else SaveRecord(_VOYAGE, 1, now), answer)


def _point(value: object) -> LatLon | None:
    if isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(part, float) for part in value):
        return LatLon((value[0], value[1]))
    return None


def _left(value: object) -> Left | None:
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    return _point(value[0]), value[1] if isinstance(value[1], int) else None
