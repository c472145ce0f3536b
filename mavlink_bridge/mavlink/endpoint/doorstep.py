"""Whoever comes to a signed link and has not shown a right signature yet: he is shown that a vessel is there, and nothing more.

A conversation (``endpoint``) begins with the first rightly signed, fresh frame; until then no text, no position, no answer goes out.
Peers that nobody can pretend to be, or that the owner wrote down (a wire, TCP, the peer of ``udp://``), get HEARTBEAT once a second,
because ground stations wait for it before they speak. A UDP sender that came by himself may have given another's address: he gets at
most a byte for each byte that he sent, so that the vessel is nobody's amplifier.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ...language.snapshot import Snapshot
from ..persona import EndpointConfig
from ..telemetry.outbox import TokenBucket
from ..telemetry.streams import HEARTBEAT, Composer
from ..wire.codec import Codec
from ..wire.framing import EVERYBODY, SIGNATURE_LEN, Deframer
from ..wire.signing import FrameVerdict, Signer, SigningState, judge

HEARTBEAT_US: Final = 1_000_000
"""Stations call a link alive that brings one HEARTBEAT a second."""
READ_BYTES_PER_S: Final = 20_000.0
"""What is looked at of a stranger's speech: more than any station says before it is answered, and no load."""
KEPT_BYTES: Final = 1_024
"""Of what came before the proof: the rightly signed frame and what lies about it, for the conversation that begins with it."""
MAX_CREDIT_BYTES: Final = 256
"""A sender cannot save up more than this, or he would be paid back in one burst."""


class Doorstep:
    """One channel of a signed link before its first right signature.

    ``invited``: it gets HEARTBEAT at 1 Hz, else a byte for a byte. ``on_refused`` hears why frames prove nothing.
    """

    def __init__(
        self,
        config: EndpointConfig,
        signing: SigningState,
        *,
        link_id: int,
        invited: bool,
        composer: Composer | None = None,
        on_refused: Callable[[FrameVerdict, int], None] = lambda verdict, now_us: None,
    ) -> None:
        signer = None if signing.key is None else Signer(signing, link_id)
        self._codec = Codec(config.system_id, config.component_id, link_id, signer)
        self._config = config
        self._signing = signing
        self._invited = invited
        self._on_refused = on_refused
        self._composer = composer or Composer()
        self._deframer = Deframer()
        self._bucket = TokenBucket(READ_BYTES_PER_S, READ_BYTES_PER_S)
        self._kept = b""
        self._credit_bytes = 0
        self._next_us = 0
        self._due = b""

    def receive(self, data: bytes, now_us: int) -> bytes:
        """Take bytes as read. Returns what the conversation begins with once they prove the sender, b"" before. Never raises."""
        self._credit_bytes = min(MAX_CREDIT_BYTES, self._credit_bytes + len(data))
        self._bucket.refill(now_us)
        if len(data) > self._bucket.level:
            return b""
        self._bucket.spend(len(data))
        self._kept = (self._kept + data)[-max(KEPT_BYTES, len(data)) :]
        for frame in self._deframer.receive(data, now_us):
            if frame.system == EVERYBODY:
                continue
            verdict = judge(self._signing, frame)
            if verdict is FrameVerdict.ACCEPTED:
                return self._kept
            self._on_refused(verdict, now_us)
        return b""

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        """Make the HEARTBEAT that is due."""
        if now_us < self._next_us:
            return
        made = self._composer.compose(HEARTBEAT, snapshot, self._config)
        if made is None:
            return
        size = len(made[1]) + 12 + (SIGNATURE_LEN if self._codec.signer else 0)
        if not self._invited:
            if size > self._credit_bytes:
                return
            self._credit_bytes -= size
        self._next_us = now_us + HEARTBEAT_US
        self._due = self._codec.seal_all((made,))

    def take(self) -> bytes:
        """Return what is to be written now."""
        due, self._due = self._due, b""
        return due
