"""Messages as payloads, not yet framed, so that one packing serves every link: each frames it with its own sequence number."""

from __future__ import annotations

from typing import Any, NamedTuple

from mavlink_bridge.codec import payload


class Packed(NamedTuple):
    """A message's id and payload, trailing zeros cut."""

    message_id: int
    payload: bytes


def packed(message: Any) -> Packed:
    """Pack a message. Raises struct.error for a value that its field cannot hold: a fault of the caller."""
    return Packed(message.get_msgId(), payload(message))
