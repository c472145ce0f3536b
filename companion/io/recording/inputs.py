"""Recorded inputs: everything that reaches the app from outside, so that the same run can be had again.

``inputs.bin`` is a header and then records, each ``length u32, kind u8, body, crc u32`` (little-endian; CRC-32 of kind
and body). A cut at any byte costs at most the record it falls into. One record is one *step*: a pump, a tick or the
shutdown, with the time it was called with, what every poll of every link returned, what every write was offered and
took, the store's completions, what was fetched of earlier logs, the requests of the vessel's own people, and what keys proved
and made (never a key: a new signing key that comes over a link is blanked). The first
record is the run's description (JSON), the second the store's content (JSON). Written output is kept as length and
CRC-32, or whole for a link that asks (the actuators' line), so that a replay can compare.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Final, Literal

from mavlink_bridge.language.value import value

from ..links import Closed, LinkEvent, Opened, Received

MAGIC: Final = b"USVIN\x001\n"
StepKind = Literal["pump", "tick", "stop"]
KINDS: Final[tuple[StepKind, ...]] = ("pump", "tick", "stop")
RECORD_META, RECORD_STORE, RECORD_STEP = 1, 2, 3
HEAD: Final = struct.Struct("<IB")
CRC: Final = struct.Struct("<I")
STEP_HEAD: Final = struct.Struct("<BqqddI")
"""kind, now_us, utc_us (-1 unknown), load, late_s, number of the step."""
EVENT: Final = struct.Struct("<BBHII")
"""what, poll number in this step, link, channel, length."""
WRITE: Final = struct.Struct("<BBHIIII")
"""what, whole?, link, channel, offered, accepted, crc of the offered bytes."""
DONE: Final = struct.Struct("<BBqI")
"""what, ok, ticket, length of the text."""
OPENED, RECEIVED, CLOSED, WROTE, COMPLETED, SUBMITTED, TOLD, FETCHED, VERDICT, MADE = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
_LONGEST: Final = 1 << 26


@value
class Write:
    """One write as recorded."""

    channel: int
    offered: int
    accepted: int
    crc: int
    data: bytes | None = None
    """The offered bytes, for links that keep them."""


@dataclass(slots=True)
class InputStep:
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
    fetched: list[tuple[int, bool, bytes]] = field(default_factory=list)
    """What the archive of logs gave: ticket, success, body."""
    verdicts: list[bool] = field(default_factory=list)
    """What checks of signatures and tags found."""
    made: list[bytes] = field(default_factory=list)
    """Signatures, tags and random numbers."""


_SEEDS: Final = tuple(zlib.crc32(bytes((kind,))) for kind in range(RECORD_STEP + 1))


def pack_record(kind: int, body: bytes) -> bytes:
    """Frame one record."""
    return b"%b%b%b" % (HEAD.pack(len(body), kind), body, CRC.pack(zlib.crc32(body, _SEEDS[kind])))


class InputsError(ValueError):
    """A recording that cannot be read at all."""


class InputReader:
    """Reads ``inputs.bin``: ``meta`` and ``store`` at once, the steps one after the other.

    ``cut`` tells, after the last step, whether the file ended inside a record or in a damaged one (a power cut).
    """

    def __init__(self, path: Path) -> None:
        self._file: BinaryIO = path.open("rb")
        self.cut = False
        self.damaged = False
        """A record is not what it was: a bit has flipped, which no loss of power does."""
        try:
            if self._file.read(len(MAGIC)) != MAGIC:
                raise InputsError("not a recording of inputs, or one of another version")
            self.meta: dict[str, Any] = self._json(RECORD_META)
            self.store: dict[str, Any] = self._json(RECORD_STORE)
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
        head = self._file.read(HEAD.size)
        if len(head) < HEAD.size:
            self.cut = self.cut or bool(head)
            return None
        length, kind = HEAD.unpack(head)
        if length > _LONGEST:
            self.cut = self.damaged = True
            return None
        body = self._file.read(length)
        tail = self._file.read(CRC.size)
        if len(body) < length or len(tail) < CRC.size:
            self.cut = True
            return None
        if CRC.unpack(tail)[0] != zlib.crc32(body, zlib.crc32(head[4:])):
            self.cut = True
            self.damaged = any(head)  # zeros are what a disk without power gives for bytes that it was promised
            return None
        return kind, body

    @property
    def at(self) -> int:
        """How many bytes of the file are read."""
        return self._file.tell()

    def steps(self) -> Iterator[InputStep]:
        """Yield the steps up to the end or the cut."""
        expected = 0
        while (record := self._record()) is not None:
            if record[0] != RECORD_STEP:
                continue
            try:
                step = unpack_step(record[1])
            except (struct.error, LookupError, ValueError) as error:
                raise InputsError(f"step {expected} is none that this version knows ({error})") from None
            if step.number != expected:
                self.cut = True  # records are missing: what follows would not replay
                return
            expected = (expected + 1) & 0xFFFFFFFF
            yield step

    def close(self) -> None:
        self._file.close()


def unpack_step(body: bytes) -> InputStep:
    """Read the body of a step whose CRC was right."""
    kind, now_us, utc_us, load, late_s, number = STEP_HEAD.unpack_from(body)
    step = InputStep(
        kind=KINDS[kind], now_us=now_us, number=number, utc_us=None if utc_us < 0 else utc_us, load=load, late_s=late_s
    )
    at = STEP_HEAD.size
    while at < len(body):
        what = body[at]
        if what == WROTE:
            _, keep, link, channel, offered, accepted, crc = WRITE.unpack_from(body, at)
            at += WRITE.size
            data = body[at : at + offered] if keep else None
            at += offered if keep else 0
            step.writes.setdefault(link, []).append(Write(channel, offered, accepted, crc, data))
        elif what in (COMPLETED, SUBMITTED, TOLD, FETCHED, VERDICT, MADE):
            _, ok, ticket, length = DONE.unpack_from(body, at)
            at += DONE.size + length
            if what == VERDICT:
                step.verdicts.append(bool(ok))
                continue
            if what == MADE:
                step.made.append(body[at - length : at])
                continue
            if what == FETCHED:
                step.fetched.append((ticket, bool(ok), body[at - length : at]))
                continue
            text = body[at - length : at].decode()
            if what == COMPLETED:
                step.completions.append((ticket, bool(ok), text))
            elif what == SUBMITTED:
                step.submitted.append(text)
            else:
                step.told.append((ticket, text))
        else:
            _, poll, link, channel, length = EVENT.unpack_from(body, at)
            at += EVENT.size + length
            event = _event(what, channel, body[at - length : at])
            step.polls.setdefault(link, {}).setdefault(poll, []).append(event)
    return step


def _event(what: int, channel: int, data: bytes) -> LinkEvent:
    if what == RECEIVED:
        return Received(channel, data)
    return Opened(channel, data.decode()) if what == OPENED else Closed(channel, data.decode())
