"""Return and the fence: when a return that the fence has stopped, or may stop, begins. Pure, like the engine."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from .failsafe_entry import Entry

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


def is_given_up(fence: Entry, now_us: int) -> bool:
    """Whether the fence has stopped a return by order so often that it waits for another order."""
    return _stops(fence, now_us) > _TRIES


def _stops(entry: Entry, now_us: int) -> int:
    return max(entry.again - (now_us - entry.again_us) // _FORGOTTEN_US, 0)
