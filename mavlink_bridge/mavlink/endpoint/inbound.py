"""From bytes to messages that may be believed: flood limit, frames, copies, signature policy, addressing; all drops are counted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from ..persona import EndpointConfig
from ..telemetry.outbox import TokenBucket
from ..wire.codec import decode
from ..wire.framing import EVERYBODY, Deframer, Frame
from ..wire.signing import Verifier
from .copies import Copies

_BYTES_PER_TOKEN: Final = 64.0


@dataclass(slots=True)
class Counters:
    """What was received and why some of it was dropped."""

    messages: int = 0
    flood_bytes: int = 0
    refused: int = 0
    """Not signed as this link demands (``signing.Verdict`` says why)."""
    copies: int = 0
    own: int = 0
    nobody: int = 0
    """From system 0, which addresses everybody and is no sender's own number."""
    unknown: int = 0
    not_ours: int = 0


class Inbound:
    """The receiving half of an endpoint, up to decoded messages addressed to it."""

    def __init__(self, config: EndpointConfig, verifier: Verifier) -> None:
        self._config = config
        self._verifier = verifier
        self._deframer = Deframer()
        self._copies = Copies()
        self._bucket = TokenBucket(config.flood_frames_per_s, config.flood_burst_frames)
        self.counters = Counters()

    @property
    def bad_frames(self) -> int:
        framing = self._deframer.counters
        return framing.bad_crc + framing.bad_flags + framing.stalled + self.counters.refused + self.counters.nobody

    @property
    def pending(self) -> bool:
        """Whether part of a frame has come, or noise that looks so: it must be looked at again, whether more comes or not."""
        return self._deframer.pending > 0

    def receive(self, data: bytes, now_us: int) -> list[Any]:
        """Return the messages for this vessel in ``data``, decoded, oldest first. Empty data serves the time limit of frames."""
        self._bucket.refill(now_us)
        cost = 1.0 + len(data) / _BYTES_PER_TOKEN if data else 0.0
        if cost > self._bucket.level:
            self.counters.flood_bytes += len(data)
            return []
        self._bucket.spend(cost)
        messages = []
        for frame in self._deframer.receive(data, now_us):
            message = self._believe(frame, now_us)
            if message is not None:
                messages.append(message)
        return messages

    def _believe(self, frame: Frame, now_us: int) -> Any | None:
        counters, config = self.counters, self._config
        if frame.system == config.system_id and frame.component == config.component_id:
            counters.own += 1
            return None
        if frame.system == EVERYBODY:
            counters.nobody += 1
            return None
        if self._copies.is_copy(frame, now_us):
            # before the signature, which would call a copy made by the network a replay
            counters.copies += 1
            return None
        verdict = self._verifier.check(frame, now_us)
        if not verdict.ok:
            counters.refused += 1
            return None
        self._copies.remember(frame, now_us)
        message = decode(frame)
        if message is None:
            counters.unknown += 1
            return None
        if not self._is_for_us(message):
            counters.not_ours += 1
            return None
        counters.messages += 1
        message.verdict = verdict
        return message

    def _is_for_us(self, message: Any) -> bool:
        """True for messages without a target, to everybody, or to this system and this or any component."""
        system = getattr(message, "target_system", None)
        if system is None:
            system = getattr(message, "target", 0)
        component = getattr(message, "target_component", 0)
        return system in (0, self._config.system_id) and component in (0, self._config.component_id)
