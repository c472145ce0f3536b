"""What an endpoint says by itself at each tick: HEARTBEAT, streams, and messages of the moment when something changes."""

from __future__ import annotations

from typing import Final

from ...language.messages import Severity
from ...language.snapshot import Snapshot
from ...language.traffic import NO_TRAFFIC
from ..persona import EndpointConfig
from ..wire.payload import Packed, packed
from .numbering import stations_text
from .outbox import Outbox
from .statustext import StatusText
from .streams import (
    CURRENT_MODE,
    FENCE_STATUS,
    HEARTBEAT,
    HIGH_LATENCY2,
    MISSION_CURRENT,
    SYS_STATUS,
    Composer,
    Digest,
    Streams,
)
from .system import mission_item_reached
from .traffic import TrafficTeller

_SLOW_LINK_SEVERITY: Final = Severity.WARNING
"""Lesser texts are not worth their air."""
_TEXT_GAP_US: Final = 1_000_000
_STREAM_TEXT_GAP_US: Final = 10_000_000
"""A stream that is refused goes on, often for as long as its program runs."""
_MAX_TEXTS_KEPT: Final = 32


class Speaker:
    """The telling half of an endpoint."""

    def __init__(self, config: EndpointConfig, outbox: Outbox, streams: Streams, composer: Composer) -> None:
        self._config = config
        self._outbox = outbox
        self._streams = streams
        self._composer = composer
        self._texts = StatusText()
        self._traffic = TrafficTeller(config, outbox)
        self._said: dict[str, int] = {}
        self._heartbeat_us = config.heartbeat_us
        self._next_heartbeat_us = 0
        self._next_summary_us: int | None = None
        self._digest: Digest | None = None
        self.snapshot: Snapshot | None = None
        self.wanted: set[int] = set()
        """Messages to send with the next snapshot whatever their rate."""
        self.is_quiet = False
        """Whether streams wait, as while a plan is loaded over a slow link."""

    def compose(self, number: int) -> Packed | None:
        return None if self.snapshot is None else self._composer.compose(number, self.snapshot, self._config)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue what is due."""
        self.snapshot = snapshot
        composer = self._composer
        if snapshot is not composer.snapshot:
            composer.turn_to(snapshot)
        changed = composer.digest is not self._digest and self._changes(composer.digest)
        if changed or now_us >= self._next_heartbeat_us:
            self._heartbeat(now_us)
        if composer.is_eventful:
            self._events(snapshot)
        if snapshot.traffic is not NO_TRAFFIC:
            self._traffic.tick(now_us, snapshot)
        if self.wanted or now_us >= self._streams.due_us:
            self._tell(now_us, snapshot)

    def _events(self, snapshot: Snapshot) -> None:
        for seq in snapshot.progress.reached:
            made = mission_item_reached(seq, self._config)
            if made is not None:
                self._outbox.answer(made)
        for log in snapshot.texts:
            self.say(log.severity, stations_text(log.text, self._config))

    def _tell(self, now_us: int, snapshot: Snapshot) -> None:
        """Queue the streams that are due, and what is wanted besides."""
        due = () if self.is_quiet else self._streams.due(now_us)
        if self.wanted:
            due = (*due, *sorted(self.wanted.difference(due)))
            self.wanted.clear()
        if due:
            self._outbox.telemetry(*self._composer.batch(due, snapshot, self._config))

    def summary(self, now_us: int, snapshot: Snapshot, *, is_on: bool) -> None:
        """What a high-latency link says in place of ``tick``: HIGH_LATENCY2 alone, and only when it is switched on."""
        self.snapshot = snapshot
        if not is_on:
            self._next_summary_us = None
            return
        if self._next_summary_us is None or now_us >= self._next_summary_us:
            self._next_summary_us = now_us + round(self._config.high_latency_period_s * 1e6)
            self._outbox.telemetry(*self._composer.batch((HIGH_LATENCY2,), snapshot, self._config))

    def _heartbeat(self, now_us: int) -> None:
        if now_us >= self._next_heartbeat_us:
            self._next_heartbeat_us = max(self._next_heartbeat_us, now_us - self._heartbeat_us + 1) + self._heartbeat_us
        made = self.compose(HEARTBEAT)
        if made is not None:
            self._outbox.urgent(made)

    def _changes(self, digest: Digest) -> bool:
        """Note what changed since the last snapshot; True when HEARTBEAT must say so."""
        old, self._digest = self._digest, digest
        if old is None or digest.plan != old.plan:
            self.wanted.add(MISSION_CURRENT)
        if old is None or digest.fence != old.fence:
            self.wanted |= {FENCE_STATUS, SYS_STATUS}
        if old is not None and digest.face == old.face:
            return False
        self.wanted.add(CURRENT_MODE)
        return True

    def say(self, severity: int, text: str) -> None:
        """Queue a text for the operator; on a slow link warnings and worse, on a high-latency link none."""
        slow = self._config.profile == "lora" and severity > _SLOW_LINK_SEVERITY
        if slow or self._config.profile == "high_latency":
            return
        for message in self._texts.messages(severity, text):
            self._outbox.answer(packed(message))

    def explain(self, reason: str, now_us: int, *, rarely: bool = False) -> None:
        """Say why something was refused, each reason at most once a second, ``rarely`` every 10 s."""
        last_us = self._said.get(reason)
        if last_us is not None and 0 <= now_us - last_us < (_STREAM_TEXT_GAP_US if rarely else _TEXT_GAP_US):
            return
        self._said[reason] = now_us
        if len(self._said) > _MAX_TEXTS_KEPT:
            self._said.pop(next(iter(self._said)))
        self.say(Severity.WARNING, reason[:1].upper() + reason[1:])
