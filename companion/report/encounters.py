"""Meetings with other vessels in the report: for each a picture from above and a table, from the run's events."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Final

from .sightings import Sighting
from .verdicts import moment

_SIDE: Final = 360.0
_MOST: Final = 40
_METRES_PER_DEG: Final = 111_320.0
"""Of latitude; a picture of some hundred metres needs no more."""


def meetings(sightings: Sequence[Sighting]) -> list[list[Sighting]]:
    """Sightings by vessel, each from risk to past and clear; in the order in which they began."""
    found: list[list[Sighting]] = []
    open_by: dict[int, list[Sighting]] = {}
    for sighting in sightings:
        meeting = open_by.get(sighting.mmsi)
        if meeting is None:
            if sighting.danger == "none":
                continue
            meeting = open_by[sighting.mmsi] = []
            found.append(meeting)
        meeting.append(sighting)
        if sighting.danger == "none":
            del open_by[sighting.mmsi]
    return found


def sections(sightings: Sequence[Sighting]) -> str:
    """The part of the page about other vessels; empty where none came near."""
    found = meetings(sightings)
    if not found:
        return ""
    left_out = f"<p class=soft>{len(found) - _MOST} more are in events.jsonl.</p>" if len(found) > _MOST else ""
    return "".join(_section(meeting) for meeting in found[:_MOST]) + left_out


def _section(meeting: Sequence[Sighting]) -> str:
    first, last = meeting[0], meeting[-1]
    title = html.escape(next((each.name for each in reversed(meeting) if each.name), "") or f"MMSI {first.mmsi}")
    nearest = min(meeting, key=lambda each: math.inf if each.range_m is None else each.range_m)
    near = (
        "" if nearest.range_m is None else f"nearest {nearest.range_m:.0f} m (to her antenna) at {moment(nearest.t_s)}"
    )
    rows = "".join(
        f"<tr><td class=n>{moment(each.t_s)}<td>{html.escape(each.danger)}<td class=n>{_number(each.range_m, 'm')}"
        f"<td class=n>{_number(each.cpa_m, 'm')}<td class=n>{_number(each.tcpa_s, 's')}"
        for each in meeting
    )
    head = "<tr><th>Time<th>Danger<th>Range<th>Least clearance<th>in</tr>"
    end = "past and clear" if last.danger == "none" else "not over at the end"
    return (
        f"<section class=encounter id='encounter-{first.mmsi}-{first.t_s:.0f}'><h2>{title}: {html.escape(first.role)}</h2>"
        f"<p class=soft>MMSI {first.mmsi}, from {moment(first.t_s)} to {moment(last.t_s)}; {near}; {end}.</p>{_picture(meeting)}"
        f"<details><summary>Course of the meeting</summary><div class=wide-table><table>{head}{rows}</table></div></details></section>"
    )


def _number(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.0f} {unit}"


def _picture(meeting: Sequence[Sighting]) -> str:
    """Both tracks from above, north up: ours blue, hers red, a line between them at the nearest."""
    lat0, lon0 = meeting[0].at
    east_scale = _METRES_PER_DEG * math.cos(math.radians(lat0))

    def metres(place: tuple[float, float]) -> tuple[float, float]:
        return (place[1] - lon0) * east_scale, (lat0 - place[0]) * _METRES_PER_DEG

    hers = [metres(each.at) for each in meeting]
    ours = [metres(each.own) for each in meeting if each.own is not None]
    xs, ys = [x for x, _ in (*hers, *ours)], [y for _, y in (*hers, *ours)]
    size = max(max(xs) - min(xs), max(ys) - min(ys), 50.0) * 1.1
    left, top = (max(xs) + min(xs) - size) / 2.0, (max(ys) + min(ys) - size) / 2.0

    def place(point: tuple[float, float]) -> str:
        return f"{(point[0] - left) / size * _SIDE:.1f},{(point[1] - top) / size * _SIDE:.1f}"

    def line(points: Sequence[tuple[float, float]], colour: str) -> str:
        shown = " ".join(map(place, points))
        return f"<polyline points='{shown}' fill='none' stroke='{colour}' stroke-width='2'/>"

    nearest = min(
        (each for each in meeting if each.own is not None),
        key=lambda each: math.inf if each.range_m is None else each.range_m,
        default=None,
    )
    between = (
        "" if nearest is None or nearest.own is None else line([metres(nearest.at), metres(nearest.own)], "#57606a")
    )
    return (
        f"<svg viewBox='0 0 {_SIDE:.0f} {_SIDE:.0f}' width='{_SIDE:.0f}' height='{_SIDE:.0f}' role='img' "
        f"aria-label='tracks of the meeting, north up'>{line(ours, '#0969da')}{line(hers, '#cf222e')}{between}"
        f"<text x='6' y='{_SIDE - 8:.0f}' font-size='12' fill='#57606a'>{size:.0f} m across, north up</text></svg>"
    )
