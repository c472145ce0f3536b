"""The first release's radio format, as far as its ends must be told that it is no longer spoken.

Such an end is recognised by its HELLO (its tag under the same radio key; an old recording shows the same and does no more
than say so), and told by a HELLO and a text in its own format. Nothing else of it is read or written.
"""

from __future__ import annotations

import json
from hashlib import blake2s
from typing import Final

from ...language.messages import Severity
from ...language.witness import Witness
from ..session import RadioDirection, check_key
from .wire import SEVERITY

_HELLO_BYTES: Final = 12
_FIRST: Final = 0x01
"""Kind 0 and the upper bits of a body of six bytes."""
_TAG_BYTES: Final = 4
_TEXT: Final = 14
_WINDOW: Final = 64
_RESERVE: Final = 256
"""More than the window in which the other end looks for the next one."""
TELL: Final = "vessel has radio format 2: update this gateway"
HEARD: Final = "Radio: the other end speaks the first release's format and is not believed; update it"
GAP_US: Final = 600_000_000
"""Between two tellings: an old recording must not buy airtime."""


def _tag(key: bytes, direction: RadioDirection, counter: int, covered: bytes) -> bytes:
    data = bytes((direction,)) + counter.to_bytes(8, "big") + covered
    return blake2s(data, digest_size=_TAG_BYTES, key=key, person=b"usvradio").digest()


def counter_in(memory: str) -> int | None:
    """The counter to go on from, out of a text that the first release, or an ``OldVoice`` since, has kept; None = not known."""
    try:
        fields = json.loads(memory)
        counter = fields["tx"] + _RESERVE if "tx" in fields else fields["old"]
        return int(counter)
    except (ValueError, TypeError, KeyError):
        return None


def with_counter(memory: str, voice: OldVoice | None) -> str:
    """A text to keep, with the counter in it."""
    return memory if voice is None else f'{memory[:-1]},"old":{voice.counter}}}'


class OldEar:
    """Counts HELLOs of the first release in a byte stream. Holds less than one of them between calls."""

    def __init__(self, key: bytes, inward: RadioDirection, witness: Witness | None = None) -> None:
        self._key = check_key(key)
        self._inward = inward
        self._witness = witness or Witness()
        self._buffer = b""
        self.hellos = 0

    def receive(self, data: bytes) -> None:
        """Take bytes as read. Never raises."""
        buffer = self._buffer + data
        at = buffer.find(_FIRST)
        while 0 <= at <= len(buffer) - _HELLO_BYTES:
            self.hellos += self._is_hello(buffer[at : at + _HELLO_BYTES])
            at = buffer.find(_FIRST, at + 1)
        self._buffer = buffer[max(len(buffer) - _HELLO_BYTES + 1, 0) :]

    def _is_hello(self, raw: bytes) -> bool:
        counter = int.from_bytes(raw[2:7], "big")
        if raw[1] != 0x80 | counter % _WINDOW:
            return False
        covered, tag = raw[:-_TAG_BYTES], raw[-_TAG_BYTES:]
        return self._witness.verdict(lambda: _tag(self._key, self._inward, counter, covered) == tag)


class OldVoice:
    """Says one text to an end of the first release. ``counter``: above every one that it has heard from here."""

    def __init__(self, key: bytes, outward: RadioDirection, counter: int, witness: Witness | None = None) -> None:
        self._key = check_key(key)
        self._outward = outward
        self._witness = witness or Witness()
        self.counter = counter

    def say(self, severity: Severity, text: str) -> tuple[bytes, bytes]:
        """Return the two frames: HELLO, which tells the counter, and the text, at most 50 bytes of it."""
        hello = (self.counter + 1).to_bytes(5, "big") + b"\0"
        return self._seal(0, hello), self._seal(_TEXT, bytes((SEVERITY.number(severity),)) + text.encode()[:50])

    def _seal(self, kind: int, body: bytes) -> bytes:
        self.counter += 1
        head = kind << 12 | len(body) << 6 | self.counter % _WINDOW
        covered = head.to_bytes(2, "big") + body
        return covered + self._witness.made(lambda: _tag(self._key, self._outward, self.counter, covered))
