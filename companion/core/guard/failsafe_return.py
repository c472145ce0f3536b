"""Return and the fence: when a return that the fence has stopped, or may stop, begins. Pure, like the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import Action

from .failsafe_barring import Acted
from .failsafe_entry import Entry, acting
from .failsafe_flags import Flags
from .failsafe_telling import Done

_REST_US: Final = 5_000_000
"""After the fence's stop a return begins again when the way is off: sooner, she would be stopped by what is left of it,"""
_DOUBLINGS: Final = 6
"""twice as long after each further stop, up to five minutes: in a channel too narrow for her she must not try for ever."""
_FORGOTTEN_US: Final = 300_000_000
"""One stop fewer counts after so long without any: what stopped her there need not stop her for the rest of a voyage."""

_TRIES: Final = 3
"""So often a return by order begins again: each stop sets a heavy boat out, in wind that sets outward by 3 m. After six of them she was
outside; there is somebody who can see that, and order her round."""


def broken_off(entry: Entry, now_us: int) -> Entry:
    """The fence stops a vessel that was returning. In Hold its flag comes and goes with each gust, and says nothing of the way."""
    off_us = None if entry.gone_us is None else now_us
    return replace(entry, again=_stops(entry, now_us) + 1, again_us=now_us, off_us=off_us)


def rest_us(fence: Entry, now_us: int) -> int | None:
    """How long a return still waits for the vessel that the fence has stopped; None = until no fence is ahead."""
    if fence.gone_us is None or fence.off_us is None:
        return None
    wait_us = _REST_US << min(max(_stops(fence, now_us) - 1, 0), _DOUBLINGS)
    return max(fence.off_us + wait_us - now_us, 0)


def back_as_ordered(done: Done, fence: Entry, acted: Sequence[Acted], flags: Flags, now_us: int) -> tuple[Done, Entry]:
    """A return by order that the fence has stopped goes on like the failsafe's own, until anything else but silence has stopped it.

    Returns what is done then, and what is remembered of the fence's row.
    """
    others = [(rule, entry) for rule, entry in acted if entry is not fence and not rule.row.station]
    if _stops(fence, now_us) > _TRIES or any(acting(*each, flags) > Action.WARN for each in others):
        return done, replace(fence, ordered_back=False)
    if done.action is Action.HOLD:  # a fence that stops her has the last word
        return replace(done, action=Action.RETURN, why="as ordered", name=""), fence
    return done, fence


def _stops(entry: Entry, now_us: int) -> int:
    return max(entry.again - (now_us - entry.again_us) // _FORGOTTEN_US, 0)
