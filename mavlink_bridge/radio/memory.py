"""What one end of the link keeps over a restart: the answers it gave and to whom, and the airtime spent; as one line of text.

Nothing of it is needed to be safe: what an end believes, it proves anew at each start (``session``). The first release
kept counters here; of its text only the hour of airtime is taken over.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, Final

from .air import Ledger
from .air.ledger import HOUR_US
from .codec.wire import VERSION
from .transfer import Inbox

_FORM: Final = "v"


def write(other: bytes | None, inbox: Inbox, ledger: Ledger, now_us: int) -> str:
    """Make a text of the answers given to the end with nonce ``other``, and of the hour of a ledger that does not keep itself."""
    fields = {
        _FORM: VERSION,
        "other": "" if other is None else other.hex(),
        "known": inbox.save(),
        "air": [] if isinstance(ledger, KeptLedger) else ledger.save(now_us),
    }
    return json.dumps(fields, separators=(",", ":"))


def read(text: str, inbox: Inbox, ledger: Ledger, now_us: int) -> bytes | None:
    """Fill inbox and ledger from a text; return whom the answers were given to. None for an empty one, and the text of
    another version: of that only the hour is kept.

    A damaged text counts as an hour's airtime spent, unless the ledger keeps itself.
    """
    if not text:
        return None
    try:
        fields: dict[str, Any] = json.loads(text)
        if not isinstance(ledger, KeptLedger):
            ledger.restore([(int(age_s), int(spent_us)) for age_s, spent_us in fields["air"]], now_us)
        if fields.get(_FORM) != VERSION:
            return None
        inbox.restore(fields["known"], now_us)
        return bytes.fromhex(fields["other"])
    except (ValueError, TypeError, KeyError, AttributeError):
        if not isinstance(ledger, KeptLedger):
            ledger.charge(ledger.limit_us or HOUR_US, now_us)
        return None


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

    def __init__(
        self, limit_us: int | None, memory: str, keep: Callable[[str], None], now_us: int = 0, *, stop_us: int = 0
    ) -> None:
        super().__init__(limit_us, stop_us)
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
