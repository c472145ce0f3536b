"""What one end of the link must know after a restart: counters, answers given, airtime spent; as one line of text."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from .air import Ledger
from .air.ledger import HOUR_US
from .transfer import Inbox

CEILING: Final = 1024
"""Counters are reserved so many at a time, so that not each frame needs a write."""
RESTART_GAP: Final = 256
"""More than the window of the receiver's counter, so that nothing of before is mistaken for something of now."""
HEARD_AHEAD: Final = 192
"""So far above the last counter heard is all refused after a start: frames heard since the last writing must not be believed
again. Less than ``RESTART_GAP``, so that an end that starts anew is above it by itself."""
HEARD_MARGIN: Final = 64
"""Written again so long before it is reached: the writing takes its time."""
_NUMBERS_GAP: Final = 41
"""Message numbers that may have been used since the last writing."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Counters and sessions."""

    tx: int
    """Above every counter ever used for sending."""
    rx: int
    """Not below any counter ever heard."""
    next_id: int
    session: int
    other_session: int | None


def write(kept: Kept, inbox: Inbox, ledger: Ledger, now_us: int, key: str) -> str:
    """Make a text of it, with the hour of a ledger that does not keep itself."""
    fields = {
        "key": key,
        "tx": kept.tx,
        "rx": kept.rx,
        "id": kept.next_id,
        "session": kept.session,
        "other": kept.other_session,
        "known": inbox.save(),
        "air": [] if isinstance(ledger, KeptLedger) else ledger.save(now_us),
    }
    return json.dumps(fields, separators=(",", ":"))


def read(text: str, inbox: Inbox, ledger: Ledger, now_us: int, key: str) -> Kept | None:
    """Fill inbox and ledger from a text; None for an empty one, the first start, as it is with a new key: of that only the hour is kept.

    A damaged text counts as an hour's airtime spent; its counters are lost, and the other end refuses us until it is given a new key.
    """
    if not text:
        return None
    try:
        fields: dict[str, Any] = json.loads(text)
        kept = Kept(
            int(fields["tx"]),
            int(fields["rx"]),
            int(fields["id"]) + _NUMBERS_GAP,
            int(fields["session"]),
            fields["other"],
        )
        if not isinstance(ledger, KeptLedger):
            ledger.restore([(int(age_s), int(spent_us)) for age_s, spent_us in fields["air"]], now_us)
        if fields.get("key", key) != key:
            return None
        inbox.restore(fields["known"])
    except (ValueError, TypeError, KeyError, AttributeError):
        ledger.charge(ledger.limit_us or HOUR_US, now_us)
        return None
    return kept


def parted(airtime: str, link: str) -> tuple[str, str]:
    """Part the hour, which all protocols share, from a compact link's text in which earlier software kept it: (hour, link).

    ``airtime``: the shared hour as kept. A damaged text makes a damaged hour, once.
    """
    if not link:
        return airtime, link
    try:
        fields = json.loads(link)
        spent, fields["air"] = fields["air"], []
        hour = json.dumps([*json.loads(airtime or "[]"), *spent]) if spent else airtime
        return hour, json.dumps(fields, separators=(",", ":"))
    except (ValueError, TypeError, KeyError):
        return "damaged", ""


class KeptLedger(Ledger):
    """A ledger that outlives a restart: ``keep`` is called with a text, ``memory`` is that text."""

    def __init__(self, limit_us: int | None, memory: str, keep: Callable[[str], None], now_us: int = 0) -> None:
        super().__init__(limit_us)
        self._keep: Callable[[str], None] | None = None
        if memory:
            self._take_over(memory, now_us)
            keep(self._text(now_us))
        self._keep = keep

    def _take_over(self, memory: str, now_us: int) -> None:
        """A damaged text counts as an hour's airtime spent."""
        try:
            self.restore([(int(age_s), int(spent_us)) for age_s, spent_us in json.loads(memory)], now_us)
        except (ValueError, TypeError):
            self.charge(self.limit_us or HOUR_US, now_us)

    def charge(self, airtime_us: int, end_us: int) -> None:
        super().charge(airtime_us, end_us)
        if self._keep is not None and self.should_be_saved:
            self._keep(self._text(end_us))

    def _text(self, now_us: int) -> str:
        return json.dumps(self.save(now_us), separators=(",", ":"))
