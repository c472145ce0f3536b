"""Operator texts on the wire: STATUSTEXT, in chunks of 50 bytes when a text is longer."""

from __future__ import annotations

from typing import Any, Final

from ..wire.codec import dialect

CHUNK: Final = 50
MAX_TEXT: Final = 254 * CHUNK


class StatusText:
    """Numbers the long texts of one link."""

    __slots__ = ("_id",)

    def __init__(self) -> None:
        self._id = 0

    def messages(self, severity: int, text: str) -> list[Any]:
        """Return the STATUSTEXT messages of one text. A long text gets a number from 1 to 65535 and its chunks count from 0.

        The last chunk has a NUL in it, so a text that fills its last chunk is followed by an empty one (common.xml).
        """
        data = text.encode("utf-8", "replace")[:MAX_TEXT]
        if len(data) <= CHUNK:
            return [dialect.MAVLink_statustext_message(int(severity), data)]
        self._id = self._id % 0xFFFF + 1
        starts = range(0, len(data) + 1, CHUNK)
        return [
            dialect.MAVLink_statustext_message(int(severity), data[start : start + CHUNK], self._id, number)
            for number, start in enumerate(starts)
        ]
