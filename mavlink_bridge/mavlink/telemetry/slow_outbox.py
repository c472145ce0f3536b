"""What waits on a link so slow that each packet counts: nothing twice, answers before everything else.

Stations repeat a question after half a second whatever the link is. So an answer that waits already is not queued again, a newer
answer of a dialogue takes the place of the older one, and an answer that was on its way when the question was repeated
is not given again: the copies crossed. Replies, the HEARTBEAT and the rest are handed out apart, since each has its own moment.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Mapping
from typing import Final

from ..persona import Budget
from ..wire.codec import dialect
from ..wire.payload import Packed
from .outbox import Bulk, Outbox, Seal

HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
COMMAND_ACK: Final[int] = dialect.MAVLINK_MSG_ID_COMMAND_ACK
_MISSION_ACK: Final[int] = dialect.MAVLINK_MSG_ID_MISSION_ACK
_MISSION_REQUESTS: Final = frozenset(
    (dialect.MAVLINK_MSG_ID_MISSION_REQUEST, dialect.MAVLINK_MSG_ID_MISSION_REQUEST_INT)
)
_MISSION_ITEM: Final[int] = dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT
_MISSION_COUNT: Final[int] = dialect.MAVLINK_MSG_ID_MISSION_COUNT
_NEWS: Final = frozenset((dialect.MAVLINK_MSG_ID_STATUSTEXT, dialect.MAVLINK_MSG_ID_MISSION_ITEM_REACHED))
"""What the vessel says by itself, though it comes as an answer."""
_KIND_AT: Final = {_MISSION_ACK: 3, _MISSION_ITEM: 37, _MISSION_COUNT: 4, **dict.fromkeys(_MISSION_REQUESTS, 4)}
"""Where mission_type stands in the payload; a trimmed payload ends before it, and then it is 0."""
_ASKED_BYTES: Final = {COMMAND_ACK: 44, _MISSION_ACK: 49, _MISSION_ITEM: 16, _MISSION_COUNT: 14}
"""Size of the frame that such a reply answers."""
_OTHER_ASKED: Final = 44
_REACHED: Final[int] = dialect.MAVLINK_MSG_ID_MISSION_ITEM_REACHED
_REACHED_TIMES: Final = 3
_REACHED_GAP_US: Final = 1_700_000
"""Nobody asks for it again, and a station that misses it waits for the end of the plan for ever."""
_MAX_WAITING: Final = 64
_KEPT: Final = 32
Key = tuple[object, ...]


class SlowOutbox(Outbox):
    """``way_us`` tells how long so many bytes take from a write here to the last byte there; ``clock`` the present time."""

    def __init__(
        self,
        budget: Budget,
        seal: Seal,
        overhead_bytes: int = 12,
        *,
        way_us: Callable[[int], int],
        clock: Callable[[], int],
    ) -> None:
        super().__init__(budget, seal, overhead_bytes)
        self._way_us = way_us
        self._clock = clock
        self._urgent_replies: OrderedDict[Key, Packed] = OrderedDict()
        """Of dialogues whose other side counts half seconds."""
        self._replies: OrderedDict[Key, Packed] = OrderedDict()
        """What else was asked for."""
        self._news: deque[Packed] = deque(maxlen=_MAX_WAITING)
        self._held: Packed | None = None
        """News that found no more room."""
        self.beat: Packed | None = None
        """The HEARTBEAT that waits."""
        self._again: deque[tuple[int, int, Packed]] = deque(maxlen=_MAX_WAITING)
        """When to say it again, how often still, and what."""
        self._arrives_us: OrderedDict[Packed, int] = OrderedDict()
        self._streams: dict[int, Packed] = {}
        self._lists: deque[Bulk] = deque()
        self._list_head: Packed | None = None

    # ---- in -----------------------------------------------------------------------------------------------------

    def urgent(self, packed: Packed) -> None:
        message_id, _ = packed
        if message_id == HEARTBEAT:
            self.beat = packed
            return
        if message_id == _MISSION_ACK:
            kind = _key(packed)[1]
            for number in _MISSION_REQUESTS:
                self._urgent_replies.pop((number, kind), None)
        self._reply(packed, self._urgent_replies)

    def answer(self, packed: Packed) -> None:
        message_id, _ = packed
        if message_id in _NEWS:
            if packed not in self._news:
                self._news.append(packed)
        else:
            self._reply(packed, self._replies)

    def telemetry(self, made: Mapping[int, Packed], silent: Iterable[int] = ()) -> None:
        self._streams.update(made)
        for number in silent:
            self._streams.pop(number, None)

    def bulk(self, source: Bulk) -> None:
        if source not in self._lists:
            self._lists.append(source)

    def _reply(self, packed: Packed, shelf: OrderedDict[Key, Packed]) -> None:
        if self._crossed(packed):
            return
        key = _key(packed)
        if key in shelf or len(shelf) < _MAX_WAITING:
            shelf[key] = packed
        else:
            self.dropped += 1

    def _crossed(self, packed: Packed) -> bool:
        """Whether the question was sent before the answer given last could have arrived."""
        arrives_us = self._arrives_us.get(packed)
        if arrives_us is None:
            return False
        message_id, _ = packed
        return self._clock() - self._way_us(_ASKED_BYTES.get(message_id, _OTHER_ASKED)) < arrives_us

    # ---- out ----------------------------------------------------------------------------------------------------

    @property
    def _shelf(self) -> OrderedDict[Key, Packed]:
        """The replies that go next."""
        return self._urgent_replies or self._replies

    @property
    def replies_wait(self) -> bool:
        return bool(self._urgent_replies or self._replies)

    @property
    def first_reply(self) -> Packed | None:
        """The reply that goes next."""
        return next(iter(self._shelf.values()), None)

    @property
    def is_urgent(self) -> bool:
        """Whether the reply that goes next is one of a dialogue: another question will follow it."""
        return bool(self._urgent_replies)

    @property
    def lists_wait(self) -> bool:
        """Whether somebody asked for a list of which something is left."""
        return bool(self._list_head or self._lists)

    @property
    def news_wait(self) -> bool:
        """Whether anything but replies and HEARTBEAT waits."""
        return bool(self._held or self._news or self._streams or self._is_due)

    def next_of_list(self, now_us: int) -> Packed | None:
        """The next message of a list that somebody asked for, which ``take_of_list`` will return; lists take turns."""
        while self._list_head is None and self._lists:
            self._list_head = self._lists[0](now_us)
            if self._list_head is None:
                self._lists.popleft()
            else:
                self._lists.rotate(-1)
        return self._list_head

    def take_of_list(self) -> bytes:
        """Its frame."""
        packed, self._list_head = self._list_head, None
        data = b"" if packed is None else self._seal((packed,))
        self.sent_bytes += len(data)
        return data

    @property
    def _is_due(self) -> bool:
        return bool(self._again) and self._clock() >= self._again[0][0]

    def reply_size(self, limit_bytes: int) -> int:
        """Bytes that ``take_replies`` would return."""
        total = 0
        for _, payload in self._shelf.values():
            size = len(payload) + self.overhead_bytes
            if total and total + size > limit_bytes:
                break
            total += size
        return total

    def take_replies(self, now_us: int, limit_bytes: int) -> bytes:
        """Frames of replies, as many as the limit holds, at least one."""
        taken: list[Packed] = []
        size, shelf = 0, self._shelf
        while shelf:
            first = next(iter(shelf.values()))
            size += self.size_of(first)
            if taken and size > limit_bytes:
                break
            taken.append(first)
            shelf.popitem(last=False)
        data = self._seal(taken)
        for packed in taken:
            self._arrives_us.pop(packed, None)
            self._arrives_us[packed] = now_us + self._way_us(len(data))
        while len(self._arrives_us) > _KEPT:
            self._arrives_us.popitem(last=False)
        self.sent_bytes += len(data)
        return data

    def drop_replies(self) -> None:
        """Give up what waits, as when the hour has no room for it: by the time it has, nobody waits any more."""
        self.dropped += len(self._shelf)
        self._shelf.clear()

    def take_beat(self) -> bytes:
        """The HEARTBEAT's frame."""
        beat, self.beat = self.beat, None
        data = b"" if beat is None else self._seal((beat,))
        self.sent_bytes += len(data)
        return data

    def take_news(self, now_us: int, limit_bytes: int) -> bytes:
        """Frames of what the vessel says by itself, the HEARTBEAT apart: as many as the limit holds, at least one."""
        taken: list[Packed] = []
        size = 0
        while (packed := self._next_news(now_us)) is not None:
            size += self.size_of(packed)
            if taken and size > limit_bytes:
                self._held = packed
                break
            taken.append(packed)
        data = self._seal(taken)
        self.sent_bytes += len(data)
        return data

    def _next_news(self, now_us: int) -> Packed | None:
        held, self._held = self._held, None
        if held is not None:
            return held
        if self._is_due:
            _, times, again = self._again.popleft()
            self._say_again(again, times, now_us)
            return again
        if self._news:
            news = self._news.popleft()
            if news[0] == _REACHED:
                self._say_again(news, _REACHED_TIMES, now_us)
            return news
        return self._streams.pop(next(iter(self._streams))) if self._streams else None

    def _say_again(self, packed: Packed, times: int, now_us: int) -> None:
        if times > 1:
            self._again.append((now_us + _REACHED_GAP_US, times - 1, packed))

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """All of it in order of importance, for a caller without manners of its own."""
        data = self.take_replies(now_us, limit_bytes) or self.take_beat()
        if not data and self.next_of_list(now_us) is not None:
            data = self.take_of_list()
        return data or self.take_news(now_us, limit_bytes)


def _key(packed: Packed) -> Key:
    """What a newer reply replaces: the same step of a plan's dialogue, the same command's acknowledgement to the same station."""
    message_id, payload = packed
    if message_id == COMMAND_ACK:
        return COMMAND_ACK, payload[:2], payload[8:]
    place = _KIND_AT.get(message_id)
    if place is None:
        return packed
    return message_id, payload[place] if len(payload) > place else 0
