"""What every service of an endpoint is: the messages it serves, the vessel's answers it waits for, its timers, its share of a tick.

A service overrides what it needs; the rest does nothing, and the endpoint does not even call it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...language.requests import Reply
from ...language.snapshot import Snapshot

Handler = Callable[[Any, int], None]
"""Serves one message, given the time in microseconds."""


class Service:
    """One kind of dialogue. Each message has one service; each request's answer goes to the service that asked."""

    @property
    def handles(self) -> Mapping[str, Handler]:
        """Its messages by name, each with what serves it."""
        return {}

    def reply(self, request_id: int, reply: Reply, now_us: int) -> bool:
        """Take the vessel's answer to a request; True: it was asked here, and whoever asked knows all by now.

        After False a refusal is told as a text, whoever asked.
        """
        return False

    @property
    def busy(self) -> bool:
        """Whether a timer runs, so that ``poll`` is wanted."""
        return False

    def poll(self, now_us: int) -> None:
        """Serve the timers."""

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Look at the vessel after its tick, and queue what this service says by itself."""
