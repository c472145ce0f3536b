"""From VDM and VDO sentences to whole payloads: fields, parts, and what makes a set of parts one message.

A message of several sentences is put together only from parts of one set (address, count, sequence number, channel) in rising
order and within two seconds: sequence numbers come round within seconds in busy water, and two ships in one message are worse
than none. What does not fit is counted and dropped; at most 16 sets are open.
"""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.value import value

from .sixbit import Bits, joined, unarmour

SET_LIFE_US: Final = 2_000_000
"""Parts are sent back to back; a rest that comes later belongs to another message."""
SETS_MAX: Final = 16
"""Ten sequence numbers on two channels, and no more than sixteen of them ever open at once on the air's 2250 slots a minute."""
_FIELDS: Final = 7
"""Address, count, number, sequence, channel, payload, fill. Some receivers add one more; it is left alone."""
_CHANNELS: Final = frozenset(("", "A", "B", "1", "2"))

_Key = tuple[str, str, str, str]


@value
class Payload:
    """One message's bits."""

    own: bool
    """A VDO sentence: the receiver's own ship."""
    bits: Bits


class _Set:
    """A message that is not whole yet."""

    __slots__ = ("parts", "since_us")

    def __init__(self, first: Bits, now_us: int) -> None:
        self.parts = [first]
        self.since_us = now_us


def is_ais(address: str) -> bool:
    """Whether an address field is an AIS sentence's: two letters of any talker, then VDM or VDO."""
    return len(address) == 5 and address[2:] in ("VDM", "VDO")


class Assembler:
    """Collects parts. ``receive`` never raises; memory is bounded."""

    def __init__(self) -> None:
        self._sets: dict[_Key, _Set] = {}
        self.malformed = 0
        """Sentences with impossible fields or characters."""
        self.broken_sets = 0
        """Sets dropped: too late, out of order, pushed out or begun anew."""

    @property
    def open_sets(self) -> int:
        """Messages that wait for a part."""
        return len(self._sets)

    def receive(self, fields: list[str], now_us: int) -> Payload | None:
        """Take one sentence's fields, its address first; return the message that it completes."""
        self._expire(now_us)
        head = _head(fields)
        bits = None if head is None else unarmour(fields[5], head[2])
        if head is None or bits is None:
            self.malformed += 1
            return None
        count, number, _ = head
        own = fields[0].endswith("VDO")
        if count == 1:
            return Payload(own, bits)
        whole = self._add((fields[0], fields[1], fields[3], fields[4]), number, bits, now_us)
        return None if whole is None or len(whole) < count else Payload(own, joined(self._close(fields)))

    def _close(self, fields: list[str]) -> list[Bits]:
        return self._sets.pop((fields[0], fields[1], fields[3], fields[4])).parts

    def _add(self, key: _Key, number: int, bits: Bits, now_us: int) -> list[Bits] | None:
        """Put a part in its set; None when it has no place."""
        begun = self._sets.get(key)
        if number == 1:
            if begun is not None:
                del self._sets[key]
                self.broken_sets += 1
            self._make_room()
            begun = self._sets[key] = _Set(bits, now_us)
            return begun.parts
        if begun is None or number != len(begun.parts) + 1:
            self.broken_sets += 1
            self._sets.pop(key, None)
            return None
        begun.parts.append(bits)
        return begun.parts

    def _make_room(self) -> None:
        if len(self._sets) >= SETS_MAX:
            del self._sets[next(iter(self._sets))]  # the oldest
            self.broken_sets += 1

    def _expire(self, now_us: int) -> None:
        while self._sets:
            key, oldest = next(iter(self._sets.items()))
            if now_us - oldest.since_us <= SET_LIFE_US:
                return
            del self._sets[key]
            self.broken_sets += 1


def _head(fields: list[str]) -> tuple[int, int, int] | None:
    """Count, number and fill bits; None when one of them cannot be."""
    if len(fields) < _FIELDS:
        return None
    count, number, sequence, channel, fill = fields[1], fields[2], fields[3], fields[4], fields[6]
    if not (_digit(count, "123456789") and _digit(number, "123456789") and _digit(fill, "012345")):
        return None
    if not (sequence == "" or _digit(sequence, "0123456789")) or channel not in _CHANNELS:
        return None
    return (int(count), int(number), int(fill)) if number <= count else None


def _digit(text: str, allowed: str) -> bool:
    return len(text) == 1 and text in allowed
