"""What one end of the link must know after a restart: counters, answers given, airtime spent; as one line of text."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.lora.ledger import Ledger
from mavlink_bridge.lora.transfer import Inbox

CEILING: Final = 1024
"""Counters are reserved so many at a time, so that not each frame needs a write."""
RESTART_GAP: Final = 256
"""More than the window of the receiver's counter, so that nothing of before is mistaken for something of now."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Counters and sessions."""

    tx: int
    """Above every counter ever used for sending."""
    rx: int
    next_id: int
    session: int
    other_session: int | None


def write(kept: Kept, inbox: Inbox, ledger: Ledger, now_us: int) -> str:
    fields = {
        "tx": kept.tx,
        "rx": kept.rx,
        "id": kept.next_id,
        "session": kept.session,
        "other": kept.other_session,
        "known": inbox.save(),
        "air": ledger.save(now_us),
    }
    return json.dumps(fields, separators=(",", ":"))


def read(text: str, inbox: Inbox, ledger: Ledger, now_us: int) -> Kept | None:
    """Fill inbox and ledger from a text; None for an empty one, the first start.

    A damaged text counts as an hour's airtime spent; its counters are lost, and the other end refuses us until it is given a new key.
    """
    if not text:
        return None
    try:
        fields: dict[str, Any] = json.loads(text)
        kept = Kept(int(fields["tx"]), int(fields["rx"]), int(fields["id"]), int(fields["session"]), fields["other"])
        inbox.restore(fields["known"])
        ledger.restore([(int(age_s), int(spent_us)) for age_s, spent_us in fields["air"]], now_us)
    except (ValueError, TypeError, KeyError, AttributeError):
        ledger.charge(ledger.limit_us or 0, now_us)
        return None
    return kept
