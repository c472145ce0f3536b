"""Which frames are copies that the network made, and which a sender means again that does not count its frames.

Two ways to one boat, or a router, deliver the very same bytes twice; a station that repeats itself counts on. Scripts and some radios
do not count: what they mean again has the same bytes too, and must not be lost in silence. So the very same bytes within a short time
are a copy, but for what stops the boat, which is obeyed each time it comes, and for orders and sticks that are their sender's newest of
their kind: those the services answer from memory, or they steer as before. Where frames are signed no sender can repeat one.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Final

from ...language.requests import SetMode
from ..commands.command import COMMAND_INT, COMMAND_LONG, Command, Refused
from ..commands.table import MEANINGS, Context
from ..persona.modes import from_custom_mode
from ..wire.codec import decode
from ..wire.framing import DuplicateFilter, Frame
from ..wire.payload import message_id

_SET_MODE: Final = message_id("SET_MODE")
_REPEATED: Final = frozenset((COMMAND_LONG, COMMAND_INT, _SET_MODE)) | frozenset(
    map(
        message_id,
        (
            "HEARTBEAT",
            "MANUAL_CONTROL",
            "RC_CHANNELS_OVERRIDE",
            "SET_POSITION_TARGET_GLOBAL_INT",
            "SET_POSITION_TARGET_LOCAL_NED",
            "SET_ATTITUDE_TARGET",
            "PARAM_SET",
        ),
    )
)
"""What nobody takes for two when it comes twice. Soundings and corrections are not among it: each counts by itself."""
_ANYWHERE: Final = Context(home_item=False, plan_length=0, plan_seq=0, psi_rad=None)
"""Whether a command stops the boat depends on nothing."""
_MAX_NEWEST: Final = 256
"""Senders times kinds: as many as the filter remembers frames."""


class Copies:
    """Of one channel. Bounded."""

    def __init__(self) -> None:
        self._filter = DuplicateFilter()
        self._newest: OrderedDict[tuple[int, int, int], int] = OrderedDict()
        """Sequence number of each sender's newest frame of a kind."""

    def is_copy(self, frame: Frame, now_us: int) -> bool:
        """Whether the very same bytes came a short time ago, and are not meant again."""
        if not self._filter.is_copy(frame, now_us):
            return False
        if frame.signed or frame.message_id not in _REPEATED:
            return True
        return self._newest.get(_kind(frame)) != frame.sequence and not _stops(frame)

    def remember(self, frame: Frame, now_us: int) -> None:
        """A frame that counts."""
        self._filter.remember(frame, now_us)
        kind = _kind(frame)
        self._newest.pop(kind, None)
        self._newest[kind] = frame.sequence
        if len(self._newest) > _MAX_NEWEST:
            self._newest.popitem(last=False)


def _kind(frame: Frame) -> tuple[int, int, int]:
    return frame.system, frame.component, frame.message_id


def _stops(frame: Frame) -> bool:
    """Whether a frame orders what stops the boat."""
    message = decode(frame) if frame.message_id in (COMMAND_LONG, COMMAND_INT, _SET_MODE) else None
    if message is None:
        return False
    if frame.message_id == _SET_MODE:
        mode = from_custom_mode(message.custom_mode) if message.base_mode & 1 else None
        return mode is not None and SetMode(mode).nature.stops
    command = Command.from_message(message)
    meaning = MEANINGS.get(command.id)
    try:
        body = None if meaning is None else meaning(command, _ANYWHERE)
    except Refused:
        return False
    return body is not None and body.nature.stops
