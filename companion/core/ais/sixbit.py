"""The six-bit layer of AIS: armoured characters to one whole number, and fields out of it (IEC 61162-1 VDM, ITU-R M.1371 table 47).

A payload is a Python integer with its length in bits: a field is one shift and one mask, whatever its place.
"""

from __future__ import annotations

from typing import Final

_LEGAL: Final = {
    char: index for index, char in enumerate("0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVW`abcdefghijklmnopqrstuvw")
}
"""Armour: 0x30-0x57 carry 0-39, 0x60-0x77 carry 40-63; no other character is legal."""
_TEXT: Final = "@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_ !\"#$%&'()*+,-./0123456789:;<=>?"
"""Six-bit ASCII, in the order of its codes."""
_MASK6: Final = 0x3F
"""Six bits."""


class Bits:
    """A payload: ``size`` bits, the first sent is the highest."""

    __slots__ = ("size", "word")

    def __init__(self, word: int, size: int) -> None:
        self.word = word
        self.size = size

    def unsigned(self, start: int, width: int) -> int:
        """The field of ``width`` bits that begins at bit ``start``; what lies beyond the end is 0."""
        shift = self.size - start - width
        if shift >= 0:
            return self.word >> shift & (1 << width) - 1
        return self.word << -shift & (1 << width) - 1

    def signed(self, start: int, width: int) -> int:
        """The same as two's complement."""
        raw = self.unsigned(start, width)
        return raw - (1 << width) if raw >> width - 1 else raw

    def flag(self, start: int) -> bool:
        return bool(self.unsigned(start, 1))

    def text(self, start: int, width: int) -> str:
        """Six-bit ASCII up to the first ``@``, without blanks at its end."""
        count = max(0, min(width, self.size - start)) // 6
        word = self.unsigned(start, count * 6)
        letters = [_TEXT[word >> 6 * place & _MASK6] for place in range(count - 1, -1, -1)]
        return "".join(letters).partition("@")[0].rstrip()


def unarmour(payload: str, fill: int) -> Bits | None:
    """Return the bits of one sentence's payload without its ``fill`` bits; None with an illegal character or nothing in it."""
    word = 0
    for char in payload:
        code = _LEGAL.get(char)
        if code is None:
            return None
        word = word << 6 | code
    size = 6 * len(payload) - fill
    return Bits(word >> fill, size) if size > 0 else None


def joined(parts: list[Bits]) -> Bits:
    """Return the parts of one message in a row."""
    word = size = 0
    for part in parts:
        word = word << part.size | part.word
        size += part.size
    return Bits(word, size)
