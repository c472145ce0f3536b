"""What a report is about, whatever it was read from: time series, tracks, spans of states, events, links, plan."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from mavlink_bridge.language.requests import PlanItem

from .sightings import Sighting

Count = Callable[[int], None]
"""Told how many bytes more of the files have been gone through."""


def uncounted(_: int) -> None:
    """Nobody wants to know how far the reading is."""


@dataclass(slots=True)
class Series:
    """Values over time; NaN where unknown. Times in seconds since the start."""

    t: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)

    def add(self, t_s: float, value: float | None) -> None:
        self.t.append(t_s)
        self.v.append(math.nan if value is None else value)

    def known(self) -> list[float]:
        """Values that are known."""
        return [value for value in self.v if not math.isnan(value)]

    def __bool__(self) -> bool:
        return any(not math.isnan(value) for value in self.v)


@dataclass(slots=True)
class FlightTrack:
    """Positions over time, degrees; only known ones."""

    t: list[float] = field(default_factory=list)
    lat: list[float] = field(default_factory=list)
    lon: list[float] = field(default_factory=list)

    def add(self, t_s: float, lat_deg: float, lon_deg: float) -> None:
        """Add a position; what is none (a damaged line) is left out."""
        if abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0:
            self.t.append(t_s)
            self.lat.append(lat_deg)
            self.lon.append(lon_deg)

    def at(self, t_s: float) -> tuple[float, float]:
        """The position at a time: the first that is not earlier, else the last."""
        index = min(bisect.bisect_left(self.t, t_s), len(self.t) - 1)
        return self.lat[index], self.lon[index]

    def __bool__(self) -> bool:
        return len(self.t) > 1


@dataclass(slots=True)
class Span:
    """A state that held from ``start`` to ``end``."""

    start: float
    end: float
    value: str


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened."""

    t_s: float
    kind: str
    text: str
    severity: str = "INFO"
    """A MAV_SEVERITY name."""


@dataclass(slots=True)
class LinkStats:
    """Traffic on one telemetry link."""

    name: str
    frames_out: int = 0
    frames_in: int = 0
    bytes_out: int = 0
    bytes_in: int = 0
    lost_out: int = 0
    """Gaps in the vessel's own sequence numbers as logged."""
    lost_in: int = 0
    per_second: dict[int, list[int]] = field(default_factory=dict)
    """Second -> [bytes out, bytes in]."""

    def add(self, t_s: float, size: int, outgoing: bool) -> None:
        slot = self.per_second.setdefault(int(t_s), [0, 0])
        slot[0 if outgoing else 1] += size
        if outgoing:
            self.frames_out += 1
            self.bytes_out += size
        else:
            self.frames_in += 1
            self.bytes_in += size


@dataclass(slots=True)
class Flight:
    """All that a report shows."""

    title: str
    source: str
    duration_s: float = 0.0
    about: dict[str, str] = field(default_factory=dict)
    series: dict[str, Series] = field(default_factory=dict)
    tracks: dict[str, FlightTrack] = field(default_factory=dict)
    spans: dict[str, list[Span]] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    vessels: list[Sighting] = field(default_factory=list)
    """Other vessels with risk, as the events have them."""
    links: list[LinkStats] = field(default_factory=list)
    plan: tuple[PlanItem, ...] = ()
    fence: tuple[PlanItem, ...] = ()
    rally: tuple[PlanItem, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What could not be read."""
    not_whole: str = ""
    """What of the recording is damaged or was not kept; empty = all of it is as the run left it, or nobody knows."""
    airtime_limit_s: float | None = None
    """What the band allows the vessel's radio in an hour; None = no limit, or no radio."""
    gap_s: float | None = None
    """Longest time between two control ticks."""
    position_share: float | None = None
    """Of the time under arms, or of all where it was never armed, for which a position was known."""

    def of(self, name: str) -> Series:
        """The series ``name``, made when new."""
        return self.series.setdefault(name, Series())

    def say(self, kind: str, t_s: float, value: str) -> None:
        """Extend the spans of ``kind`` with ``value`` at ``t_s``."""
        spans = self.spans.setdefault(kind, [])
        if spans:
            spans[-1].end = t_s
        if not spans or spans[-1].value != value:
            spans.append(Span(t_s, t_s, value))

    def seconds_in(self, kind: str, values: Iterable[str]) -> float:
        """How long ``kind`` had one of ``values``."""
        wanted = set(values)
        return sum(span.end - span.start for span in self.spans.get(kind, []) if span.value in wanted)


def percentile(values: Sequence[float], share: float) -> float:
    """The value below which ``share`` (0...1) of ``values`` lie; NaN of none."""
    if not values:
        return math.nan
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def rms(values: Sequence[float]) -> float:
    """Root mean square; NaN of none."""
    return math.sqrt(sum(value * value for value in values) / len(values)) if values else math.nan


def thin(t: Sequence[float], v: Sequence[float], most: int = 1200) -> tuple[list[float], list[float]]:
    """Thin a curve for drawing to about ``most`` points; every bucket keeps its lowest and its highest value."""
    if len(t) <= most:
        return list(t), list(v)
    width = max(1, 2 * len(t) // most)
    out_t: list[float] = []
    out_v: list[float] = []
    for start in range(0, len(t), width):
        bucket = range(start, min(start + width, len(t)))
        known = [index for index in bucket if not math.isnan(v[index])]
        if not known:
            out_t.append(t[start])
            out_v.append(math.nan)
            continue
        picks = {min(known, key=v.__getitem__), max(known, key=v.__getitem__)}
        for index in sorted(picks):
            out_t.append(t[index])
            out_v.append(v[index])
    return out_t, out_v
