"""The recording side of the inputs: wraps links and store, and turns what they do into records."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping
from typing import Any, Final

from mavlink_bridge.language.witness import Witness

from ..keeping import AnyStore, Completion, StoreContent, StoreOp
from ..links import Link, LinkEvent, Opened, Received
from ..links.link import GuardedLink, Listening, Selective
from .frame_log import FrameLog
from .inputs import (
    CLOSED,
    COMPLETED,
    DONE,
    EVENT,
    FETCHED,
    KINDS,
    MADE,
    MAGIC,
    OPENED,
    RECEIVED,
    RECORD_META,
    RECORD_STEP,
    RECORD_STORE,
    STEP_HEAD,
    SUBMITTED,
    TOLD,
    VERDICT,
    WRITE,
    WROTE,
    StepKind,
    pack_record,
)
from .key_blanker import EventBlanker

_KIND_NUMBERS: Final = {kind: number for number, kind in enumerate(KINDS)}


class InputRecorder:
    """Collects steps and hands finished records on as bytes.

    ``sink`` takes them (the recorder's buffer), ``head`` what stands before them; ``begin`` opens a step and finishes
    the one before; ``finish`` closes the last. Nothing here touches a file.
    """

    def __init__(self, sink: Callable[[bytes], None], head: Callable[[bytes], None] | None = None) -> None:
        self._sink = sink
        self._head = head or sink
        self._parts: list[bytes] = []
        self._started = False
        self.number = 0
        """Steps begun."""

    def start(self, meta: Mapping[str, Any], store: Mapping[str, Any] | None = None) -> None:
        """Write the header: ``meta`` lists the links, ``store`` is the store's content. Before it nothing is kept."""
        self._started = True
        about = pack_record(RECORD_META, json.dumps(meta, sort_keys=True).encode())
        self._head(MAGIC + about + pack_record(RECORD_STORE, json.dumps(store or {}, sort_keys=True).encode()))

    def begin(
        self, kind: StepKind, now_us: int, *, utc_us: int | None = None, load: float = 0.0, late_s: float = 0.0
    ) -> None:
        """Open a step; what the clock and the loop say of it is input too."""
        if not self._started:
            return
        number = self.number
        head = STEP_HEAD.pack(
            _KIND_NUMBERS[kind], now_us, -1 if utc_us is None else utc_us, load, late_s, number & 0xFFFFFFFF
        )
        if self._parts:
            self._sink(pack_record(RECORD_STEP, b"".join(self._parts)))
        self._parts = [head]
        self.number = number + 1

    def finish(self) -> None:
        """Close the open step."""
        if self._parts:
            self._sink(pack_record(RECORD_STEP, b"".join(self._parts)))
            self._parts = []

    def events(self, link: int, poll: int, events: list[LinkEvent]) -> None:
        """Keep what poll number ``poll`` (within this step) of ``link`` returned."""
        if not self._parts:
            return
        for event in events:
            if isinstance(event, Received):
                what, body = RECEIVED, event.data
            elif isinstance(event, Opened):
                what, body = OPENED, event.peer.encode()
            else:
                what, body = CLOSED, event.reason.encode()
            self._parts.append(EVENT.pack(what, poll, link, event.channel, len(body)))
            self._parts.append(body)

    def wrote(self, link: int, channel: int, data: bytes, accepted: int, keep: bool) -> None:
        if not self._parts:
            return  # outside a step, as when an app says goodbye twice
        self._parts.append(WRITE.pack(WROTE, keep, link, channel, len(data), accepted, zlib.crc32(data)))
        if keep:
            self._parts.append(data)

    def completed(self, ticket: int, ok: bool, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(DONE.pack(COMPLETED, ok, ticket, len(body)))
        self._parts.append(body)

    def fetched(self, ticket: int, ok: bool, body: bytes) -> None:
        """Keep what the archive of logs gave."""
        if self._parts:
            self._parts.append(DONE.pack(FETCHED, ok, ticket, len(body)))
            self._parts.append(body)

    def verdict(self, ok: bool) -> None:
        """Keep what a check of a signature or tag found."""
        if self._parts:
            self._parts.append(DONE.pack(VERDICT, ok, 0, 0))

    def made(self, data: bytes) -> None:
        """Keep a signature, a tag or a random number."""
        if self._parts:
            self._parts.append(DONE.pack(MADE, True, 0, len(data)))
            self._parts.append(data)

    def told(self, severity: int, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(DONE.pack(TOLD, True, severity, len(body)))
        self._parts.append(body)

    def submitted(self, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(DONE.pack(SUBMITTED, True, 0, len(body)))
        self._parts.append(body)


class RecordingLink:
    """A link that writes down what it does; the app cannot tell the difference.

    ``keep``: written bytes are kept whole. ``frames``: the telemetry log that the link's MAVLink frames go to.
    """

    def __init__(
        self, link: Link, recorder: InputRecorder, index: int, keep: bool = False, frames: FrameLog | None = None
    ) -> None:
        self._link = link
        self._recorder = recorder
        self._index = index
        self._frames = frames
        self._keys = None if frames is None else EventBlanker()
        self.keep = keep
        self._step = 0
        self._polls = 0
        self.name = link.name
        self.datagrams = link.datagrams

    def poll(self, now_us: int) -> list[LinkEvent]:
        events = self._link.poll(now_us)
        recorder = self._recorder
        if self._step == recorder.number:
            self._polls += 1
        else:
            self._step, self._polls = recorder.number, 0
        if events:
            kept = events if self._keys is None else self._keys.blank(events)
            recorder.events(self._index, min(self._polls, 255), kept)
            if self._frames is not None:
                self._frames.heard(events, now_us)
        return events

    def write(self, channel: int, data: bytes) -> int:
        accepted = self._link.write(channel, data)
        self._recorder.wrote(self._index, channel, data, accepted, self.keep)
        if accepted and self._frames is not None:
            self._frames.said(data)
        return accepted

    def guard(self) -> None:
        if isinstance(self._link, GuardedLink):
            self._link.guard()

    def trust(self, channel: int) -> None:
        if isinstance(self._link, GuardedLink):
            self._link.trust(channel)

    def take_stranger(self) -> str:
        """No input of the vessel's: whoever tells of it tells by the recorder."""
        return self._link.take_stranger() if isinstance(self._link, Selective) else ""

    @property
    def is_listening(self) -> bool:
        return not isinstance(self._link, Listening) or self._link.is_listening

    def filenos(self) -> list[int]:
        return self._link.filenos()

    def describe(self) -> str:
        return self._link.describe()

    def close(self) -> None:
        self._link.close()


class RecordingWitness(Witness):
    """Writes down what keys proved and made."""

    def __init__(self, recorder: InputRecorder) -> None:
        self._recorder = recorder

    def verdict(self, check: Callable[[], bool]) -> bool:
        ok = check()
        self._recorder.verdict(ok)
        return ok

    def made(self, make: Callable[[], bytes]) -> bytes:
        data = make()
        self._recorder.made(data)
        return data


class RecordingStore:
    """A store that writes down its completions; its content at start goes into the recording's second record."""

    def __init__(self, store: AnyStore, recorder: InputRecorder) -> None:
        self._store = store
        self._recorder = recorder
        self.warnings = store.warnings

    def snapshot(self) -> StoreContent:
        return self._store.snapshot()

    def submit(self, op: StoreOp) -> int:
        return self._store.submit(op)

    def completions(self) -> list[Completion]:
        done = self._store.completions()
        for ticket, ok, text in done:
            self._recorder.completed(ticket, ok, text)
        return done

    def close(self) -> None:
        self._store.close()


def links_meta(links: list[Link]) -> list[dict[str, Any]]:
    """Describe links for the recording's ``meta["links"]``."""
    return [{"name": link.name, "datagrams": link.datagrams} for link in links]
