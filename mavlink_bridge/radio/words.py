"""Which texts cross the air, in which order, and what of each: all of it when it fits a frame, else its beginning and the order that
clears what it tells.
"""

from __future__ import annotations

from typing import Final

from ..language.messages import Severity

_ORDERS: Final = ("then order ", "then arm again", "order ", "arm again")
"""Where the words begin that say what an operator can do; the first of these that a text has."""
_GAP: Final = ".. "
_WAITING: Final = 4
"""What an operator has not been told after so many texts, 20 s, the state has told."""


def crosses(severity: Severity, text: str) -> bool:
    """Whether a text is worth its air: warnings and worse, and which order a held boat waits for when its cause is gone."""
    return severity <= Severity.WARNING or (": order " in text and text.endswith(" to go on"))


class Waiting:
    """Texts that wait for their turn: the gravest first, of equal ones the older."""

    def __init__(self) -> None:
        self._texts: list[tuple[Severity, str]] = []

    def __len__(self) -> int:
        return len(self._texts)

    def put(self, severity: Severity, text: str) -> None:
        """Take one in, unless it waits already; when there are too many the mildest goes, of equal ones the oldest."""
        if (severity, text) in self._texts:
            return
        self._texts.append((severity, text))
        if len(self._texts) > _WAITING:
            self._texts.remove(max(self._texts, key=lambda each: each[0]))

    def take(self, most_bytes: int) -> tuple[Severity, bytes]:
        """Take out the next one, in at most so many bytes. Raises ValueError when there is none."""
        found = min(self._texts, key=lambda each: each[0])
        self._texts.remove(found)
        return found[0], fitted(found[1], most_bytes)


def fitted(text: str, most_bytes: int) -> bytes:
    """The text as UTF-8 in at most so many bytes. Who reads half of it must still know how to go on."""
    data = text.encode()
    if len(data) <= most_bytes:
        return data
    at = next((place for place in map(text.find, _ORDERS) if place > 0), None)
    tail = b"" if at is None else (_GAP + text[at:]).encode()
    if len(tail) > most_bytes // 2:
        tail = tail.partition(b";")[0]
    if not tail or len(tail) >= most_bytes:
        return shortened(text, most_bytes)
    return _cut(data, most_bytes - len(tail)).rstrip(b" ,;:") + tail


def shortened(text: str, most_bytes: int) -> bytes:
    """The text's beginning as UTF-8 in at most so many bytes: to the end of a part of the sentence, or of a word, where one is near."""
    data = text.encode()
    if len(data) <= most_bytes:
        return data
    cut = _cut(data, most_bytes)
    ends = (max(cut.rfind(b";"), cut.rfind(b": "), cut.rfind(b", ")), _cut(data, most_bytes + 1).rfind(b" "))
    end = next((at for at in ends if at >= most_bytes // 2), len(cut))
    return cut[:end].rstrip(b" ,;:")


def _cut(data: bytes, size: int) -> bytes:
    """The beginning, without half a character at its end."""
    return data[:size].decode("utf-8", "ignore").encode()
