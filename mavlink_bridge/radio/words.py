"""What of a text crosses the air: all of it when it fits a frame, else its beginning and the order that clears what it tells."""

from __future__ import annotations

from typing import Final

_ORDERS: Final = ("then order ", "then arm again", "order ", "arm again")
"""Where the words begin that say what an operator can do; the first of these that a text has."""
_GAP: Final = ".. "


def fitted(text: str, most_bytes: int) -> bytes:
    """The text as UTF-8 in at most so many bytes. Who reads half of it must still know how to go on."""
    data = text.encode()
    if len(data) <= most_bytes:
        return data
    at = next((place for place in map(text.find, _ORDERS) if place > 0), None)
    tail = b"" if at is None else (_GAP + text[at:]).encode()
    if len(tail) > most_bytes // 2:
        tail = tail.partition(b";")[0]
    if len(tail) >= most_bytes:
        tail = b""
    return _cut(data, most_bytes - len(tail)).rstrip(b" ,;:") + tail


def _cut(data: bytes, size: int) -> bytes:
    """The beginning, without half a character at its end."""
    return data[:size].decode("utf-8", "ignore").encode()
