"""Whether the air is clear of the other end's states: what comes and goes is told to their rhythm, and what is to go asks it first.

An end whose other one sends its states by no grid knows nothing of them, and everything is clear but for what is said twice.
"""

from __future__ import annotations

from typing import Final

from .air import AirClock
from .air.rhythm import HELD_LATE_US, TOLD_LATE_US, Rhythm
from .codec.erasure import MAX_PIECES
from .codec.frames import RadioFrame
from .codec.state import KEY_BYTES
from .codec.wire import OVERHEAD, Kind
from .patience import ANSWER_BYTES, Patience
from .transfer import PIECE_HEAD, POLL, Transfer
from .twice import Twice

_HEARD_US: Final = 40_000
"""From the end of a short packet to its last byte over there."""

_LAST: Final = 3
"""Not before the last so many pieces: a plan that is nearly over is not held up, and its answer tells the vessel's state."""
_SELDOM: Final = 2
"""Times the usual number of pieces, among those that make up for lost ones: there most of what is left free is lost too."""
_TICK_US: Final = 60_000
"""The state goes out at the vessel's next tick, or not in this room: later it would meet the next piece."""


class WayClear:
    """Turns packets of so many bytes into times on the air. ``rhythm``: the other end's grid of states, where it keeps one."""

    def __init__(self, clock: AirClock, patience: Patience) -> None:
        self._clock = clock
        self._patience = patience
        self._gap_us = round(clock.profile.link.gap_ms * 1e3)
        self.rhythm: Rhythm | None = None
        self.twice = Twice(clock, patience)
        self.slots = StateSlots(clock, patience)

    # ---- what is told -------------------------------------------------------------------------------------------

    def heard_answer(self, item: Transfer | None, size: int, now_us: int) -> None:
        """An answer of so many bytes has come, to ``item`` or to nothing that still waits: the other end listens for the next order, when
        it has said all of it.
        """
        again_us = self.twice.heard_answer(item, size, now_us)
        if self.rhythm is not None:
            written_us = self._clock.came_us(size, now_us)[0] - self._clock.line_us(size) + again_us
            until_us = written_us + self._patience.pause_us(size)
            late_us = TOLD_LATE_US if again_us else HELD_LATE_US
            self.rhythm.answered(min(self._clock.off_us, now_us), until_us, late_us=late_us)

    def answered(self, item: Transfer) -> None:
        """That was the answer to this message."""
        if self.rhythm is not None and item.kind is Kind.PLAN and item.tries > 1:
            self.rhythm.may_come_later()

    def gave_answer(self, now_us: int) -> None:
        """Our answer goes out: what fell due while the other end told something comes when it has that."""
        if self.rhythm is not None:
            asked_us, heard_us = now_us - self._patience.longest_us(), self._clock.off_us + _HEARD_US
            self.rhythm.answered(asked_us, heard_us, late_us=TOLD_LATE_US)

    def not_answered(self, item: Transfer, now_us: int) -> None:
        """No answer to a message was heard in time."""
        if item.kind is not Kind.PLAN:
            # a plan may have been stored slowly
            self.twice.not_answered(now_us)
        if self.rhythm is not None:
            self.rhythm.unanswered(item.off_us)

    # ---- what is asked ------------------------------------------------------------------------------------------

    @property
    def other_until_us(self) -> int:
        """So long the other end is to say something for which we left it the air."""
        return max(self.twice.other_until_us, self.slots.until_us)

    def is_quiet(self, now_us: int) -> bool:
        """Whether the other end listens for an order: what need not be said now would be in its way."""
        return self.rhythm is not None and self.rhythm.is_quiet(now_us)

    def has_room(self, size: int, now_us: int) -> bool:
        """Whether what need not be said now leaves an order that comes meanwhile its place before the next state."""
        room_us = self._gap_us + self._clock.span_us(ANSWER_BYTES)
        return not self.meets(size, now_us, room_us=room_us)

    def meets(self, size: int, now_us: int, *, hurries: bool = False, room_us: int = 0) -> bool:
        """Whether a write now, and ``room_us`` after it, would overlap a state of the other end. ``hurries``: see ``Rhythm.meets``."""
        end_us = now_us + self._clock.span_us(size)
        start_us = end_us - self._clock.airtime_us(size)
        return self.rhythm is not None and self.rhythm.meets(start_us, end_us + room_us, hurries=hurries)


class StateSlots:
    """Room for the vessel's states in a long message: after some of its pieces the shore listens, and both ends tell after which.

    While pieces follow one another the vessel cannot speak: what it says meets the next piece, and neither is heard. Nothing of this is on
    the air but the pieces' own numbers, so an end that knows nothing of it gets every message all the same. Where states come in batches
    there is none.
    """

    def __init__(self, clock: AirClock, patience: Patience) -> None:
        profile = clock.profile
        self._clock, self._patience = clock, patience
        period = round(profile.link.state_s * 1e6 / clock.span_us(profile.max_frame_bytes))
        self._every = max(period, 1) if profile.link.batch == 1 else 0
        self.until_us = 0
        """So long the other end may be telling its state: who talks does not hear it."""
        self._heard_us: int | None = None
        """When a piece came after which the other end listens."""

    def _follows(self, body: bytes) -> bool:
        """Whether the vessel may speak after this piece. After one that asks it answers."""
        if not self._every or len(body) <= PIECE_HEAD or body[2] & POLL:
            return False
        row, count = body[1], (body[2] & (POLL - 1)) + 1
        if row >= MAX_PIECES:
            return (row - MAX_PIECES) % (_SELDOM * self._every) == self._every - 1
        return row % self._every == self._every - 1 and row < count - _LAST

    def sent(self, item: Transfer, body: bytes) -> None:
        """A piece goes out from the shore: listen after it. The time that this takes is none of the message's own."""
        if item.is_single or not self._follows(body):
            return
        listens_us = self._patience.turnaround_us + self._clock.span_us(KEY_BYTES + OVERHEAD)
        self.until_us = self._clock.off_us + listens_us
        item.deadline_us += listens_us

    def heard(self, frame: RadioFrame, now_us: int) -> None:
        """Something came: the shore need not listen any longer, and the vessel has room behind some pieces."""
        self.until_us = min(self.until_us, now_us)
        self._heard_us = now_us if frame.kind is Kind.PIECE and self._follows(frame.body) else None

    def is_open(self, now_us: int) -> bool:
        """Whether the vessel's state goes now or not at all."""
        return self._heard_us is not None and 0 <= now_us - self._heard_us <= _TICK_US
