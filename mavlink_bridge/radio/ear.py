"""What the bytes from the air tell of the other end of a plain MAVLink link: whether it still talks, and when it probably talks next.

A station's HEARTBEAT comes once a second and an unanswered question every half second, whatever the link is; a packet that is full, or
a frame that has no end, promises another packet.
"""

from __future__ import annotations

from typing import Final

from ..mavlink.telemetry.slow_outbox import HEARTBEAT
from ..mavlink.wire.framing import Deframer
from .air import AirClock
from .air.airtime import PACKET_BYTES

_PAUSE_US: Final = 8_000
"""Silence on the serial line that ends what the other side sent."""
_MARGIN_US: Final = 30_000
_BEAT_KNOWN_US: Final = 10_000_000
"""After this silence the rhythm of the station's HEARTBEAT means nothing."""
_SLACK_US: Final = 15_000
_REPEAT_US: Final = 500_000
"""MAVSDK asks again after this, three to five times."""
_REPEATS: Final = 4
MODULE_DELAY_US: Final = 20_000
"""Taken for a module's time from the end of a packet to its first byte on the serial line."""
GAP_US: Final = 5_000
"""Taken for the silence after which a module sends what it has."""
BEAT_BYTES: Final = 21
STATION_BEAT_US: Final = 1_000_000
"""Ground stations send a HEARTBEAT once a second, whatever the link."""


class Ear:
    """What the bytes from the air tell of the other end: whether it still talks, and when it probably talks next."""

    def __init__(self, clock: AirClock) -> None:
        self._clock = clock
        self._byte_us = clock.profile.serial_byte_us
        self._deframer = Deframer()
        self._burst = 0
        self._began_us = 0
        self.heard_us: int | None = None
        self.question_us: int | None = None
        """When anything but a HEARTBEAT was last heard."""
        self._question: tuple[int, int] | None = None
        """When its packets were on the air."""
        self._beat_us: int | None = None
        """When the station's HEARTBEAT began on the air."""
        serial_us = round(PACKET_BYTES * self._byte_us)
        self._more_us = max(clock.airtime_us(PACKET_BYTES) - serial_us, 0) + _MARGIN_US

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes as read."""
        if self.heard_us is None or now_us - self.heard_us > self._more_us:
            self._burst, self._began_us = 0, now_us - round(len(data) * self._byte_us)
        self._burst += len(data)
        self.heard_us = now_us
        for frame in self._deframer.receive(data, now_us):
            if frame.message_id != HEARTBEAT:
                self.question_us, self._question = now_us, self._on_air()
            elif self._burst == len(frame.raw) or self._beat_us is None or now_us - self._beat_us > _BEAT_KNOWN_US:
                self._beat_us = now_us - round(BEAT_BYTES * self._byte_us) - MODULE_DELAY_US - self._beat_air_us

    @property
    def _beat_air_us(self) -> int:
        return self._clock.airtime_us(BEAT_BYTES)

    def _on_air(self) -> tuple[int, int]:
        """Begin and end on the air of what has been heard in one go."""
        first_us = self._began_us - MODULE_DELAY_US - self._clock.airtime_us(min(self._burst, PACKET_BYTES))
        return first_us, first_us + self._clock.airtime_us(self._burst)

    def is_hearing(self, now_us: int) -> bool:
        """Whether more is probably coming: bytes are, or the last packet was full, or a frame in it has no end."""
        if self.heard_us is None:
            return False
        cut = self._burst % PACKET_BYTES == 0 or self._deframer.pending > 0
        return now_us - self.heard_us < (self._more_us if cut else _PAUSE_US)

    def meets(self, start_us: int, end_us: int) -> bool:
        """Whether a transmission of ours would probably overlap one of the station's: its HEARTBEAT, or the question asked again."""
        return self._meets_beat(start_us, end_us) or self._meets_repeat(start_us, end_us)

    def _meets_beat(self, start_us: int, end_us: int) -> bool:
        if self._beat_us is None or self.heard_us is None or start_us - self.heard_us > _BEAT_KNOWN_US:
            return False
        return _overlaps(start_us, end_us, self._beat_us, self._beat_us + self._beat_air_us, STATION_BEAT_US)

    def _meets_repeat(self, start_us: int, end_us: int) -> bool:
        if self._question is None or start_us - self._question[1] > _REPEATS * _REPEAT_US:
            return False
        return _overlaps(start_us, end_us, *self._question, _REPEAT_US)


def _overlaps(start_us: int, end_us: int, begin_us: int, over_us: int, period_us: int) -> bool:
    """Whether a span meets one that comes again and again."""
    taken_us = over_us - begin_us + 2 * _SLACK_US
    phase_us = (start_us - begin_us + _SLACK_US) % period_us
    return phase_us < taken_us or phase_us + end_us - start_us > period_us
