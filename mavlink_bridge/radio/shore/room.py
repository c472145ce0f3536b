"""How many items of a plan the radio can carry at best: more are refused before the first one is asked for."""

from __future__ import annotations

from ..air import Ledger, Priority, RadioProfile
from ..codec.plan import LEAST_BITS
from ..codec.wire import OVERHEAD
from ..transfer import PIECE_HEAD, most_bytes


def most_items(profile: RadioProfile) -> int:
    """By the time that an upload has, and by an hour in which nothing else was said; each item as short as one can be."""
    most = most_bytes(profile, round(profile.link.upload_s * 1e6))
    hour_us = Ledger(profile.hour_us, profile.stop_us).left_us(Priority.COMMAND, 0)
    if hour_us is not None:
        longest = profile.max_frame_bytes
        pieces = hour_us // profile.airtime_us(longest) + 1  # the last one may be shorter
        most = min(most, pieces * (longest - OVERHEAD - PIECE_HEAD))
    return 8 * most // LEAST_BITS
