"""Epochs: the sentences of one moment of a GNSS receiver put together into one ``GpsFix``.

Sentences are grouped by their UTC time. An epoch closes on the sentence that is learned to come last, on a new UTC,
on a repeated sentence, or after a time limit; what came until then is published with its validity. Late sentences
of a published epoch only feed the calendar. Each receiver of a line has a builder of its own (``nmea_receivers``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from mavlink_bridge.language.geodesy import MEAN_RADIUS_M
from mavlink_bridge.language.messages import FixType, GpsFix, Measurement, Source

from .fields import DAY_US, EpochPart, day_number

BODY_KINDS: Final = frozenset({"GGA", "GNS", "GLL", "RMC", "VTG"})
"""Sentences that may end an epoch. ZDA, GST and GSA come more slowly on many receivers, so they never do."""
_FIX_RANK: Final = {"GGA": 0, "GNS": 1, "RMC": 2, "GLL": 3}
_RANK_OF_GNS: Final = _FIX_RANK["GNS"]
_NO_RANK: Final = 9
"""Behind every sentence that has one."""
_NONE: Final = FixType.NONE
_HALF_DAY_US: Final = DAY_US // 2
"""Farther apart, two times of the day have midnight between them."""
_CALENDAR_AGE_MAX_US: Final = 3_600_000_000
"""The computer's clock carries a date on for an hour; after longer a day may have ended unseen."""
_ERA_DAYS: Final = 1024 * 7
"""GPS counts weeks modulo 1024: a receiver that takes the wrong turn is so far off, backwards or forwards."""
_LATEST_DAY: Final = day_number(2026 + 19, 1, 1)
"""Less than one such turn after this program was released (2026): a date from here on is rather a wrong turn than true."""
_LEARN_AFTER: Final = 2
"""Once may be chance, twice is how this receiver ends its epochs."""
_SAME_PLACE_M: Final = 1.0
"""What the sentences of one fix may be apart beside their last digits."""
SAME_MOMENT_US: Final = 6_000
"""Some receivers round the time of one sentence to hundredths of a second and of the next to thousandths; none measures at 100 Hz."""
_PAUSE_US: Final = 100_000
"""A sentence without a time and one with a time, so far apart, are not one epoch."""
_SPAN_MAX_US: Final = 1_500_000
"""No receiver takes longer to say one epoch: at 4800 baud 700 bytes."""
_QUALITY_HOLD_US: Final = 5_000_000
"""GSA and GST come every few seconds on many receivers."""


class Calendar:
    """Full UTC from times of day and the dates that arrive now and then (ZDA, RMC).

    Dates before ``earliest_day`` (1024-week roll-over, receivers that start in 1980) are refused, and so are those from
    ``latest_day`` on; see ``refused``.
    """

    def __init__(self, earliest_day: int) -> None:
        self.earliest_day = earliest_day
        self.latest_day = max(_LATEST_DAY, earliest_day + _ERA_DAYS)
        self.refused = False
        self._utc_us: int | None = None
        self._at_us = 0

    def utc_us(self, tod_us: int, day: int | None, now_us: int) -> int | None:
        """Return microseconds since 1970 for a time of day, with the date when the sentence has one."""
        if day is not None:
            self.refused = not self.earliest_day <= day < self.latest_day
            if self.refused:
                self._utc_us = None
                return None
            self._remember(day * DAY_US + tod_us, now_us)
            return self._utc_us
        if self._utc_us is None or now_us - self._at_us > _CALENDAR_AGE_MAX_US:
            return None
        expected = self._utc_us + now_us - self._at_us
        candidate = expected - expected % DAY_US + tod_us
        if candidate - expected > _HALF_DAY_US:
            candidate -= DAY_US
        elif expected - candidate > _HALF_DAY_US:
            candidate += DAY_US
        self._remember(candidate, now_us)
        return candidate

    def _remember(self, utc_us: int, now_us: int) -> None:
        self._utc_us = utc_us
        self._at_us = now_us


@dataclass(slots=True)
class _Open:
    """The epoch being collected."""

    first_us: int
    last_us: int = 0
    tod_us: int | None = None
    day: int | None = None
    kinds: tuple[str, ...] = ()
    rank: int = _NO_RANK
    fix_type: FixType | None = None
    lat_rad: float | None = None
    lon_rad: float | None = None
    step_m: float = 0.0
    no_fix: bool = False
    doubtful: bool = False
    vouched: bool = False
    dead_reckoning: bool = False
    simulated: bool = False
    height_msl_m: float | None = None
    geoid_separation_m: float | None = None
    satellites: int | None = None
    hdop: float | None = None
    vdop: float | None = None
    hacc_m: float | None = None
    vacc_m: float | None = None
    sog_mps: float | None = None
    cog_rad: float | None = None
    velocity_kind: str = ""


class EpochBuilder:
    """Collects ``EpochPart``s and returns finished fixes. Times are microseconds of the vessel's clock."""

    def __init__(self, *, limit_us: int, latency_us: int, calendar: Calendar, last_kind: str | None = None) -> None:
        self.limit_us = limit_us
        self.latency_us = latency_us
        self.calendar = calendar
        self.source: Source | None = None
        """Whose fixes they are."""
        self.late = 0
        self.partial = 0
        self._open: _Open | None = None
        self._closed: _Open | None = None
        self._ender = last_kind
        self._candidate = ("", 0)
        self._quality: tuple[FixType, int] | None = None
        self._mode: tuple[int | None, int] = (None, 0)
        """Dimensions that the last GSA says are solved for, and when it said so."""
        self._span_us = 0.0
        """How long the sentences of one moment take: a line of 4800 bit/s may need most of a second."""

    def add(self, part: EpochPart, now_us: int, found: list[Measurement]) -> None:
        """Take one sentence; append the fixes it finished (none, one, or two)."""
        if part.dimensions is not None:
            self._mode = (part.dimensions, now_us)
        current = self._open
        if current is None:
            if self._is_late(part, now_us):
                return
        elif _starts_new(current, part, now_us):
            self._finish(found, ended_by_kind=False)
            current = None
        if current is None:
            if part.tod_us is None and part.kind in ("GSA", self._ender):
                self.late += 1
                return  # the tail of an epoch that was lost belongs to no other one
            current = self._open = _Open(now_us)
        current.last_us = now_us
        if part.kind in BODY_KINDS:
            self._note_span(now_us - current.first_us)
        _merge(current, part)
        if part.kind == self._ender and current.rank < _NO_RANK:
            self._finish(found, ended_by_kind=True)

    def poll(self, now_us: int) -> list[Measurement]:
        """Close an epoch whose time limit has passed."""
        fixes: list[Measurement] = []
        if self._open is not None and now_us - self._open.first_us >= self._patience_us():
            self._finish(fixes, ended_by_kind=False)
        return fixes

    def _patience_us(self) -> float:
        """How long an epoch waits for its last sentence: the configured time, on a slow line what it has taken so far and a quarter."""
        learned_us = 1.25 * self._span_us + _PAUSE_US
        return learned_us if learned_us > self.limit_us and self._span_us > 0.5 * self.limit_us else self.limit_us

    def _note_span(self, span_us: int) -> None:
        self._span_us = min(max(0.99 * self._span_us, span_us), _SPAN_MAX_US)

    def _is_late(self, part: EpochPart, now_us: int) -> bool:
        closed = self._closed
        if closed is None:
            return False
        since_us = now_us - closed.first_us
        if since_us > (self._patience_us() if part.tod_us is None else _SPAN_MAX_US):
            return False
        if part.tod_us is None:
            # VTG or GSA after the epoch was closed without them.
            late = part.kind == "GSA" or (part.kind == "VTG" and self._ender not in (None, "VTG"))
        else:
            same = _same_moment(part.tod_us, closed.tod_us)
            late = same and part.kind not in closed.kinds and not _elsewhere(closed, part)
        if not late:
            return False
        self.late += 1
        if part.day is not None and part.tod_us is not None:
            self.calendar.utc_us(part.tod_us, part.day, now_us)
        if part.kind in BODY_KINDS:
            self._ender = part.kind
            self._note_span(since_us)
        return True

    def _finish(self, found: list[Measurement], *, ended_by_kind: bool) -> None:
        current = self._open
        assert current is not None
        self._open = None
        self._closed = current
        if not ended_by_kind:
            self._learn(current)
        utc_us = None
        if current.tod_us is not None:
            utc_us = self.calendar.utc_us(current.tod_us, current.day, current.first_us)
        if current.rank < _NO_RANK:
            self._keep_quality(current)
            complete = ended_by_kind or self._ender is None
            self.partial += not complete
            found.append(_publish(current, utc_us, current.first_us - self.latency_us, complete, self.source))

    def _keep_quality(self, current: _Open) -> None:
        """RMC and GLL without a mode letter cannot tell 2-D from RTK: the last GGA's quality stands for 5 s, or the last GSA's mode."""
        fix_type = current.fix_type
        if fix_type is None:
            return
        if current.rank <= _RANK_OF_GNS:
            if fix_type is FixType.FIX_3D and current.height_msl_m is None:
                fix_type = FixType.FIX_2D
            self._quality = (fix_type, current.first_us)
        elif fix_type is FixType.FIX_2D and not current.dead_reckoning:
            quality, at_us = self._quality or (_NONE, -_QUALITY_HOLD_US)
            if current.first_us - at_us < _QUALITY_HOLD_US:
                fix_type = max(quality, fix_type)
            elif self._solves_3d(current.first_us) and not current.simulated:
                fix_type = FixType.FIX_3D
        current.fix_type = fix_type

    def _solves_3d(self, now_us: int) -> bool:
        """Whether the last GSA, when there is one of the last 5 s, says that the receiver solves for three dimensions."""
        return self._mode[0] == 3 and now_us - self._mode[1] < _QUALITY_HOLD_US

    def _learn(self, current: _Open) -> None:
        body = [kind for kind in current.kinds if kind in BODY_KINDS]
        if not body:
            return
        last = body[-1]
        kind, times = self._candidate
        times = times + 1 if kind == last else 1
        self._candidate = (last, times)
        if times >= _LEARN_AFTER:
            self._ender = last


def _starts_new(current: _Open, part: EpochPart, now_us: int) -> bool:
    """True when a sentence does not belong to the epoch being collected."""
    other_time = part.tod_us is not None and not _same_moment(part.tod_us, current.tod_us)
    if other_time and (current.tod_us is not None or now_us - current.last_us > _PAUSE_US):
        return True
    return (part.kind in current.kinds and part.kind != "GSA") or _elsewhere(current, part)


def _same_moment(tod_us: int, other_us: int | None) -> bool:
    return other_us is not None and -SAME_MOMENT_US <= tod_us - other_us <= SAME_MOMENT_US


def _elsewhere(epoch: _Open, part: EpochPart) -> bool:
    """True when the sentence has another position than the epoch: talkers that count whole seconds reuse a time."""
    if part.lat_rad is None or part.lon_rad is None or epoch.lat_rad is None or epoch.lon_rad is None:
        return False
    if part.lat_rad == epoch.lat_rad and part.lon_rad == epoch.lon_rad:
        return False
    allowed_m = _SAME_PLACE_M + max(part.step_m, epoch.step_m)
    north_m = MEAN_RADIUS_M * (part.lat_rad - epoch.lat_rad)
    east_m = MEAN_RADIUS_M * math.cos(part.lat_rad) * (part.lon_rad - epoch.lon_rad)
    return abs(north_m) > allowed_m or abs(east_m) > allowed_m


def _merge(epoch: _Open, part: EpochPart) -> None:
    kind = part.kind
    epoch.kinds += (kind,)
    if part.tod_us is not None and not _same_moment(part.tod_us, epoch.tod_us):
        epoch.tod_us = part.tod_us
    if part.day is not None:
        epoch.day = part.day
    rank = _FIX_RANK.get(kind)
    if rank is not None:
        _merge_position(epoch, part, rank)
    if part.sog_mps is not None or part.cog_rad is not None:
        _merge_velocity(epoch, part)
    if part.vdop is not None:
        epoch.vdop = part.vdop
    if kind == "GST":
        epoch.hacc_m, epoch.vacc_m = part.hacc_m, part.vacc_m


def _merge_position(epoch: _Open, part: EpochPart, rank: int) -> None:
    if part.fix_type is _NONE:
        epoch.no_fix = True
    elif not part.doubtful:
        epoch.vouched = True
    if part.doubtful:
        epoch.doubtful = True
    if part.dead_reckoning:
        epoch.dead_reckoning = True
    if part.simulated:
        epoch.simulated = True
    if rank >= epoch.rank:
        return
    epoch.rank = rank
    epoch.fix_type = part.fix_type
    epoch.lat_rad, epoch.lon_rad = part.lat_rad, part.lon_rad
    epoch.step_m = part.step_m
    if rank <= _RANK_OF_GNS:
        epoch.height_msl_m = part.height_msl_m
        epoch.geoid_separation_m = part.geoid_separation_m
        epoch.satellites = part.satellites
        epoch.hdop = part.hdop


def _merge_velocity(epoch: _Open, part: EpochPart) -> None:
    """VTG wins over RMC: km/h has the finer step. A blank never wipes out a value."""
    wins = part.kind == "VTG" or epoch.velocity_kind != "VTG"
    if part.sog_mps is not None and (wins or epoch.sog_mps is None):
        epoch.sog_mps = part.sog_mps
    if part.cog_rad is not None and (wins or epoch.cog_rad is None):
        epoch.cog_rad = part.cog_rad
    if wins:
        epoch.velocity_kind = part.kind


def _publish(epoch: _Open, utc_us: int | None, t_us: int, complete: bool, source: Source | None) -> GpsFix:
    void = epoch.no_fix or epoch.fix_type is None or (epoch.doubtful and not epoch.vouched)
    if void or epoch.fix_type is None:
        return GpsFix(
            t_us,
            _NONE,
            utc_us=utc_us,
            satellites=epoch.satellites,
            hdop=epoch.hdop,
            vdop=epoch.vdop,
            hacc_m=epoch.hacc_m,
            vacc_m=epoch.vacc_m,
            dead_reckoning=epoch.dead_reckoning,
            simulated=epoch.simulated,
            complete=complete,
            source=source,
        )
    ellipsoid_m = None
    if epoch.height_msl_m is not None and epoch.geoid_separation_m is not None:
        ellipsoid_m = epoch.height_msl_m + epoch.geoid_separation_m
    return GpsFix(
        t_us=t_us,
        fix_type=epoch.fix_type,
        lat_rad=epoch.lat_rad,
        lon_rad=epoch.lon_rad,
        height_msl_m=epoch.height_msl_m,
        height_ellipsoid_m=ellipsoid_m,
        utc_us=utc_us,
        satellites=epoch.satellites,
        hdop=epoch.hdop,
        vdop=epoch.vdop,
        hacc_m=epoch.hacc_m,
        vacc_m=epoch.vacc_m,
        sog_mps=epoch.sog_mps,
        cog_rad=epoch.cog_rad,
        dead_reckoning=epoch.dead_reckoning,
        simulated=epoch.simulated,
        complete=complete,
        source=source,
    )
