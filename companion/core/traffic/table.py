"""All that is heard, in one table: who, where, under which number; doubles, jumps, repeats and floods dealt with.

One number may be two vessels, or one that seems to jump: both places are held until three reports in a row agree. A report that is
heard twice, or sent on by a relay, never makes a track younger. At most 256 tracks: the farthest that opens goes first; one that is
near goes after all that are far, then who may hit us, and a person's beacon last of all. Of beacons the 32 nearest are kept.
Tracks are ordered by number, then by age, so that a replay is bit for bit the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from mavlink_bridge.language.traffic import Sides
from mavlink_bridge.language.value import value

from ..ais.identity import DISTRESS, station_of
from ..ais.reports import PositionReport, StaticReport, StationClass
from .track import Track, offset_m

TRACKS_MAX: Final = 256
"""A crowded roadstead; more is a flood, and the far ones go."""
BEACONS_MAX: Final = 32
"""A lifeboat's crew; more are forged, and what is never given up for a ship must leave room for ships."""
_NEAR_M: Final = 2000.0
"""From here a ship of 10 m/s is on us within the look-ahead: that her distance opens now is no reason to forget her."""
_STATICS_MAX: Final = 512
"""Names come every six minutes, also of vessels that have no track yet."""
BELIEVED_AGE_S: Final = 10.0
"""A UTC second older than this belongs to a receiver's wrong clock, not to latency."""
_UNTIMED_AGE_S: Final = 1.5
"""Mean age of a report whose second is unknown: slot, receiver and line."""
_REPEAT_US: Final = 2_000_000
"""A repeater says a report again within this."""
_SAME_FIX_US: Final = 50_000_000
"""The same UTC second comes again after a minute, not before."""
_JUMP_M: Final = 100.0
"""A position this far off its track is no noise."""
_JUMP_MPS: Final = 10.0
"""And what she makes between two reports is no more than this, unless she says that she is faster."""
_AGREE: Final = 3
"""So many reports that agree make a track, or prove a second vessel with the same number."""
PERSON_LIFE_S: Final = 6 * 3600.0
"""A beacon's battery lasts days; who searches must not lose it."""
_LIFE_INTERVALS: Final = 3.5
"""Three reports lost in a row happen to one vessel in a hundred and twenty-five at a loss of one in five."""


@value
class Static:
    """What a vessel says of herself."""

    name: str = ""
    callsign: str = ""
    ship_type: int = 0
    sides: Sides | None = None


NO_STATIC: Final = Static()


class JudgedTrack:
    """A track with what the judge last saw of it."""

    __slots__ = ("close_again_us", "confirmed", "due_us", "in_danger", "opening", "range_m", "since_other", "track")

    def __init__(self, track: Track) -> None:
        self.track = track
        self.due_us = 0
        """When she is to be looked at again."""
        self.close_again_us = 0
        """Before this she is not told as close again."""
        self.range_m = math.inf
        self.opening = False
        self.in_danger = False
        """She may hit us."""
        self.since_other = 0
        """Reports since her double last had one."""
        self.confirmed = True
        """False: a place that few reports speak for, under a number that is known elsewhere."""


class Table:
    """Tracks and names. Never raises; memory is bounded."""

    def __init__(self, life_s: float) -> None:
        self.life_s = life_s
        self._entries: dict[int, list[JudgedTrack]] = {}
        self._statics: dict[int, Static] = {}
        self.repeats = 0
        self.dropped = 0
        """Vessels for which there was no room."""
        self.count = 0

    def __iter__(self) -> Iterator[JudgedTrack]:
        for mmsi in sorted(self._entries):
            yield from self._entries[mmsi]

    def of(self, mmsi: int) -> list[JudgedTrack]:
        return self._entries.get(mmsi, [])

    def static_of(self, mmsi: int) -> Static:
        return self._statics.get(mmsi, NO_STATIC)

    def take_static(self, report: StaticReport) -> None:
        """Remember what a report says; what it leaves out stays."""
        known = self._statics.pop(report.mmsi, NO_STATIC)
        self._statics[report.mmsi] = replace(
            known,
            name=report.name or known.name,
            callsign=report.callsign or known.callsign,
            ship_type=report.ship_type or known.ship_type,
            sides=report.dimensions or known.sides,
        )
        if len(self._statics) > _STATICS_MAX:
            idle = next((mmsi for mmsi in self._statics if mmsi not in self._entries), next(iter(self._statics)))
            del self._statics[idle]

    def take_position(
        self, report: PositionReport, now_us: int, utc_us: int | None, own: tuple[float, float] | None
    ) -> JudgedTrack | None:
        """Take a report with a position; return whose it is, None when it is no news or there is no room.

        ``utc_us``: UTC now, if known; ``own``: our latitude and longitude, rad, for who is dropped in a flood.
        """
        t_us, timed = _when(report, now_us, utc_us)
        if self._is_outdone(report):
            return None
        entries = self._entries.get(report.mmsi, [])
        if any(_is_repeat(entry.track, report, t_us, now_us) for entry in entries):
            self.repeats += 1
            return None
        near = [entry for entry in entries if _fits(entry.track, report, t_us)]
        if near:
            entry = near[0]
            entry.track.update(report, max(t_us, entry.track.t_us + 1), timed=timed)
        else:
            made = self._begin(report, t_us, own, timed=timed)
            if made is None:
                return None
            entry = made
        self._agree(report.mmsi, entry)
        entry.due_us = 0
        return entry

    def _is_outdone(self, report: PositionReport) -> bool:
        """Whether a coarse report is of a vessel that is known exactly: it says nothing new. An exact one ends what was known coarsely."""
        entries = self._entries.get(report.mmsi, [])
        if report.sent is StationClass.LONG_RANGE:
            return any(entry.track.report.sent is not StationClass.LONG_RANGE for entry in entries)
        for entry in [entry for entry in entries if entry.track.report.sent is StationClass.LONG_RANGE]:
            self.drop(entry)
        return False

    def _begin(
        self, report: PositionReport, t_us: int, own: tuple[float, float] | None, *, timed: bool
    ) -> JudgedTrack | None:
        """Open a track at a place where none is; the weaker of two gives way to a third."""
        entries = self._entries.setdefault(report.mmsi, [])
        fresh = JudgedTrack(Track(report, t_us, timed=timed))
        if own is not None:
            assert report.lat_rad is not None
            assert report.lon_rad is not None
            fresh.range_m = math.hypot(*offset_m(*own, report.lat_rad, report.lon_rad))
        if len(entries) >= 2:
            weak = min(entries, key=lambda entry: (entry.confirmed, entry.track.t_us))
            entries.remove(weak)
            self.count -= 1
        elif not self._make_room(fresh):
            if not entries:
                del self._entries[report.mmsi]
            self.dropped += 1
            return None
        entries = self._entries.setdefault(report.mmsi, entries)  # the room may have been her own other place's
        fresh.confirmed = not entries
        entries.append(fresh)
        self.count += 1
        return fresh

    def _make_room(self, fresh: JudgedTrack) -> bool:
        """Drop who matters least where there is no room; False when the new one matters no more."""
        rivals = self._rivals(fresh)
        if not rivals:
            return True
        worst = max(rivals, key=_spared)
        if _spared(fresh) >= _spared(worst):
            return False
        self.drop(worst)
        self.dropped += 1
        return True

    def _rivals(self, fresh: JudgedTrack) -> list[JudgedTrack]:
        """Of whom one must go before there is room for a new one."""
        entries = [entry for each in self._entries.values() for entry in each]
        if is_beacon(fresh.track.mmsi):
            beacons = [entry for entry in entries if is_beacon(entry.track.mmsi)]
            if len(beacons) >= BEACONS_MAX:
                return beacons
        return entries if self.count >= TRACKS_MAX else []

    def _agree(self, mmsi: int, entry: JudgedTrack) -> None:
        """Let three reports in a row decide between two places."""
        others = [other for other in self._entries[mmsi] if other is not entry]
        entry.since_other += 1
        for other in others:
            other.since_other = 0
            if entry.since_other >= _AGREE and not (other.confirmed and entry.confirmed):
                self.drop(other)
        if entry.track.reports >= _AGREE:
            entry.confirmed = True

    def drop(self, entry: JudgedTrack) -> None:
        """Forget a track."""
        entries = self._entries[entry.track.mmsi]
        entries.remove(entry)
        self.count -= 1
        if not entries:
            del self._entries[entry.track.mmsi]

    def forget_number(self, mmsi: int) -> None:
        """Forget all under a number."""
        self.count -= len(self._entries.pop(mmsi, []))

    def every_s(self) -> float:
        """The interval of who must report most often, 0 when nobody is known."""
        return min((entry.track.interval_s() for entry in self), default=0.0)

    def is_over(self, entry: JudgedTrack, now_us: int) -> bool:
        """Whether a track has not been heard of for so long that it is none."""
        track = entry.track
        life_s = max(self.life_s, _LIFE_INTERVALS * track.interval_s())
        if is_beacon(track.mmsi):
            life_s = PERSON_LIFE_S
        return track.age_s(now_us) > life_s


def is_beacon(mmsi: int) -> bool:
    """Whether a number is that of a distress beacon."""
    return station_of(mmsi) in DISTRESS


def _spared(entry: JudgedTrack) -> tuple[bool, bool, bool, bool, float]:
    """The order in which tracks are given up in a flood: the greatest first."""
    is_far = entry.range_m > _NEAR_M
    return not is_beacon(entry.track.mmsi), not entry.in_danger, is_far, is_far and entry.opening, entry.range_m


def fix_age_s(report: PositionReport, utc_us: int | None) -> float | None:
    """How long ago her fix was by its UTC second, below a minute; None where one of the two is not known."""
    return None if report.second is None or utc_us is None else (utc_us * 1e-6 - report.second) % 60.0


def _when(report: PositionReport, now_us: int, utc_us: int | None) -> tuple[int, bool]:
    """When she was there: by the UTC second of her fix where that can be believed."""
    age_s = fix_age_s(report, utc_us)
    if age_s is not None and age_s <= BELIEVED_AGE_S:
        return now_us - round(age_s * 1e6), True
    return now_us - round(_UNTIMED_AGE_S * 1e6), False


def _is_repeat(track: Track, report: PositionReport, t_us: int, now_us: int) -> bool:
    """Whether a report says what the last one said, or is older."""
    last = track.report
    if (last.lat_rad, last.lon_rad, last.second) != (report.lat_rad, report.lon_rad, report.second):
        return t_us < track.t_us - _REPEAT_US
    if (last.sog_mps, last.cog_rad) != (report.sog_mps, report.cog_rad):
        return False
    gap_us = now_us - track.t_us
    return gap_us <= _REPEAT_US + round(_UNTIMED_AGE_S * 1e6) or (
        gap_us <= _SAME_FIX_US and (report.second is not None or report.repeat > 0)
    )


def _fits(track: Track, report: PositionReport, t_us: int) -> bool:
    """Whether she can have come from where she was."""
    assert report.lat_rad is not None
    assert report.lon_rad is not None
    gap_s = max(0.0, (t_us - track.t_us) * 1e-6)
    jump_m = math.hypot(*offset_m(track.lat_rad, track.lon_rad, report.lat_rad, report.lon_rad))
    return jump_m <= max(track.sog_mps or 0.0, _JUMP_MPS) * gap_s + _JUMP_M
