"""Plain MAVLink on a half-duplex radio: when the vessel speaks, so that a ground station that knows nothing of radios is heard.

Who transmits hears nothing, and the module tells neither end what it does. So the vessel answers as soon as a station's
packets have ended, keeps off the air while the next question may come, leaves the station's HEARTBEAT its moment, and says
what it says by itself at random moments between: a fixed rhythm would meet a station's half-second repeats for ever. What it
says by itself slows down as the hour's airtime is used up, and never stops.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Final, Protocol

from ..language.requests import Reply, Request
from ..language.snapshot import Snapshot
from ..mavlink.commands.table import MAY_STOP
from ..mavlink.persona import Budget
from ..mavlink.telemetry.outbox import MakeOutbox, Seal
from ..mavlink.telemetry.slow_outbox import COMMAND_ACK, SlowOutbox
from ..mavlink.wire.payload import Packed
from .air import AirClock, Ledger, Priority, RadioProfile
from .air.ledger import HOUR_US
from .ear import BEAT_BYTES, GAP_US, MODULE_DELAY_US, STATION_BEAT_US, Ear

_THINK_US: Final = 60_000
"""Allowed for a station to answer."""
_TYPICAL_BYTES: Final = 49
_PATIENCE_US: Final = 2_500_000
"""An answer waits so long for a moment in which the station is silent: by then its repeats have ended."""
_DIALOGUE_US: Final = 1_500_000
"""After a question: another one is likely, and streams wait."""
_DIALOGUE_BEAT_US: Final = 2_000_000
_LATE_BEAT_US: Final = 1_800_000
_SPREAD_US: Final = 300_000
_SHORT_US: Final = 130_000
"""A packet of answers is kept so short, if a frame allows it: stations repeat themselves after 0.5 s."""
_BEAT_SHARE: Final = 0.06
_LONGEST_BEAT_US: Final = 2_200_000
"""With the random part still less than the 3 s after which stations call a vessel lost."""
_NEWS_SHARE: Final = 0.6
_NEWS_GAIN: Final = 4.0
_MOST_NEWS: Final = 0.25
"""Share of the time that streams and texts may be on the air, however much of the hour is left."""


class PlainEndpoint(Protocol):
    """What is paced."""

    asked: list[Request]
    has_timers: bool

    @property
    def heard(self) -> Mapping[tuple[int, int], int]: ...
    def receive(self, data: bytes, now_us: int) -> None: ...
    def requests(self) -> list[Request]: ...
    def reply(self, request_id: int, reply: Reply, now_us: int) -> None: ...
    def tick(self, now_us: int, snapshot: Snapshot) -> None: ...
    def poll(self, now_us: int) -> None: ...
    def param_changed(self, name: str) -> None: ...
    @property
    def bad_frames(self) -> int: ...


def _may_stop(reply: Packed | None) -> bool:
    """Whether a reply acknowledges a command that makes the vessel stop."""
    if reply is None:
        return False
    message_id, payload = reply
    return message_id == COMMAND_ACK and int.from_bytes(payload[:2], "little") in MAY_STOP


class PlainRadio:
    """An endpoint with the manners of a half-duplex radio: the ``mavlink`` protocol on the radio port.

    ``build`` makes the endpoint around the outbox that this radio empties.
    """

    def __init__(
        self,
        build: Callable[[MakeOutbox], PlainEndpoint],
        profile: RadioProfile,
        rng: random.Random,
        *,
        ledger: Ledger | None = None,
    ) -> None:
        self.profile = profile
        self.ledger = ledger or Ledger(profile.hour_us)
        self._clock = AirClock(profile)
        self._ear = Ear(self._clock)
        self._rng = rng
        self._now_us = 0
        self.endpoint = build(self._make_outbox)
        self.asked = self.endpoint.asked
        self._listen_until_us = 0
        self._stuck_us: int | None = None
        """Since when a reply waits for its moment."""
        self._beat_sent_us = -_DIALOGUE_BEAT_US
        self._news_from_us = self._beat_from_us = 0
        sizes = range(profile.max_frame_bytes, BEAT_BYTES, -1)
        self._reply_bytes = next((size for size in sizes if profile.airtime_us(size) <= _SHORT_US), BEAT_BYTES)

    def _make_outbox(self, budget: Budget, seal: Seal, overhead_bytes: int) -> SlowOutbox:
        self.outbox = SlowOutbox(budget, seal, overhead_bytes, way_us=self._way_us, clock=lambda: self._now_us)
        return self.outbox

    def _way_us(self, size: int) -> int:
        """From the write at one end to the last byte at the other."""
        serial_us = round(size * self.profile.serial_byte_us)
        return 2 * serial_us + GAP_US + self._clock.airtime_us(size) + MODULE_DELAY_US

    # ---- the interface of an endpoint ---------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> None:
        self._now_us = now_us
        if data:
            self._ear.receive(data, now_us)
            if self._ear.question_us == now_us:
                self._listen_until_us = min(self._listen_until_us, now_us)
        self.endpoint.receive(data, now_us)

    def requests(self) -> list[Request]:
        return self.endpoint.requests()

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        self._now_us = now_us
        self.endpoint.reply(request_id, reply, now_us)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self._now_us = now_us
        self.endpoint.tick(now_us, snapshot)

    def param_changed(self, name: str) -> None:
        self.endpoint.param_changed(name)

    @property
    def bad_frames(self) -> int:
        return self.endpoint.bad_frames

    @property
    def heard(self) -> Mapping[tuple[int, int], int]:
        return self.endpoint.heard

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return one packet's bytes when the air is ours, b"" otherwise."""
        self._now_us = now_us
        if self.endpoint.has_timers:
            self.endpoint.poll(now_us)
        if now_us < self._listen_until_us or not self._clock.is_free(now_us) or self._ear.is_hearing(now_us):
            return b""
        outbox = self.outbox
        if outbox.replies_wait:
            return self._a_reply(now_us)
        data = self._a_beat(now_us) if outbox.beat is not None else b""
        if not data and outbox.lists_wait:
            data = self._a_list_item(now_us)
        if not data and now_us >= self._news_from_us:
            data = self._some_news(now_us)
        return data

    # ---- what goes out ------------------------------------------------------------------------------------------

    def _a_reply(self, now_us: int) -> bytes:
        """Answers, at once; then time for the next question."""
        size = self._fitting_reply(now_us)
        if not size:
            return b""
        self._stuck_us = None
        priority = Priority.STOP if _may_stop(self.outbox.first_reply) else Priority.COMMAND
        if not self.ledger.allows(self._clock.airtime_us(size), priority, now_us):
            self.outbox.drop_replies()
            return b""
        urgent = self.outbox.is_urgent
        data = self.outbox.take_replies(now_us, size)
        if self._beat_fits_behind(size, now_us):
            self._beat_sent_us = now_us
            data += self.outbox.take_beat()
        self._sent(data, now_us)
        if urgent:
            serial_us = round(size * self.profile.serial_byte_us)
            self._listen_until_us = self._clock.off_us + MODULE_DELAY_US + serial_us + _THINK_US + self._question_us()
        self._put_off(max(self._listen_until_us, self._clock.off_us))
        return data

    def _beat_fits_behind(self, size: int, now_us: int) -> bool:
        """Whether a HEARTBEAT that a dialogue has long held up goes with a reply: the best moment that there is."""
        if self.outbox.beat is None or now_us - self._beat_sent_us < _LATE_BEAT_US:
            return False
        size += BEAT_BYTES
        return size <= self._reply_bytes and not self._meets(size, now_us)

    def _fitting_reply(self, now_us: int) -> int:
        """Bytes of the replies that go now: as many as keep clear of the station's own words; 0 when none do, for a while."""
        if self._stuck_us is None:
            self._stuck_us = now_us
        sizes = (self.outbox.reply_size(room) for room in (self._reply_bytes, 0))
        patient = not self.profile.lbt and now_us - self._stuck_us < _PATIENCE_US
        return next((size for size in sizes if not patient or not self._meets(size, now_us)), 0)

    def _question_us(self) -> int:
        """From a station's write to its first byte here."""
        return self._clock.span_us(_TYPICAL_BYTES) + MODULE_DELAY_US

    def _a_beat(self, now_us: int) -> bytes:
        """The HEARTBEAT, each second or so; less often in a dialogue, and as the hour is used up."""
        if now_us < self._beat_from_us:
            return b""
        if self._in_dialogue(now_us) and now_us - self._beat_sent_us < _DIALOGUE_BEAT_US:
            return b""
        if not self._may(BEAT_BYTES, Priority.EVENT, now_us):
            return b""
        self._beat_sent_us = now_us
        data = self._sent(self.outbox.take_beat(), now_us)
        self._put_off(self._clock.off_us)
        self._beat_from_us = now_us + self.beat_us(now_us) + self._rng.randrange(_SPREAD_US)
        return data

    def beat_us(self, now_us: int) -> int:
        """Time between two HEARTBEATs, from the share of the hour that is used."""
        cost_us = self._clock.airtime_us(BEAT_BYTES)
        least_us = max(round(cost_us / _BEAT_SHARE), STATION_BEAT_US)
        used = self.ledger.used_us(now_us) / self.ledger.limit_us if self.ledger.limit_us else 0.0
        stretch = min(max((used - 0.35) / 0.2, 0.0), 1.0)
        return min(round(least_us + stretch * (_LONGEST_BEAT_US - least_us)), _LONGEST_BEAT_US)

    def _a_list_item(self, now_us: int) -> bytes:
        """A piece of a long answer (parameters, files): the station waits for it in silence."""
        packed = self.outbox.next_of_list(now_us)
        if packed is None or not self._may(self.outbox.size_of(packed), Priority.BULK, now_us):
            return b""
        return self._sent(self.outbox.take_of_list(), now_us)

    def _some_news(self, now_us: int) -> bytes:
        """Streams and texts, while nobody is in a dialogue with the vessel."""
        if not self.outbox.news_wait or self._in_dialogue(now_us):
            return b""
        room = self.profile.max_frame_bytes
        share = self.news_share(now_us)
        if share <= 0.0 or not self._may(room, Priority.STATE, now_us):
            return b""
        data = self._sent(self.outbox.take_news(now_us, room), now_us)
        self._put_off(self._clock.off_us)
        self._news_from_us += round(self._clock.airtime_us(len(data)) * (1.0 / share - 1.0))
        return data

    def news_share(self, now_us: int) -> float:
        """Share of the time that news may be on the air: large while the hour is young, ever less as it is used up."""
        if self.ledger.limit_us is None:
            return _MOST_NEWS
        left_us = self.ledger.limit_us * _NEWS_SHARE - self.ledger.used_us(now_us)
        return min(_NEWS_GAIN * left_us / HOUR_US, _MOST_NEWS)

    def _in_dialogue(self, now_us: int) -> bool:
        return self._ear.question_us is not None and now_us - self._ear.question_us < _DIALOGUE_US

    def _put_off(self, after_us: int) -> None:
        """Choose the next moments to speak unasked."""
        self._beat_from_us = max(self._beat_from_us, after_us + self._rng.randrange(_SPREAD_US))
        self._news_from_us = max(self._news_from_us, after_us + self._rng.randrange(_SPREAD_US))

    def _may(self, size: int, priority: Priority, now_us: int) -> bool:
        return not self._meets(size, now_us) and self.ledger.allows(self._clock.airtime_us(size), priority, now_us)

    def _meets(self, size: int, now_us: int) -> bool:
        start_us = now_us + round(size * self.profile.serial_byte_us) + GAP_US
        return self._ear.meets(start_us, start_us + self._clock.airtime_us(size))

    def _sent(self, data: bytes, now_us: int) -> bytes:
        if data:
            self._clock.sent(len(data), now_us)
            self.ledger.charge(self._clock.airtime_us(len(data)), self._clock.off_us)
        return data
