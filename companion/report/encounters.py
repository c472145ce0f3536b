"""Meetings with other vessels in the report: for each a picture from above and a table, from the run's events."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Final

from mavlink_bridge.language.traffic import TCPA_MOST_S, Role

from .sightings import Sighting
from .verdicts import moment

Meeting = Sequence[Sighting]
Point = tuple[float, float]
"""East and south, in metres or in the picture's units."""
_SIDE: Final = 360.0
_OURS: Final = "#0969da"
_HERS: Final = "#cf222e"
_BETWEEN: Final = "#57606a"
_STILL: Final = 6.0
"""Less than a head's length on the picture is no direction."""
_ROLES: Final = {
    Role.NONE.value: "beside us, or met while we lay still",
    Role.OBSTACLE.value: "in the way",
    Role.STAND_ON.value: "crossing from port",
}
"""Where the role's own word says nothing to a reader, or too much: who crosses from port may be one that we keep clear of (rule 18)."""
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
    """The part of the page about other vessels: who was met, and each meeting; empty where none came near."""
    found = meetings(sightings)
    if not found:
        return ""
    rows = "".join(
        f"<tr><td class=n>{moment(each[0].t_s)}<td><a href='#{_anchor(each)}'>{_title(each)}</a><td class=n>{_role(each)}"
        f"<td class=n>{_nearest_words(each)}<td>{_end(each)}"
        for each in found[:_MOST]
    )
    left_out = f"<p class=soft>{len(found) - _MOST} more are in events.jsonl.</p>" if len(found) > _MOST else ""
    head = "<tr><th>From<th>Vessel<th>Role<th>Nearest, to her antenna<th></tr>"
    return (
        "<section id=meetings><h2>Meetings</h2><p class=soft>Other vessels with risk, by AIS.</p>"
        f"<div class=wide-table><table>{head}{rows}</table></div>{left_out}</section>{''.join(map(_section, found[:_MOST]))}"
    )


def _anchor(meeting: Meeting) -> str:
    return f"encounter-{meeting[0].mmsi}-{meeting[0].t_s:.0f}"


def _title(meeting: Meeting) -> str:
    return html.escape(next((each.name for each in reversed(meeting) if each.name), "") or f"MMSI {meeting[0].mmsi}")


def _role(meeting: Meeting) -> str:
    return html.escape(_ROLES.get(meeting[0].role, meeting[0].role))


def _end(meeting: Meeting) -> str:
    return "past and clear" if meeting[-1].danger == "none" else "not over at the end"


def _nearest(meeting: Meeting) -> Sighting:
    return min(meeting, key=lambda each: math.inf if each.range_m is None else each.range_m)


def _nearest_words(meeting: Meeting) -> str:
    nearest = _nearest(meeting)
    return "" if nearest.range_m is None else f"{nearest.range_m:.0f} m at {moment(nearest.t_s)}"


def _section(meeting: Meeting) -> str:
    first, last = meeting[0], meeting[-1]
    near = _nearest_words(meeting)
    rows = "".join(
        f"<tr><td class=n>{moment(each.t_s)}<td>{html.escape(each.danger)}<td class=n>{_number(each.range_m, 'm')}"
        f"<td class=n>{_number(each.cpa_m, 'm')}<td class=n>{_time(each.tcpa_s)}"
        for each in meeting
    )
    head = "<tr><th>Time<th>Danger<th>Range<th>Least clearance<th>in</tr>"
    return (
        f"<section class=encounter id='{_anchor(meeting)}'><h2>{_title(meeting)}: {_role(meeting)}</h2>"
        f"<p class=soft>MMSI {first.mmsi}, from {moment(first.t_s)} to {moment(last.t_s)}; "
        f"{f'nearest {near} (to her antenna); ' if near else ''}{_end(meeting)}.</p>{_picture(meeting)}{_legend(meeting)}"
        f"<details><summary>Course of the meeting</summary><div class=wide-table><table>{head}{rows}</table></div></details></section>"
    )


def _number(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.0f} {unit}"


def _time(seconds: float | None) -> str:
    return "" if seconds is None or seconds >= TCPA_MOST_S else f"{seconds:.0f} s"


def _legend(meeting: Meeting) -> str:
    lines = ((_OURS, "we"), (_HERS, _title(meeting)), (_BETWEEN, "between both at the nearest"))
    shown = "".join(f"<span><i style='border-color:{colour}'></i>{words}</span>" for colour, words in lines)
    return f"<p class=legend>{shown}<span>disc: where each began, arrow: where each went</span></p>"


def _picture(meeting: Meeting) -> str:
    """Both tracks from above, north up, each with a disc where it begins and an arrow where it ends."""
    lat0, lon0 = meeting[0].at
    east_scale = _METRES_PER_DEG * math.cos(math.radians(lat0))

    def metres(place: tuple[float, float]) -> Point:
        return (place[1] - lon0) * east_scale, (lat0 - place[0]) * _METRES_PER_DEG

    hers = [metres(each.at) for each in meeting]
    ours = [metres(each.own) for each in meeting if each.own is not None]
    xs, ys = [x for x, _ in (*hers, *ours)], [y for _, y in (*hers, *ours)]
    size = max(max(xs) - min(xs), max(ys) - min(ys), 50.0) * 1.15
    left, top = (max(xs) + min(xs) - size) / 2.0, (max(ys) + min(ys) - size) / 2.0

    def placed(points: Sequence[Point]) -> list[Point]:
        return [((x - left) / size * _SIDE, (y - top) / size * _SIDE) for x, y in points]

    nearest = _nearest([each for each in meeting if each.own is not None] or meeting)
    between = [] if nearest.own is None else [metres(nearest.at), metres(nearest.own)]
    return (
        f"<svg viewBox='0 0 {_SIDE:.0f} {_SIDE:.0f}' style='max-width:{_SIDE:.0f}px' role='img' "
        f"aria-label='tracks of the meeting, north up'>{_line(placed(between), _BETWEEN, 1.5)}"
        f"{_track(placed(hers), _HERS)}{_track(placed(ours), _OURS)}"
        f"<text x='6' y='{_SIDE - 8:.0f}' font-size='12' fill='{_BETWEEN}'>{size:.0f} m across, north up</text></svg>"
    )


def _line(points: Sequence[Point], colour: str, width: float) -> str:
    shown = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f"<polyline points='{shown}' fill='none' stroke='{colour}' stroke-width='{width}'/>"


def _track(points: Sequence[Point], colour: str) -> str:
    """A line, a disc at its start, and a head at its end that points on; none for one who lay still."""
    if not points:
        return ""
    disc = f"<circle cx='{points[0][0]:.1f}' cy='{points[0][1]:.1f}' r='5' fill='{colour}'/>"
    x, y = points[-1]
    back = next((each for each in reversed(points) if math.dist(each, points[-1]) > _STILL), None)
    if back is None:
        return disc + _line(points, colour, 2.0)
    turn = math.degrees(math.atan2(y - back[1], x - back[0]))
    head = f"<path d='M7 0L-6 5L-6 -5z' fill='{colour}' transform='translate({x:.1f} {y:.1f}) rotate({turn:.0f})'/>"
    return disc + _line(points, colour, 2.0) + head
