"""Recorded inputs: everything that reaches the app from outside, so that the same run can be had again.

``inputs.bin`` is a header and then records, each ``length u32, kind u8, body, crc u32`` (little-endian; CRC-32 of kind
and body). A cut at any byte costs at most the record it falls into. One record is one *step*: a pump, a tick or the
shutdown, with the time it was called with, what every poll of every link returned, what every write was offered and
took, the store's completions and the requests of the vessel's own people. The first record is the run's description
(JSON), the second the store's content (JSON). Written output is kept as length and CRC-32, or whole for a link that
asks (the actuators' line), so that a replay can compare.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

from companion.io.link import Closed, Link, LinkEvent, Opened, Received
from companion.io.store import AnyStore
from companion.io.store_content import Completion, StoreContent, StoreOp, from_json

MAGIC: Final = b"USVIN\x001\n"
StepKind = Literal["pump", "tick", "stop"]
_KINDS: Final[tuple[StepKind, ...]] = ("pump", "tick", "stop")
_META, _STORE, _STEP = 1, 2, 3
_HEAD: Final = struct.Struct("<IB")
_CRC: Final = struct.Struct("<I")
_STEP_HEAD: Final = struct.Struct("<BqqddI")
"""kind, now_us, utc_us (-1 unknown), load, late_s, number of the step."""
_EVENT: Final = struct.Struct("<BBHII")
"""what, poll number in this step, link, channel, length."""
_WRITE: Final = struct.Struct("<BBHIIII")
"""what, whole?, link, channel, offered, accepted, crc of the offered bytes."""
_DONE: Final = struct.Struct("<BBqI")
"""what, ok, ticket, length of the text."""
_OPENED, _RECEIVED, _CLOSED, _WROTE, _COMPLETED, _SUBMITTED, _TOLD = 1, 2, 3, 4, 5, 6, 7
_LONGEST: Final = 1 << 26


@dataclass(frozen=True, slots=True)
class Write:
    """One write as recorded."""

    channel: int
    offered: int
    accepted: int
    crc: int
    data: bytes | None = None
    """The offered bytes, for links that keep them."""


@dataclass(slots=True)
class Step:
    """One call of the app with all that came from outside during it."""

    kind: StepKind
    now_us: int
    number: int
    utc_us: int | None = None
    load: float = 0.0
    late_s: float = 0.0
    polls: dict[int, dict[int, list[LinkEvent]]] = field(default_factory=dict)
    """link -> number of the poll within this step -> events."""
    writes: dict[int, list[Write]] = field(default_factory=dict)
    completions: list[tuple[int, bool, str]] = field(default_factory=list)
    submitted: list[str] = field(default_factory=list)
    """Requests of the vessel's own people, made before this step (``request_json``)."""
    told: list[tuple[int, str]] = field(default_factory=list)
    """The recorder's own texts: severity, text."""


class InputRecorder:
    """Collects steps and hands finished records on as bytes.

    ``sink`` takes them (the recorder's buffer); ``begin`` opens a step and finishes the one before; ``finish`` closes
    the last. Nothing here touches a file.
    """

    def __init__(
        self, sink: Callable[[bytes], None], meta: Mapping[str, Any], store: Mapping[str, Any] | None = None
    ) -> None:
        self._sink = sink
        self._parts: list[bytes] = []
        self.number = 0
        """Steps begun."""
        sink(MAGIC)
        sink(pack_record(_META, json.dumps(meta, sort_keys=True).encode()))
        sink(pack_record(_STORE, json.dumps(store or {}, sort_keys=True).encode()))

    def begin(
        self, kind: StepKind, now_us: int, *, utc_us: int | None = None, load: float = 0.0, late_s: float = 0.0
    ) -> None:
        """Open a step; what the clock and the loop say of it is input too."""
        self.finish()
        self._parts.append(
            _STEP_HEAD.pack(
                _KINDS.index(kind), now_us, -1 if utc_us is None else utc_us, load, late_s, self.number & 0xFFFFFFFF
            )
        )
        self.number += 1

    def finish(self) -> None:
        """Close the open step."""
        if self._parts:
            self._sink(pack_record(_STEP, b"".join(self._parts)))
            self._parts.clear()

    def events(self, link: int, poll: int, events: list[LinkEvent]) -> None:
        """Keep what poll number ``poll`` (within this step) of ``link`` returned."""
        if not self._parts:
            return
        for event in events:
            if isinstance(event, Received):
                what, body = _RECEIVED, event.data
            elif isinstance(event, Opened):
                what, body = _OPENED, event.peer.encode()
            else:
                what, body = _CLOSED, event.reason.encode()
            self._parts.append(_EVENT.pack(what, poll, link, event.channel, len(body)))
            self._parts.append(body)

    def wrote(self, link: int, channel: int, data: bytes, accepted: int, keep: bool) -> None:
        if not self._parts:
            return  # outside a step, as when an app says goodbye twice
        self._parts.append(_WRITE.pack(_WROTE, keep, link, channel, len(data), accepted, zlib.crc32(data)))
        if keep:
            self._parts.append(data)

    def completed(self, ticket: int, ok: bool, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(_DONE.pack(_COMPLETED, ok, ticket, len(body)))
        self._parts.append(body)

    def told(self, severity: int, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(_DONE.pack(_TOLD, True, severity, len(body)))
        self._parts.append(body)

    def submitted(self, text: str) -> None:
        if not self._parts:
            return
        body = text.encode()
        self._parts.append(_DONE.pack(_SUBMITTED, True, 0, len(body)))
        self._parts.append(body)


def pack_record(kind: int, body: bytes) -> bytes:
    """Frame one record."""
    head = _HEAD.pack(len(body), kind)
    return b"%b%b%b" % (head, body, _CRC.pack(zlib.crc32(body, zlib.crc32(head[4:]))))


class RecordingLink:
    """A link that writes down what it does; the app cannot tell the difference."""

    def __init__(self, link: Link, recorder: InputRecorder, index: int, keep: bool = False) -> None:
        self._link = link
        self._recorder = recorder
        self._index = index
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
            recorder.events(self._index, min(self._polls, 255), events)
        return events

    def write(self, channel: int, data: bytes) -> int:
        accepted = self._link.write(channel, data)
        self._recorder.wrote(self._index, channel, data, accepted, self.keep)
        return accepted

    def filenos(self) -> list[int]:
        return self._link.filenos()

    def describe(self) -> str:
        return self._link.describe()

    def close(self) -> None:
        self._link.close()


class InputsError(ValueError):
    """A recording that cannot be read at all."""


class InputReader:
    """Reads ``inputs.bin``: ``meta`` and ``store`` at once, the steps one after the other.

    ``cut`` tells, after the last step, whether the file ended inside a record or in a damaged one (a power cut).
    """

    def __init__(self, path: Path) -> None:
        self._file: BinaryIO = path.open("rb")
        self.cut = False
        try:
            if self._file.read(len(MAGIC)) != MAGIC:
                raise InputsError(f"{path}: not a recording of inputs, or one of another version")
            self.meta: dict[str, Any] = self._json(_META)
            self.store: dict[str, Any] = self._json(_STORE)
        except BaseException:
            self._file.close()
            raise

    def _json(self, kind: int) -> dict[str, Any]:
        record = self._record()
        if record is None or record[0] != kind:
            return {}
        found = json.loads(record[1])
        return found if isinstance(found, dict) else {}

    def _record(self) -> tuple[int, bytes] | None:
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            self.cut = self.cut or bool(head)
            return None
        length, kind = _HEAD.unpack(head)
        if length > _LONGEST:
            self.cut = True
            return None
        body = self._file.read(length)
        tail = self._file.read(_CRC.size)
        if (
            len(body) < length
            or len(tail) < _CRC.size
            or _CRC.unpack(tail)[0] != zlib.crc32(body, zlib.crc32(head[4:]))
        ):
            self.cut = True
            return None
        return kind, body

    def steps(self) -> Iterator[Step]:
        """Yield the steps up to the end or the cut."""
        expected = 0
        while (record := self._record()) is not None:
            if record[0] != _STEP:
                continue
            step = unpack_step(record[1])
            if step.number != expected:
                self.cut = True  # records are missing: what follows would not replay
                return
            expected = (expected + 1) & 0xFFFFFFFF
            yield step

    def close(self) -> None:
        self._file.close()


def unpack_step(body: bytes) -> Step:
    """Read the body of a step whose CRC was right."""
    kind, now_us, utc_us, load, late_s, number = _STEP_HEAD.unpack_from(body)
    step = Step(_KINDS[kind], now_us, number, None if utc_us < 0 else utc_us, load, late_s)
    at = _STEP_HEAD.size
    while at < len(body):
        what = body[at]
        if what == _WROTE:
            _, keep, link, channel, offered, accepted, crc = _WRITE.unpack_from(body, at)
            at += _WRITE.size
            data = body[at : at + offered] if keep else None
            at += offered if keep else 0
            step.writes.setdefault(link, []).append(Write(channel, offered, accepted, crc, data))
        elif what in (_COMPLETED, _SUBMITTED, _TOLD):
            _, ok, ticket, length = _DONE.unpack_from(body, at)
            at += _DONE.size + length
            text = body[at - length : at].decode()
            if what == _COMPLETED:
                step.completions.append((ticket, bool(ok), text))
            elif what == _SUBMITTED:
                step.submitted.append(text)
            else:
                step.told.append((ticket, text))
        else:
            _, poll, link, channel, length = _EVENT.unpack_from(body, at)
            at += _EVENT.size + length
            event = _event(what, channel, body[at - length : at])
            step.polls.setdefault(link, {}).setdefault(poll, []).append(event)
    return step


def _event(what: int, channel: int, data: bytes) -> LinkEvent:
    if what == _RECEIVED:
        return Received(channel, data)
    return Opened(channel, data.decode()) if what == _OPENED else Closed(channel, data.decode())


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


class ReplayStore:
    """A store that starts with the recorded content and finishes each change when the recording says so."""

    def __init__(self, reader: InputReader) -> None:
        self.warnings: tuple[str, ...] = tuple(reader.meta.get("store_warnings", ()))
        self._content = from_json(reader.store)
        self._tickets = 0
        self._done: list[Completion] = []

    def load(self, step: Step) -> None:
        self._done = [Completion(*found) for found in step.completions]

    def snapshot(self) -> StoreContent:
        return self._content

    def submit(self, op: StoreOp) -> int:
        self._tickets += 1
        return self._tickets

    def completions(self) -> list[Completion]:
        done, self._done = self._done, []
        return done

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Difference:
    """Output that a replay made and the recording does not have (or the other way round)."""

    step: int
    now_us: int
    link: str
    before: str
    after: str
    data: bytes = b""
    """What was written now."""

    def __str__(self) -> str:
        at = f"step {self.step} at {self.now_us / 1e6:.3f} s, link {self.link}"
        return f"{at}\n  before  {self.before}\n  after   {self.after}"


class ReplayLink:
    """A link that says again what it said, and compares what is written to it."""

    def __init__(self, name: str, datagrams: bool, on_difference: Callable[[Difference], None]) -> None:
        self.name = name
        self.datagrams = datagrams
        self._differs = on_difference
        self._step: Step | None = None
        self._polls: dict[int, list[LinkEvent]] = {}
        self._poll_number = 0
        self._writes: list[Write] = []
        self._write_number = 0

    def load(self, step: Step, index: int) -> None:
        """Take over what the recording has for this link in ``step``."""
        self._step = step
        self._polls = step.polls.get(index, {})
        self._poll_number = 0
        self._writes = step.writes.get(index, [])
        self._write_number = 0

    def finish(self) -> None:
        """End the step: writes that did not happen again are differences."""
        for missing in self._writes[self._write_number :]:
            self._report(_describe(missing), "nothing written")
        self._writes = []
        self._write_number = 0

    def poll(self, now_us: int) -> list[LinkEvent]:
        events = self._polls.get(min(self._poll_number, 255), [])
        self._poll_number += 1
        return list(events)

    def write(self, channel: int, data: bytes) -> int:
        number, self._write_number = self._write_number, self._write_number + 1
        if number >= len(self._writes):
            self._report("nothing written", _describe(_as_write(channel, data)), data)
            return len(data)
        was = self._writes[number]
        if (was.channel, was.offered, was.crc) != (channel, len(data), zlib.crc32(data)):
            self._report(_describe(was), _describe(_as_write(channel, data)), data)
        return min(was.accepted, len(data))

    def _report(self, before: str, after: str, data: bytes = b"") -> None:
        step = self._step
        number, now_us = (step.number, step.now_us) if step else (-1, 0)
        self._differs(Difference(number, now_us, self.name, before, after, data))

    def filenos(self) -> list[int]:
        return []

    def describe(self) -> str:
        return f"{self.name} (replayed)"

    def close(self) -> None:
        self._polls = {}


def _as_write(channel: int, data: bytes) -> Write:
    return Write(channel, len(data), len(data), zlib.crc32(data), data)


def _describe(write: Write) -> str:
    content = "" if write.data is None else f" {write.data!r}"
    return f"channel {write.channel}, {write.offered} bytes, crc {write.crc:08x}{content}"


class ReplayLinks:
    """All links of a recording, in the order in which it lists them; ``links`` goes to a fresh app."""

    def __init__(self, reader: InputReader) -> None:
        self.differences: list[Difference] = []
        self.links: list[ReplayLink] = [
            ReplayLink(str(entry["name"]), bool(entry["datagrams"]), self._note)
            for entry in reader.meta.get("links", [])
        ]

    def _note(self, difference: Difference) -> None:
        if len(self.differences) < 1000:
            self.differences.append(difference)

    def load(self, step: Step) -> None:
        for index, link in enumerate(self.links):
            link.load(step, index)

    def finish(self) -> None:
        for link in self.links:
            link.finish()


def links_meta(links: list[Link]) -> list[dict[str, Any]]:
    """Describe links for the recording's ``meta["links"]``."""
    return [{"name": link.name, "datagrams": link.datagrams} for link in links]
