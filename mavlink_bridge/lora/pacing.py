"""When a host may give its module the next bytes: not before the last packet is off the air, and after listening.

The module says nothing of what it does, so the time of each packet is computed. ``PlainRadio`` puts these manners
around an ordinary MAVLink endpoint: one packet at a time, in the pause after what the ground station sent, and within
the airtime ledger.
"""

from __future__ import annotations

from collections import deque
from typing import Final, Protocol

from mavlink_bridge.lora.airtime import PACKET_BYTES
from mavlink_bridge.lora.ledger import Ledger, Priority
from mavlink_bridge.lora.profile import RadioProfile
from mavlink_bridge.requests import Reply, Request
from mavlink_bridge.snapshot import Snapshot

_MODULE_US: Final = 10_000
"""Allowed for the module to notice the end of a write."""
_PAUSE_US: Final = 6_000
"""Silence on the serial line that ends what the other side sent."""
_ALONE_US: Final = 1_600_000
"""After this silence there is nobody to wait for."""
_STATION_BEAT_US: Final = 1_000_000
"""Ground stations send a HEARTBEAT once a second, whatever the link."""
_BEAT_BYTES: Final = 21
_BEAT_WAY_US: Final = 60_000
"""Serial lines and modules on the way of the station's HEARTBEAT, airtime apart."""
_SHORT_BYTES: Final = 24
_SHORT_US: Final = 130_000
"""An answer packet is kept so short, if a frame allows it: stations repeat themselves after 0.5 s."""
_MAX_HELD: Final = 4
_DIALOGUE_US: Final = 300_000
_ANSWER_US: Final = 100_000
"""Allowed for the station's answer to start."""
_ANSWER_BYTES: Final = 49


class AirClock:
    """Computes when this end's packets leave the air."""

    def __init__(self, profile: RadioProfile) -> None:
        self.profile = profile
        self.off_us = 0
        """End of what this end last sent."""
        self._airtimes: dict[int, int] = {}
        self._gap_us = round(profile.link.gap_ms * 1e3)

    def airtime_us(self, size: int) -> int:
        """Airtime of a write, cut into packets as the module does."""
        known = self._airtimes.get(size)
        if known is None:
            whole, rest = divmod(size, PACKET_BYTES)
            airtime = self.profile.airtime_us
            known = self._airtimes[size] = whole * airtime(PACKET_BYTES) + (airtime(rest) if rest else 0)
        return known

    def span_us(self, size: int) -> int:
        """From the write to the end on the air."""
        return round(size * self.profile.serial_byte_us) + _MODULE_US + self.airtime_us(size)

    def sent(self, size: int, now_us: int) -> None:
        self.off_us = now_us + self.span_us(size)

    def is_free(self, now_us: int, lead_us: int = 0) -> bool:
        """True when a write now keeps the least time off the air; ``lead_us`` is what the write itself takes."""
        return now_us + lead_us >= self.off_us + self._gap_us


class PlainEndpoint(Protocol):
    """What is paced."""

    def receive(self, data: bytes, now_us: int) -> None: ...
    def requests(self) -> list[Request]: ...
    def reply(self, request_id: int, reply: Reply, now_us: int) -> None: ...
    def tick(self, now_us: int, snapshot: Snapshot) -> None: ...
    def take(self, now_us: int, limit_bytes: int) -> bytes: ...
    def param_changed(self, name: str) -> None: ...
    @property
    def bad_frames(self) -> int: ...
    @property
    def last_heartbeat_us(self) -> int | None: ...


class PlainRadio:
    """An endpoint with the manners of a half-duplex radio: the ``mavlink`` protocol on the radio port."""

    def __init__(self, endpoint: PlainEndpoint, profile: RadioProfile, ledger: Ledger | None = None) -> None:
        self.endpoint = endpoint
        self.profile = profile
        self.ledger = ledger or Ledger(profile.hour_us)
        self._clock = AirClock(profile)
        self._heard_us: int | None = None
        self._held: deque[bytes] = deque()
        self._turn_used = False
        self._frame_bytes = profile.max_frame_bytes
        sizes = range(self._frame_bytes, _SHORT_BYTES, -1)
        self._short_bytes = next((size for size in sizes if profile.airtime_us(size) <= _SHORT_US), _SHORT_BYTES)

    def receive(self, data: bytes, now_us: int) -> None:
        if data:
            self._heard_us = now_us
            self._turn_used = False
        self.endpoint.receive(data, now_us)

    def requests(self) -> list[Request]:
        return self.endpoint.requests()

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        self.endpoint.reply(request_id, reply, now_us)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self.endpoint.tick(now_us, snapshot)

    def param_changed(self, name: str) -> None:
        self.endpoint.param_changed(name)

    @property
    def bad_frames(self) -> int:
        return self.endpoint.bad_frames

    @property
    def last_heartbeat_us(self) -> int | None:
        return self.endpoint.last_heartbeat_us

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return one packet's bytes when the air is ours, b"" otherwise."""
        if not self._clock.is_free(now_us) or not self._is_our_turn(now_us):
            return b""
        data = self._next(now_us, limit_bytes)
        if not data:
            return b""
        cost_us = self._clock.airtime_us(len(data))
        if not self._fits(len(data), now_us) or not self.ledger.allows(cost_us, Priority.COMMAND, now_us):
            self._held.appendleft(data)
            return b""
        self._turn_used = True
        self._clock.sent(len(data), now_us)
        self.ledger.charge(cost_us, self._clock.off_us)
        return data

    def _next(self, now_us: int, limit_bytes: int) -> bytes:
        """What to send; while the other side waits for an answer, a short frame before a long one that was put off."""
        if self._held and (not self._is_spoken_to(now_us) or len(self._held) == _MAX_HELD):
            return self._held.popleft()
        room = self._short_bytes if self._is_spoken_to(now_us) else self._frame_bytes
        data = self.endpoint.take(now_us, min(limit_bytes, room))
        if self._held and len(data) > self._short_bytes:
            self._held.append(data)
            return b""
        return data or (self._held.popleft() if self._held else b"")

    def _is_our_turn(self, now_us: int) -> bool:
        """One packet for each that was heard, then time for the answer."""
        if self._heard_us is not None and now_us - self._heard_us < _PAUSE_US:
            return False
        return not self._turn_used or now_us >= self._clock.off_us + _ANSWER_US + self._clock.span_us(_ANSWER_BYTES)

    def _is_spoken_to(self, now_us: int) -> bool:
        """An answer is awaited on the other side: send it alone, and quickly."""
        return self._heard_us is not None and not self._turn_used and now_us - self._heard_us < _DIALOGUE_US

    def _fits(self, size: int, now_us: int) -> bool:
        """Whether a packet is over before the station's next HEARTBEAT; one that never can be goes right after a packet was heard."""
        beat_us, heard_us = self.endpoint.last_heartbeat_us, self._heard_us
        if beat_us is None or heard_us is None or now_us - heard_us > _ALONE_US:
            return True
        lead_us = self._clock.airtime_us(_BEAT_BYTES) + _BEAT_WAY_US
        span_us = self._clock.span_us(size)
        if span_us > _STATION_BEAT_US - lead_us - 2 * _PAUSE_US:
            return now_us - heard_us < 5 * _PAUSE_US
        since_us = (now_us - beat_us + lead_us) % _STATION_BEAT_US
        return since_us + span_us <= _STATION_BEAT_US and since_us >= lead_us
