"""The vehicle's texts as a log book: told when they come, and given again to a console that asks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.imc import Asker, LogBookCommand, LogBookControl, LogBookEntry, LogBookType, Message, Outgoing

KEPT: Final = 300
"""Entries; a voyage has some dozens."""
ANSWERED: Final = 100
"""Of the newest in one answer: 100 texts of 100 bytes are 13 kB, a datagram that every network takes in pieces."""
LABEL: Final = "Log Book"
_TYPES: Final = {
    0: LogBookType.CRITICAL,
    1: LogBookType.CRITICAL,
    2: LogBookType.CRITICAL,
    3: LogBookType.ERROR,
    4: LogBookType.WARNING,
    5: LogBookType.INFO,
    6: LogBookType.INFO,
    7: LogBookType.DEBUG,
}
"""By MAV_SEVERITY."""
_ERRORS: Final = frozenset((LogBookType.ERROR, LogBookType.CRITICAL))


class LogBook:
    """A part of the system. Nobody can wipe it: CLEAR is passed over, as IMC proves nothing of who asks."""

    def __init__(self, utc_s: Callable[[int], float]) -> None:
        self._utc_s = utc_s
        self._entries: deque[LogBookEntry] = deque(maxlen=KEPT)
        self._out: list[Outgoing] = []

    def note(self, severity: int, context: str, text: str, now_us: int) -> None:
        """Write a line and tell it to every console. ``severity``: MAV_SEVERITY, 0...7."""
        kind = _TYPES.get(severity, LogBookType.INFO)
        entry = LogBookEntry(kind, self._utc_s(now_us), context, text[:400])
        self._entries.append(entry)
        self._out.append(Outgoing(entry, label=LABEL))
        del self._out[:-KEPT]

    def receive(self, message: Message, asker: Asker, now_us: int) -> bool:
        if not isinstance(message, LogBookControl):
            return False
        if message.command in (LogBookCommand.GET, LogBookCommand.GET_ERR):
            only_errors = message.command == LogBookCommand.GET_ERR
            newer = [
                entry
                for entry in self._entries
                if entry.htime_s > message.htime_s and (entry.type in _ERRORS or not only_errors)
            ]
            reply = LogBookControl(LogBookCommand.REPLY, self._utc_s(now_us), tuple(newer[-ANSWERED:]))
            self._out.append(Outgoing(reply, asker, LABEL))
        return True

    def heard(self, asker: Asker, now_us: int) -> None: ...

    def met(self, asker: Asker, now_us: int) -> None: ...

    def take(self, now_us: int) -> list[Outgoing]:
        out, self._out = self._out, []
        return out

    def entities(self) -> Sequence[str]:
        return (LABEL,)
