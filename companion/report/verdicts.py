"""Pass or fail: a flight against limits, one line each, with the figure and what it was held against."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from .flight import Flight, Series, percentile, rms

_AT_REST_MPS: Final = 0.1
"""Slower than this is a receiver's noise."""
WORDS: Final = {True: "ok", False: "not ok", None: ""}
"""How a verdict is said. Not "holds": Hold is a mode."""
_PAUSE_S: Final = 5.0
"""A longer time between two speeds is a gap in the log."""


@dataclass(frozen=True, slots=True)
class RunLimits:
    """What a good run keeps. Change them with ``companion report --limit name=value``."""

    cross_track_p95_m: float = 1.5
    """95 % of the time on a line, no farther from it."""
    radius_p95_m: float = 1.5
    """95 % of the time on a circle, no farther from it."""
    heading_rms_deg: float = 8.0
    speed_rms_mps: float = 0.2
    saturation_share: float = 0.2
    """Share of the time that an actuator is at its end."""
    position_p95_m: float = 1.0
    """Estimate against the simulator's truth."""
    position_share: float = 0.95
    """Share of the time under arms for which a position is known."""
    link_loss_share: float = 0.02
    gap_s: float = 0.25
    """Longest time between two control ticks."""


@dataclass(frozen=True, slots=True)
class SummaryLine:
    """One line of the summary. ``ok`` None: a figure without a limit."""

    name: str
    value: str
    limit: str = ""
    ok: bool | None = None


def judge(flight: Flight, limits: RunLimits) -> list[SummaryLine]:
    """Hold a flight against limits; what the source does not tell is left out."""
    return [
        *_figures(flight, limits),
        *_path(flight, limits),
        *_control(flight, limits),
        *_depth(flight),
        *_actuators(flight, limits),
        *_health(flight, limits),
    ]


def _figures(flight: Flight, limits: RunLimits) -> Iterator[SummaryLine]:
    if flight.not_whole:
        yield SummaryLine("Recording", flight.not_whole, "all of it", False)
    yield SummaryLine("Duration", clock(flight.duration_s))
    sailed_m = distance_m(flight)
    if sailed_m is not None:
        yield SummaryLine("Distance sailed", f"{sailed_m:.0f} m")
    armed_s = flight.seconds_in("armed", ["armed"])
    if "armed" in flight.spans:
        yield SummaryLine("Armed", clock(armed_s))
    if flight.position_share is not None:
        share, least = flight.position_share, limits.position_share
        is_ok = share >= least if armed_s > 0.0 or share == 0.0 else None
        yield SummaryLine("Position known", f"{100.0 * share:.1f} % of the time", f"≥ {100 * least:.0f} %", is_ok)
    states = flight.spans.get("plan_state")
    if states and any(span.value == "active" for span in states):
        last = states[-1].value
        yield SummaryLine("Plan at the end", last, "complete", last == "complete")


def _path(flight: Flight, limits: RunLimits) -> Iterator[SummaryLine]:
    lines, circles = split_cross_track(flight)
    for name, series, limit in (
        ("Cross-track error on lines, 95 %", lines, limits.cross_track_p95_m),
        ("Radius error on circles, 95 %", circles, limits.radius_p95_m),
    ):
        if series:
            yield _at_most(name, percentile([abs(value) for value in series.known()], 0.95), limit, "m", 2)


def split_cross_track(flight: Flight) -> tuple[Series, Series]:
    """Cross-track error on lines, and on circles (where it is the radius error); the way to a path is left out."""
    error, radius = flight.series.get("cross_track_m"), flight.series.get("orbit_radius_m")
    on_path = flight.series.get("on_path")
    lines, circles = Series(), Series()
    if error is None or not any(error.known()):
        return lines, circles
    for index, (t_s, value) in enumerate(zip(error.t, error.v, strict=True)):
        on_circle = radius is not None and not math.isnan(radius.v[index])
        if on_path is not None and on_path.v[index] == 0.0:
            value = math.nan
        lines.add(t_s, math.nan if on_circle else value)
        circles.add(t_s, value if on_circle else math.nan)
    return lines, circles


def _control(flight: Flight, limits: RunLimits) -> Iterator[SummaryLine]:
    heading, speed = flight.series.get("heading_error_deg"), flight.series.get("speed_error_mps")
    if heading:
        yield _at_most("Heading error, RMS", rms(heading.known()), limits.heading_rms_deg, "°", 2)
    if speed:
        yield _at_most("Speed error, RMS", rms(speed.known()), limits.speed_rms_mps, "m/s", 3)
    error = estimate_error_m(flight)
    if error:
        yield _at_most("Position error of the estimate, 95 %", percentile(error.v, 0.95), limits.position_p95_m, "m", 3)


def _depth(flight: Flight) -> Iterator[SummaryLine]:
    if flight.settings.get("depth", {}).get("enabled") is False:
        yield SummaryLine("Depth guard", "switched off in the settings")
    altitude, limit = flight.series.get("altitude_m"), flight.series.get("altitude_limit_m")
    if altitude and limit:
        least, kept = min(altitude.known()), percentile(limit.known(), 0.5)
        yield SummaryLine("Least water under the keel", f"{least:.2f} m", f"≥ {kept:.2f} m", least >= kept)
    elif flight.series.get("depth_m"):
        yield SummaryLine("Least depth", f"{least_depth_m(flight.series['depth_m']):.2f} m")


def least_depth_m(depth: Series) -> float:
    """The least depth that lasted: medians over each second, then over five of them, as a double echo or a fish is no bottom."""
    seconds: dict[int, list[float]] = {}
    for t_s, value in zip(depth.t, depth.v, strict=True):
        if not math.isnan(value):
            seconds.setdefault(int(t_s), []).append(value)
    medians = [statistics.median(values) for _, values in sorted(seconds.items())]
    width = min(5, len(medians))
    return min(statistics.median(medians[at : at + width]) for at in range(len(medians) - width + 1))


def _actuators(flight: Flight, limits: RunLimits) -> Iterator[SummaryLine]:
    names = ("thruster_port", "thruster_starboard")
    found = [flight.series[name].known() for name in names if name in flight.series]
    if found:
        at_end = [abs(value) >= 0.999 for values in found for value in values]
        share = sum(at_end) / len(at_end)
        limit = limits.saturation_share
        yield SummaryLine("Thrusters at their end", f"{100 * share:.1f} %", f"≤ {100 * limit:.0f} %", share <= limit)


def _health(flight: Flight, limits: RunLimits) -> Iterator[SummaryLine]:
    actions = flight.spans.get("action")
    if actions:
        worst = [span.value for span in actions if span.value not in ("NONE", "WARN")]
        yield SummaryLine("Failsafe actions", ", ".join(sorted(set(worst))) or "none", "none", not worst)
    bad = [event for event in flight.events if event.severity in ("EMERGENCY", "ALERT", "CRITICAL", "ERROR")]
    yield SummaryLine("Messages of error or worse", str(len(bad)), "0", not bad)
    if flight.gap_s is not None:
        yield _at_most("Longest time between ticks", flight.gap_s, limits.gap_s, "s", 3)
    airtime, allowed = flight.series.get("airtime_hour_s"), flight.airtime_limit_s
    if airtime and allowed is not None:
        yield _at_most("Airtime in the fullest hour", max(airtime.known()), allowed, "s", 1)
    for link in flight.links:
        sent = link.frames_out + link.lost_out
        if sent > 20:
            share = link.lost_out / sent
            text = f"{100 * share:.2f} % of {sent}"
            limit = f"≤ {100 * limits.link_loss_share:.0f} %"
            yield SummaryLine(f"Vehicle frames missing on {link.name}", text, limit, share <= limits.link_loss_share)


def _at_most(name: str, value: float, limit: float, unit: str, digits: int) -> SummaryLine:
    return SummaryLine(name, f"{value:.{digits}f} {unit}", f"≤ {limit:g} {unit}", value <= limit)


def estimate_error_m(flight: Flight) -> Series:
    """Distance between estimate and truth at equal times."""
    found = Series()
    estimate, truth = flight.tracks.get("estimate"), flight.tracks.get("truth")
    if not estimate or not truth:
        return found
    at = {round(t_s, 3): index for index, t_s in enumerate(truth.t)}
    for index, t_s in enumerate(estimate.t):
        match = at.get(round(t_s, 3))
        if match is not None:
            north, east = offset_m(truth.lat[match], truth.lon[match], estimate.lat[index], estimate.lon[index])
            found.add(t_s, math.hypot(north, east))
    return found


def offset_m(lat0: float, lon0: float, lat: float, lon: float) -> tuple[float, float]:
    """Metres north and east of a near point, degrees in; for drawing and for sums of short steps (WGS-84 series)."""
    phi = math.radians(lat0)
    per_lat = 111_132.954 - 559.822 * math.cos(2 * phi) + 1.175 * math.cos(4 * phi)
    per_lon = 111_412.84 * math.cos(phi) - 93.5 * math.cos(3 * phi)
    return (lat - lat0) * per_lat, (lon - lon0) * per_lon


def distance_m(flight: Flight) -> float | None:
    """Metres over ground: by the simulator's truth, else by the speed; a receiver's positions jitter, and their way only grows."""
    truth = flight.tracks.get("truth")
    if truth:
        return track_length_m(truth.lat, truth.lon)
    speed = flight.series.get("sog_mps") or flight.series.get("speed_mps")
    if speed:
        steps = zip(speed.v, speed.t, speed.t[1:], strict=False)
        return sum(v * min(after - t, _PAUSE_S) for v, t, after in steps if v >= _AT_REST_MPS)
    track = flight.tracks.get("estimate")
    return track_length_m(track.lat, track.lon) if track else None


def track_length_m(lat: list[float], lon: list[float]) -> float:
    """Length of a track."""
    total = 0.0
    for index in range(1, len(lat)):
        total += math.hypot(*offset_m(lat[index - 1], lon[index - 1], lat[index], lon[index]))
    return total


def clock(seconds: float) -> str:
    """How long something took, as h:mm:ss."""
    return _clock(round(seconds))


def moment(t_s: float, *, tenths: bool = False) -> str:
    """A point in time, as h:mm:ss: what has not yet passed is not shown, as on a stopwatch and in the page's charts."""
    whole, tenth = divmod(round(t_s * 1e6) // 100_000, 10)
    return f"{_clock(whole)}.{tenth}" if tenths else _clock(whole)


def _clock(whole_s: int) -> str:
    return f"{whole_s // 3600}:{whole_s // 60 % 60:02d}:{whole_s % 60:02d}"
