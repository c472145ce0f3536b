"""MAVLink 2 signatures: making them, checking them, and what each kind of link lets in.

The order of the checks is the point: the signature first, in constant time, then the time stamp, and only then is anything
remembered. A forged frame therefore changes nothing, fills no table and moves no clock. One ``SigningState`` serves all links
of the vessel, so a frame that was heard on one link is not new on another, and what we sent does not come back as an order.
Source: MAVLink message signing guide; firmware-reliability §B.3.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final

from ...language.witness import Witness
from .framing import SIGNATURE_LEN, Frame

KEY_LEN: Final = 32
UNITS_PER_S: Final = 100_000
"""Signing time stamps count 10 us."""
EPOCH_UTC_S: Final = 1_420_070_400
"""2015-01-01, where signing time stamps start, in seconds since 1970."""
NEW_STREAM_BEHIND: Final = 60 * UNITS_PER_S
"""A stream that was not heard before may be this far behind our own time."""
MAX_STREAMS: Final = 32
RADIO_STATUS: Final = 109
_MAX_TIMESTAMP: Final = (1 << 48) - 1

Stream = tuple[int, int, int]
"""System, component, link id."""


def units_from_utc(utc_us: int) -> int:
    """Signing time stamp of a UTC time in us since 1970; 0 before 2015."""
    return max(0, utc_us - EPOCH_UTC_S * 1_000_000) // 10


def signature(key: bytes, unsigned: bytes, link_id: int, timestamp: int) -> bytes:
    """The first 48 bits of SHA-256 over key, frame (marker to checksum), link id and time stamp."""
    tail = bytes((link_id,)) + timestamp.to_bytes(6, "little")
    return hashlib.sha256(key + unsigned + tail).digest()[:6]


@dataclass(slots=True)
class SigningState:
    """Key, own time and the streams heard. Shared by every signer and verifier of the vessel."""

    key: bytes | None = None
    timestamp: int = 0
    """Never goes back. Grows with the clock, with what is signed and with what is accepted."""
    streams: dict[Stream, int] = field(default_factory=dict)
    """Newest accepted time stamp of each stream, at most MAX_STREAMS."""
    floor: int = 0
    """Nothing up to this time stamp is accepted: it may have been, before a restart that nobody could prepare for."""

    witness: Witness = field(default_factory=Witness)
    """Through whom the key is used."""

    def __post_init__(self) -> None:
        if self.key is not None and len(self.key) != KEY_LEN:
            raise ValueError(f"a signing key has {KEY_LEN} bytes")

    def advance(self, utc_us: int) -> None:
        """Move the own time forward to a trusted clock; it never moves back."""
        self.timestamp = min(max(self.timestamp, units_from_utc(utc_us)), _MAX_TIMESTAMP)

    def export(self) -> dict[str, Any]:
        """What must survive a restart, without the key: save it every few seconds."""
        return {"timestamp": self.timestamp, "streams": [[*stream, at] for stream, at in self.streams.items()]}

    def restore(self, saved: Mapping[str, Any], margin_s: float = 0.0) -> None:
        """Take an export back. ``margin_s``: how old it may be; what was signed meanwhile is not reused. Bad data is ignored."""
        stamp = saved.get("timestamp")
        if isinstance(stamp, int) and 0 <= stamp <= _MAX_TIMESTAMP:
            self.timestamp = max(self.timestamp, min(stamp + int(margin_s * UNITS_PER_S), _MAX_TIMESTAMP))
        rows = saved.get("streams")
        for row in rows[:MAX_STREAMS] if isinstance(rows, list) else ():
            if isinstance(row, list) and len(row) == 4 and all(isinstance(value, int) for value in row):
                system, component, link_id, at = row
                stream = (system, component, link_id)
                self.streams[stream] = max(self.streams.get(stream, 0), at)


class Signer:
    """Signs what we send on one link (``codec.FrameSigner``). Needs a key in the state."""

    __slots__ = ("_state", "link_id")

    def __init__(self, state: SigningState, link_id: int) -> None:
        if state.key is None:
            raise ValueError("no key to sign with")
        self._state = state
        self.link_id = link_id & 0xFF

    def sign(self, unsigned: bytes) -> bytes:
        """The 13 bytes behind a frame whose flags already say 'signed'. Every call uses a new time stamp."""
        state = self._state
        key = state.key
        if key is None:
            raise ValueError("the key is gone")
        state.timestamp = min(state.timestamp + 1, _MAX_TIMESTAMP)
        stamp = state.timestamp
        state.streams[unsigned[5], unsigned[6], self.link_id] = stamp
        tail = bytes((self.link_id,)) + stamp.to_bytes(6, "little")
        return tail + state.witness.made(lambda: signature(key, unsigned, self.link_id, stamp))


@dataclass(frozen=True, slots=True)
class LinkPolicy:
    """What a kind of link lets in."""

    name: str
    unsigned: bool
    """Unsigned frames are taken."""
    signed: bool = True
    """Rightly signed frames are taken."""
    always: frozenset[int] = frozenset({RADIO_STATUS})
    """Message ids that are taken unsigned: a radio modem cannot sign, and says nothing that moves the vessel."""


TRUSTED: Final = LinkPolicy("trusted", unsigned=True)
"""Loopback and USB."""
SIGNED: Final = LinkPolicy("signed", unsigned=False)
TELEMETRY_ONLY: Final = LinkPolicy("telemetry", unsigned=False, signed=False, always=frozenset())
"""We send, nobody is listened to."""
POLICIES: Final = {policy.name: policy for policy in (TRUSTED, SIGNED, TELEMETRY_ONLY)}


class FrameVerdict(Enum):
    """What became of a frame. Only ACCEPTED and ACCEPTED_UNSIGNED may be acted upon."""

    ACCEPTED = "signed"
    ACCEPTED_UNSIGNED = "unsigned, allowed here"
    UNSIGNED = "unsigned"
    FORGED = "wrong signature"
    REPLAYED = "time stamp not new"
    TOO_OLD = "time stamp too old for a new stream"
    TABLE_FULL = "too many streams"
    CLOSED = "nothing is accepted here"

    @property
    def ok(self) -> bool:
        return self in (FrameVerdict.ACCEPTED, FrameVerdict.ACCEPTED_UNSIGNED)


def judge(state: SigningState, frame: Frame) -> FrameVerdict:
    """What a frame's signature is worth, remembering nothing: a look at who stands before the door."""
    if state.key is None or frame.link_id is None or frame.timestamp is None:
        return FrameVerdict.UNSIGNED
    key, link_id, timestamp = state.key, frame.link_id, frame.timestamp

    def is_right() -> bool:
        return hmac.compare_digest(signature(key, frame.raw[:-SIGNATURE_LEN], link_id, timestamp), frame.raw[-6:])

    if not state.witness.verdict(is_right):
        return FrameVerdict.FORGED
    newest = state.streams.get((frame.system, frame.component, frame.link_id))
    if frame.timestamp <= max(newest or 0, state.floor):
        return FrameVerdict.REPLAYED
    if newest is None and frame.timestamp + NEW_STREAM_BEHIND < state.timestamp:
        return FrameVerdict.TOO_OLD
    return FrameVerdict.ACCEPTED


class Verifier:
    """Judges the frames of one link. ``texts`` gives the operator at most one sentence a minute for each cause and sender."""

    def __init__(self, state: SigningState, policy: LinkPolicy) -> None:
        self.policy = policy
        self.counters: dict[FrameVerdict, int] = dict.fromkeys(FrameVerdict, 0)
        self._state = state
        self._told: dict[tuple[FrameVerdict, int], int] = {}
        self._texts: list[str] = []

    def check(self, frame: Frame, now_us: int) -> FrameVerdict:
        """Judge a frame, and remember its time stamp when it is rightly signed and new."""
        verdict = self._judge(frame)
        self.counters[verdict] += 1
        if not verdict.ok and verdict is not FrameVerdict.CLOSED:
            self._tell(verdict, frame, now_us)
        return verdict

    def drain_texts(self) -> list[str]:
        """Sentences for the operator since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def _judge(self, frame: Frame) -> FrameVerdict:
        policy = self.policy
        if not frame.signed:
            if policy.unsigned or frame.message_id in policy.always:
                return FrameVerdict.ACCEPTED_UNSIGNED
            return FrameVerdict.UNSIGNED if policy.signed else FrameVerdict.CLOSED
        if not policy.signed:
            return FrameVerdict.CLOSED
        if self._state.key is None:
            # without a key a signature says nothing: the frame counts as unsigned
            return FrameVerdict.ACCEPTED_UNSIGNED if policy.unsigned else FrameVerdict.UNSIGNED
        return self._judge_signed(frame)

    def _judge_signed(self, frame: Frame) -> FrameVerdict:
        state = self._state
        verdict = judge(state, frame)
        if verdict is not FrameVerdict.ACCEPTED or frame.link_id is None or frame.timestamp is None:
            return verdict
        stream = (frame.system, frame.component, frame.link_id)
        if stream not in state.streams and not self._make_room():
            return FrameVerdict.TABLE_FULL
        state.streams[stream] = frame.timestamp
        state.timestamp = max(state.timestamp, frame.timestamp)
        return FrameVerdict.ACCEPTED

    def _make_room(self) -> bool:
        """Room for a new stream. Only streams too old to come back as new ones may be forgotten, or a replay would pass."""
        streams = self._state.streams
        if len(streams) < MAX_STREAMS:
            return True
        oldest = min(streams, key=streams.__getitem__)
        if streams[oldest] + NEW_STREAM_BEHIND >= self._state.timestamp:
            return False
        del streams[oldest]
        return True

    def _tell(self, verdict: FrameVerdict, frame: Frame, now_us: int) -> None:
        cause = (verdict, frame.system)
        told_us = self._told.get(cause)
        if (told_us is not None and now_us - told_us < 60_000_000) or len(self._texts) >= 4:
            return
        if len(self._told) >= 64:
            del self._told[min(self._told, key=self._told.__getitem__)]
        self._told[cause] = now_us
        self._texts.append(self._sentence(verdict, frame))

    def _sentence(self, verdict: FrameVerdict, frame: Frame) -> str:
        sender = f"system {frame.system}"
        if verdict in (FrameVerdict.TOO_OLD, FrameVerdict.REPLAYED) and frame.timestamp is not None:
            newest = self._state.streams.get((frame.system, frame.component, frame.link_id or 0), self._state.timestamp)
            behind_s = max(0, max(newest, self._state.floor) - frame.timestamp) / UNITS_PER_S
            return f"Signed frames from {sender} are {behind_s:.0f} s behind: refused"
        return f"Frames from {sender} refused: {verdict.value}"


def setup_refusal(
    state: SigningState, verdict: FrameVerdict, *, key: bytes, version: int, armed: bool, radio: bool
) -> str:
    """Why a SETUP_SIGNING message must not be obeyed; an empty string when it may.

    The first key comes only from a local file. A later one needs the old key's signature, disarmed, and not over a radio,
    where anyone listens.
    """
    if state.key is None:
        return "the first key is set on the vessel, not over MAVLink"
    if version == 1 or verdict is not FrameVerdict.ACCEPTED:
        return "a new key must be signed by the old one"
    if not any(key):
        # MAVProxy's "signing remove": every station knows this key
        return "a key of zeros is no key: signing is switched off on the vessel, not over MAVLink"
    if armed:
        return "keys are not changed while armed"
    return "keys are not sent over a radio" if radio else ""
