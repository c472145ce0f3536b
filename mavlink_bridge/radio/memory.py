"""What one end of the link keeps over a restart: the answers it gave and to whom, and the airtime spent; as one line of text.

Nothing of it is needed to be safe: what an end believes, it proves anew at each start (``session``). The first release
kept counters here; of its text only the hour of airtime is taken over.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, Final

from .air import Ledger
from .air.ledger import HOUR_US
from .codec.wire import VERSION
from .transfer import Inbox

_FORM: Final = "v"
_STARTS: Final = 3
"""Two gateways and the start before of one of them: a session has two places."""


class Inboxes:
    """What came from each start of the other end that was heard lately: two gateways speak by turns, and each repeats its own orders."""

    def __init__(self, given_up_us: int, order_us: int) -> None:
        """As of an ``Inbox``."""
        self._times = given_up_us, order_us
        self._all: OrderedDict[bytes, Inbox] = OrderedDict()
        self.other = b""
        """Nonce of the one that speaks now."""
        self.current = Inbox(*self._times)

    def turn_to(self, other: bytes) -> bool:
        """This start speaks now. Returns whether it was not known."""
        is_new = other not in self._all
        self.other, self.current = other, Inbox(*self._times) if is_new else self._all.pop(other)
        self._all[other] = self.current
        while len(self._all) > _STARTS:
            self._all.popitem(last=False)
        return is_new

    def of(self, other: bytes) -> Inbox | None:
        """That of one start; None where it is too long ago."""
        return self.current if other == self.other else self._all.get(other)

    def save(self) -> list[list[Any]]:
        """Each start with what was answered, the newest last."""
        return [[other.hex(), inbox.save()] for other, inbox in self._all.items()]

    def restore(self, saved: list[list[Any]], now_us: int) -> None:
        """Raises ValueError or TypeError for what ``save`` did not make."""
        for other, known in saved:
            self.turn_to(bytes.fromhex(other))
            self.current.restore(known, now_us)


def write(inboxes: Inboxes, ledger: Ledger, now_us: int) -> str:
    """Make a text of the answers given to each start of the other end, and of the hour of a ledger that does not keep itself."""
    fields = {
        _FORM: VERSION,
        "starts": inboxes.save(),
        "air": [] if isinstance(ledger, KeptLedger) else ledger.save(now_us),
    }
    return json.dumps(fields, separators=(",", ":"))


def read(text: str, inboxes: Inboxes, ledger: Ledger, now_us: int) -> None:
    """Fill inboxes and ledger from a text, also one in which one start alone was kept; of the text of another version the ledger only.

    A damaged text counts as an hour's airtime spent, unless the ledger keeps itself.
    """
    if not text:
        return
    try:
        fields: dict[str, Any] = json.loads(text)
        if not isinstance(ledger, KeptLedger):
            ledger.restore([(int(age_s), int(spent_us)) for age_s, spent_us in fields["air"]], now_us)
        if fields.get(_FORM) != VERSION:
            return
        inboxes.restore(fields.get("starts") or [[fields["other"], fields["known"]]], now_us)
    except (ValueError, TypeError, KeyError, AttributeError):
        if not isinstance(ledger, KeptLedger):
            ledger.charge(ledger.limit_us or HOUR_US, now_us)


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
