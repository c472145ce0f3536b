"""What the stations of one endpoint ask of the vessel until its next tick: orders in their order, streams by their newest."""

from __future__ import annotations

from typing import Any, Final

from ...language.requests import DistanceInput, Origin, Reply, Request, RequestBody, Result, RtcmData
from ...language.stations import Proof
from ..wire.signing import FrameVerdict

MAX_ORDERS: Final = 256
MAX_PIECES: Final = 32
"""Corrections and soundings: each counts by itself, but none is worth much."""
FULL: Final = Reply(Result.REJECTED_NOW, "too many orders at once: send it again")


def is_stream(number: int) -> bool:
    """Whether a request belongs to a stream: those have numbers below 0."""
    return number < 0


class Asking:
    """Bounded. ``asked`` is one list for good: others look at it."""

    def __init__(self) -> None:
        self.asked: list[Request] = []
        self._system = self._component = 0
        self._proof = Proof.UNSIGNED
        self._next_id = 1
        self._orders = 0

    def serve(self, message: Any) -> None:
        """A message is being served: what is asked next is asked by its sender."""
        self._system, self._component = message.get_srcSystem(), message.get_srcComponent()
        self._proof = Proof.SIGNED if message.verdict is FrameVerdict.ACCEPTED else Proof.UNSIGNED

    def number(self) -> int:
        """A number for the next request."""
        number = self._next_id
        self._next_id += 1
        return number

    def order(self, number: int, body: RequestBody, sender: int, origin: Origin | None = None) -> bool:
        """Queue what somebody waits for; False when there is no room."""
        if self._orders >= MAX_ORDERS:
            return False
        self._orders += 1
        self.asked.append(
            Request(
                number,
                body,
                sender or self._system,
                origin=origin,
                component=self._component,
                proof=self._proof,
            )
        )
        return True

    def stream(self, body: RequestBody, sender: int) -> None:
        """Queue a set-point, sticks or data. A stalled link hands over seconds of them at once: only the newest counts."""
        if isinstance(body, RtcmData | DistanceInput):
            if sum(type(item.body) is type(body) for item in self.asked) >= MAX_PIECES:
                return
        else:
            for at, item in enumerate(self.asked):
                same = (item.sender, item.component, type(item.body)) == (sender, self._component, type(body))
                if same and not item.reply:
                    del self.asked[at]
                    break
        self.asked.append(
            Request(-self.number(), body, sender, reply=False, component=self._component, proof=self._proof)
        )

    def take(self) -> list[Request]:
        """Take over all, oldest first."""
        requests = self.asked.copy()
        self.asked.clear()
        self._orders = 0
        return requests
