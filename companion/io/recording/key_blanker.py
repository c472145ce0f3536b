"""Takes new signing keys out of what is recorded: SETUP_SIGNING (256) carries one in clear, and recordings are shared.

The key's bytes are replaced wherever they lie in a stream of reads, and the checksum is made right again when it was right, so that
a replay sees the message and takes up a key that guards nothing. Source: common.xml, SETUP_SIGNING: initial_timestamp,
target_system, target_component, secret_key[32], in this order on the wire.
"""

from __future__ import annotations

import re
from typing import Final

from mavlink_bridge.mavlink.wire.framing import checksum

from ..links import Closed, LinkEvent, Received

SETUP_SIGNING: Final = 256
BLANK: Final = 0xBB
"""Not zero: a key of zeros is refused, and would be by a replay."""
_BEGINNING: Final = re.compile(rb"(?=\xfd.{6}\x00\x01\x00)", re.DOTALL)
"""Marker of MAVLink 2 to message id. MAVLink 1 has no number for this message."""
_PAYLOAD_AT: Final = 10
_KEY_AT: Final = _PAYLOAD_AT + 10
_KEY_BYTES: Final = 32
_LONGEST: Final = _PAYLOAD_AT + 255 + 2
"""From marker to checksum."""


class KeyBlanker:
    """One stream of bytes. ``receive`` returns as many bytes as it takes."""

    def __init__(self) -> None:
        self._before = self._shown = b""
        """The end of what came, and of what was returned."""

    def receive(self, data: bytes) -> bytes:
        """Return ``data`` without key bytes, those of a message that began earlier included."""
        came = self._before + data
        if _BEGINNING.search(came) is None:
            self._keep(came, self._shown + data)
            return data
        shown = bytearray(self._shown + data)
        for found in _BEGINNING.finditer(came):
            _blank(came, shown, found.start())
        self._keep(came, bytes(shown))
        return bytes(shown[len(came) - len(data) :])

    def _keep(self, came: bytes, shown: bytes) -> None:
        self._before, self._shown = came[-_LONGEST:], shown[-_LONGEST:]


def _blank(came: bytes, shown: bytearray, at: int) -> None:
    """Blank the key of the message that begins at a place; its checksum is made anew byte by byte, where it was right."""
    end = at + _PAYLOAD_AT + came[at + 1]
    for place in range(at + _KEY_AT, min(at + _KEY_AT + _KEY_BYTES, end, len(came))):
        shown[place] = BLANK if came[place] else 0
    if end >= len(came):
        return
    was = checksum(came[at + 1 : end], SETUP_SIGNING).to_bytes(2, "little")
    now = checksum(bytes(shown[at + 1 : end]), SETUP_SIGNING).to_bytes(2, "little")
    for place in range(end, min(end + 2, len(came))):
        if came[place] == was[place - end]:
            shown[place] = now[place - end]


def blank_frame(raw: bytes) -> bytes:
    """One whole frame without its key."""
    return KeyBlanker().receive(raw)


class EventBlanker:
    """The same for the events of a link. Each channel is a stream, datagrams too: an endpoint puts frames together across them."""

    def __init__(self) -> None:
        self._streams: dict[int, KeyBlanker] = {}

    def blank(self, events: list[LinkEvent]) -> list[LinkEvent]:
        """Return the events as they may be recorded."""
        kept = events
        for number, event in enumerate(events):
            if isinstance(event, Closed):
                self._streams.pop(event.channel, None)
            elif isinstance(event, Received):
                shown = self._streams.setdefault(event.channel, KeyBlanker()).receive(event.data)
                if shown != event.data:
                    kept = events.copy() if kept is events else kept
                    kept[number] = Received(event.channel, shown)
        return kept
