"""What ends without an order where nobody is there to give one: the station is silent, and its silence brings the vessel home. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.messages import Action
from mavlink_bridge.language.value import value

from .failsafe_config import FailsafeConfig, Rule
from .failsafe_entry import Entry, wanted
from .failsafe_telling import STEADY_US

_MOST: Final = 3
"""A sensor that is lost again and again is not sound though it is back each time: each wait is twice the last, and then none ends."""
_LONGEST_US: Final = STEADY_US << (_MOST - 1)
"""What stays away for no longer than the longest wait is not sound meanwhile: that time does not count."""
_FORGOTTEN_US: Final = 600_000_000
"""An end counts for so long of sound time: a sensor that has a bad second at times must not be the end of a voyage."""

_LET_GO_US: Final = 10_000_000
"""Sticks that are silent for so long have been let go, as those that nobody ever moved: until then a link may have a bad moment."""


@value
class Ends:
    """How one condition has ended without an order."""

    at_us: tuple[int, ...] = ()
    """The ends that count, by the clock of the time in which the cause was soundly away."""
    sound_us: int = 0
    """What that clock had come to when the cause last stood,"""
    stood_us: int = 0
    """and when that was."""


def nobody_orders(entries: Mapping[str, Entry], config: FailsafeConfig) -> bool:
    """Whether the station has been silent for so long that the vessel is to return: what waits for its order waits for ever."""
    return any(
        rule.row.station
        and (entry := entries.get(rule.row.name)) is not None
        and entry.fired_us is not None
        and entry.gone_us is None
        and wanted(rule, entry) is Action.RETURN
        and not entry.taken
        for rule in config.rules
    )


def ended(ends: Ends | None, entry: Entry, now_us: int) -> Ends:
    """A condition ends without an order."""
    assert entry.gone_us is not None
    ends = ends or Ends(stood_us=entry.gone_us)
    return replace(ends, at_us=(*_counting(ends, now_us), _sound_us(ends, now_us)))


def stands(ends: Ends, now_us: int) -> Ends:
    """The cause of a condition that has ended so stands again."""
    return Ends(_counting(ends, now_us), _sound_us(ends, now_us), now_us)


def lets_go_in_us(rule: Rule, entry: Entry, ends: Ends | None, now_us: int) -> int | None:
    """In how long a condition lets a return go on without an order, if its cause stays as it is; 0 = now, None = never.

    One that says that nobody steers gives way while it stands; one whose cause is gone ends.
    """
    if rule.row.gives_way and entry.fired_us is not None:
        return max(entry.fired_us + _LET_GO_US - now_us, 0)
    if entry.gone_us is None or not rule.row.ends_alone:
        return None
    counting, left_us = (() if ends is None else _counting(ends, now_us)), 0
    if ends is not None and len(counting) >= _MOST:
        left_us = counting[-_MOST] + _FORGOTTEN_US - _sound_us(ends, now_us)
        left_us += max(ends.stood_us + _LONGEST_US - now_us, 0)
    wait_us = max(rule.clear_us, STEADY_US) << min(len(counting), _MOST - 1)
    return max(left_us, entry.gone_us + wait_us - now_us, 0)


def _counting(ends: Ends, now_us: int) -> tuple[int, ...]:
    sound_us = _sound_us(ends, now_us)
    return tuple(at_us for at_us in ends.at_us if sound_us - at_us < _FORGOTTEN_US)


def _sound_us(ends: Ends, now_us: int) -> int:
    return ends.sound_us + max(now_us - ends.stood_us - _LONGEST_US, 0)
