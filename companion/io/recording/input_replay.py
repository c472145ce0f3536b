"""The replaying side of the inputs: links and a store that say again what they said, and compare what they are told."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mavlink_bridge.language.witness import PLACEHOLDER, Witness

from ..keeping import Completion, StoreContent, StoreOp
from ..keeping.content import from_json
from ..links import LinkEvent
from .inputs import InputReader, InputStep, Write


class ReplayWitness(Witness):
    """Says what was written down, and has no key. What was not written down is reckoned with the placeholder: a difference."""

    placeholder = PLACEHOLDER

    def __init__(self) -> None:
        self.said = 0
        """How much was taken from the recording instead of being reckoned."""
        self._verdicts: deque[bool] = deque()
        self._made: deque[bytes] = deque()

    def load(self, step: InputStep) -> None:
        self._verdicts, self._made = deque(step.verdicts), deque(step.made)

    def verdict(self, check: Callable[[], bool]) -> bool:
        self.said += 1
        return self._verdicts.popleft() if self._verdicts else check()

    def made(self, make: Callable[[], bytes]) -> bytes:
        self.said += 1
        return self._made.popleft() if self._made else make()


class ReplayStore:
    """A store that starts with the recorded content and finishes each change when the recording says so."""

    def __init__(self, reader: InputReader) -> None:
        self.warnings: tuple[str, ...] = tuple(reader.meta.get("store_warnings", ()))
        self._content = from_json(reader.store)
        self._tickets = 0
        self._done: list[Completion] = []

    def load(self, step: InputStep) -> None:
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
        self._step: InputStep | None = None
        self._polls: dict[int, list[LinkEvent]] = {}
        self._poll_number = 0
        self._writes: list[Write] = []
        self._write_number = 0

    def load(self, step: InputStep, index: int) -> None:
        """Take over what the recording has for this link in ``step``."""
        self._step = step
        self._polls = step.polls.get(index, {})
        self._poll_number = 0
        self._writes = step.writes.get(index, [])
        self._write_number = 0

    def finish(self) -> None:
        """End the step: writes that did not happen again are differences."""
        if self._write_number < len(self._writes):
            for missing in self._writes[self._write_number :]:
                self._report(_describe(missing), "nothing written")
        self._writes = []

    def poll(self, now_us: int) -> list[LinkEvent]:
        number = self._poll_number
        self._poll_number = number + 1
        return list(self._polls.get(min(number, 255), ())) if self._polls else []

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
        self._differs(Difference(step=number, now_us=now_us, link=self.name, before=before, after=after, data=data))

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

    def load(self, step: InputStep) -> None:
        for index, link in enumerate(self.links):
            link.load(step, index)

    def finish(self) -> None:
        for link in self.links:
            link.finish()
