"""STATUSTEXT put together again, and which of the vehicle's words are the reason of a refusal."""

from __future__ import annotations

from collections import deque
from typing import Any, Final

from ..telemetry.statustext import CHUNK

_KEPT: Final = 64
_TELLING: Final = 4
"""MAV_SEVERITY_WARNING: a refusal is told at least so loudly."""
_REASONS: Final = 2
_LONGEST: Final = 254 * CHUNK


class Texts:
    """The newest texts of one vehicle."""

    def __init__(self) -> None:
        self.count = 0
        """Texts heard so far."""
        self._kept: deque[tuple[int, int, str]] = deque(maxlen=_KEPT)
        self._new: deque[tuple[int, str]] = deque(maxlen=_KEPT)
        self._chunks: list[str] = []
        self._number = 0

    def hear(self, message: Any) -> None:
        """Take a STATUSTEXT; a chunk that is not full ends its text."""
        if message.id != self._number:
            self._chunks, self._number = [], message.id
        self._chunks.append(message.text)
        if message.id and len(message.text.encode()) >= CHUNK and len(self._chunks) * CHUNK < _LONGEST:
            return
        text, self._chunks, self._number = "".join(self._chunks), [], 0
        if text:
            self.count += 1
            self._kept.append((self.count, message.severity, text))
            self._new.append((message.severity, text))

    def drain_texts(self) -> list[tuple[int, str]]:
        """(MAV_SEVERITY, text) since the last call, oldest first."""
        texts = list(self._new)
        self._new.clear()
        return texts

    def reasons(self, since: int) -> str:
        """What the vehicle complained of after its text number ``since``."""
        said = [text for number, severity, text in self._kept if number > since and severity <= _TELLING]
        return "; ".join(dict.fromkeys(said[-_REASONS:]))
