"""Serves the status socket from the vessel's own thread: a picture to every watcher four times a second, and orders that stop.

Newest value wins: a watcher that does not read gets the rest of one message and then the picture of that moment. Nothing here waits,
and without watchers a tick pays one look for newcomers.
"""

from __future__ import annotations

import json
import logging
from collections import deque
from collections.abc import Callable
from typing import Any, Final, Protocol

from mavlink_bridge.language.messages import LogText, Severity
from mavlink_bridge.language.requests import ACCEPTED, Reply, RequestBody, Result
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.stations import Station

from ..io.local_socket import LocalPeer, LocalServer
from .orders import Challenges, HeardOrder, PageOrder, RefusedOrder, body_of
from .picture import dumps, picture_of

PROTOCOL: Final = 1
PERIOD_US: Final = 250_000
TEXTS_KEPT: Final = 20
REPLIES_KEPT: Final = 64
"""Answers that wait for one watcher; more are the fault of who asks so fast, and the oldest go. The page, one watcher for all who look
at it, has no more questions under way."""
_STUCK_US: Final = 30_000_000
"""A watcher that takes nothing for so long is let go: it is stopped, and its place is another's."""
_TELL_AGAIN_US: Final = 60_000_000
PAGE_LINK: Final = "page"
"""The link that events name for an order of the page."""
_HOST_MAX: Final = 45
"""Characters of the longest address."""

log = logging.getLogger(__name__)


class Owner(Protocol):
    """The app, as far as a watcher concerns it."""

    def submit(
        self, body: RequestBody, answer: Callable[[Reply], None] = ..., *, station: Station | None = ...
    ) -> None: ...


class _Watcher:
    """One who watches, with what waits for it."""

    def __init__(self, peer: LocalPeer, now_us: int) -> None:
        self.peer = peer
        self.replies: deque[bytes] = deque(maxlen=REPLIES_KEPT)
        self.moved_us = now_us
        self.shown = -1


class StatusService:
    """A view that serves a socket. ``drawing_fn`` gives plan and fence for the map; ``airtime_fn`` what the radio's hour holds.

    ``speed``: how many simulated seconds pass in a real one; watchers live in real time.
    """

    def __init__(
        self,
        server: LocalServer,
        owner: Owner,
        challenges: Challenges,
        *,
        name: str = "",
        drawing_fn: Callable[[], Any] = lambda: {},
        airtime_fn: Callable[[int], str] = lambda now_us: "",
        say: Callable[[Severity, str], None] = lambda severity, text: None,
        speed: float = 1.0,
    ) -> None:
        self._server = server
        self._owner = owner
        self._challenges = challenges
        self._drawing, self._airtime, self._say = drawing_fn, airtime_fn, say
        self._speed = max(speed, 1.0)
        self._texts: deque[LogText] = deque(maxlen=TEXTS_KEPT)
        self._watchers: dict[LocalPeer, _Watcher] = {}
        self._due_us = 0
        self._count = 0
        self._utc_s: float | None = None
        self._t_s = 0.0
        self._told_us: int | None = None
        hello = {"protocol": PROTOCOL, "name": name, "vessel": challenges.vessel, "orders": challenges.key is not None}
        self._hello = _line({"hello": hello})

    def update(self, snapshot: Snapshot) -> None:
        """Take one tick's picture, and serve who is there."""
        if snapshot.texts:
            self._texts.extend(snapshot.texts)
        now_us = snapshot.t_us
        peers = self._server.look()
        if not peers and not self._watchers:
            return
        self._t_s = round(now_us * 1e-6, 2)
        self._utc_s = None if snapshot.utc_us is None else snapshot.utc_us * 1e-6
        self._meet(peers, now_us)
        for watcher in self._watchers.values():
            for line in watcher.peer.lines():
                self._hear(watcher, line, now_us)
        if now_us >= self._due_us:
            self._due_us = now_us + round(PERIOD_US * self._speed)
            self._count += 1
        self._show(snapshot, now_us)

    def close(self) -> None:
        """Let everybody go."""
        self._server.close()
        self._watchers.clear()

    def _meet(self, peers: list[LocalPeer], now_us: int) -> None:
        for peer in peers:
            if peer not in self._watchers and not peer.is_gone:
                watcher = self._watchers[peer] = _Watcher(peer, now_us)
                watcher.replies.append(self._hello)
        for peer in [peer for peer in self._watchers if peer.is_gone]:
            del self._watchers[peer]

    def _show(self, snapshot: Snapshot, now_us: int) -> None:
        """Send what waits, then the newest picture to whoever has not seen it."""
        data: bytes | None = None
        for watcher in self._watchers.values():
            if not watcher.peer.is_free:
                if now_us - watcher.moved_us > _STUCK_US * self._speed:
                    watcher.peer.close()
                continue
            watcher.moved_us = now_us
            while watcher.replies and watcher.peer.send(watcher.replies[0]):
                watcher.replies.popleft()
            if watcher.replies or watcher.shown == self._count:
                continue
            if data is None:
                picture = picture_of(snapshot, tuple(self._texts), self._airtime(now_us))
                data = f'{{"picture":{dumps(picture)}}}\n'.encode()
            if watcher.peer.send(data):
                watcher.shown = self._count

    # ---- what watchers ask

    def _hear(self, watcher: _Watcher, line: bytes, now_us: int) -> None:
        try:
            asked = json.loads(line)
        except (ValueError, RecursionError):
            asked = None
        if not isinstance(asked, dict):
            watcher.peer.close()
            return
        number = asked.get("id")
        if not isinstance(number, int):
            number = 0
        match asked.get("ask"):
            case "drawing":
                watcher.replies.append(_line({"id": number, "drawing": self._drawing()}))
            case "challenge":
                challenge = {"nonce": self._challenges.challenge(now_us), "vessel": self._challenges.vessel}
                watcher.replies.append(_line({"id": number, "challenge": {**challenge, "t_s": self._t_s}}))
            case "order":
                self._order(watcher, number, asked, now_us)
            case _:
                watcher.replies.append(_line({"id": number, "refused": "not understood"}))

    def _order(self, watcher: _Watcher, number: int, asked: dict[str, Any], now_us: int) -> None:
        words = [asked.get(name) for name in ("order", "nonce", "response", "host", "page")]
        order, nonce, response, host, page = (
            each if isinstance(each, str) and each.isascii() else "" for each in words
        )
        judged = self._challenges.judge(order, nonce, response, now_us, page=page)
        if isinstance(judged, RefusedOrder):
            self._wrong(judged, host[:_HOST_MAX], now_us)
            watcher.replies.append(_line({"id": number, "refused": judged.why}))
            return

        def say(answer: dict[str, Any]) -> None:
            watcher.replies.append(_line({"id": number, "answer": answer}))

        if isinstance(judged, HeardOrder):
            judged.tell(say)
            return
        self._carry_out(judged, nonce, host[:_HOST_MAX], say)

    def _carry_out(self, order: PageOrder, nonce: str, host: str, say: Callable[[dict[str, Any]], None]) -> None:
        """Ask it of the vessel; the answer says what the vessel has done, with a tag that nobody without the key can make."""

        def answer(reply: Reply) -> None:
            outcome = reply.reason or "obeyed" if reply.result is Result.ACCEPTED else f"refused: {reply.reason}"
            say(self._challenges.answered(nonce, outcome, t_s=self._t_s, utc_s=self._utc_s))

        body = body_of(order)
        if body is None:
            answer(ACCEPTED)
        else:
            self._owner.submit(body, answer, station=Station(0, 0, PAGE_LINK, host, bystander=True))

    def _wrong(self, refused: RefusedOrder, host: str, now_us: int) -> None:
        """Somebody tries keys: told once a minute, however many times."""
        if refused.why != "wrong key" or (self._told_us is not None and now_us - self._told_us < _TELL_AGAIN_US):
            return
        self._told_us = now_us
        self._say(Severity.WARNING, f"Page: an order with a wrong key from {host or 'an unknown address'}")


def _line(data: dict[str, Any]) -> bytes:
    return json.dumps(data, separators=(",", ":"), ensure_ascii=False).encode() + b"\n"


__all__ = ["PAGE_LINK", "PROTOCOL", "PageOrder", "StatusService"]
